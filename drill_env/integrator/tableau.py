"""Runge-Kutta coefficients, taken from SciPy's published pairs."""

import functools
from typing import Any

import numpy as np
from numpy.polynomial import polynomial as poly
from scipy import integrate

from drill_env._types import FloatArray
from drill_env.integrator._bs23 import bs23_fill, bs23_sensitivity, bs23_step
from drill_env.integrator._dop853 import dop853_fill, dop853_step
from drill_env.integrator._dopri5 import dopri5_fill, dopri5_sensitivity, dopri5_step
from drill_env.integrator._effect_slopes import carry_with_effects, jump_after_event, mark_event
from drill_env.integrator._variational import step_sensitivity
from drill_env.integrator.acting import gap_with_effects, rates_with_effects, stage_with_effects
from drill_env.integrator.advance import run_pieces
from drill_env.integrator.modes import change_with_effects
from drill_env.integrator.records import MAX_STAGES, TABLEAU


def _dop853_dense() -> FloatArray:
    """SciPy's nested interpolant, expanded to monomials once and for all."""
    n = integrate.DOP853.n_stages
    step = np.zeros(MAX_STAGES)
    step[:n] = integrate.DOP853.B
    start, end = np.zeros(MAX_STAGES), np.zeros(MAX_STAGES)
    start[0] = end[n] = 1.0
    rows = [step, start - step, 2.0 * step - (end + start), *integrate.DOP853.D]
    dense = np.zeros((MAX_STAGES, len(rows)))
    basis = np.array([1.0])
    for i, row in enumerate(rows):
        basis = poly.polymul(basis, [0.0, 1.0] if i % 2 == 0 else [1.0, -1.0])
        dense += np.outer(row, np.pad(basis[1:], (0, len(rows) - len(basis) + 1)))
    return dense


def _steps(source: Any) -> tuple[int, np.ndarray]:
    """How many stages a pair of SciPy's has, and what is laid out alike for all pairs."""
    n, out = source.n_stages, np.zeros(1, dtype=TABLEAU)
    out["stages"] = n
    out["a"][0, :n, : source.A.shape[1]], out["a"][0, n, :n] = source.A, source.B
    out["c"][0, : n + 1] = np.append(source.C, 1.0)
    return n, out


def _dop853() -> np.ndarray:
    n, out = _steps(integrate.DOP853)
    out["extra"], out["order"], out["degree"] = 3, 8, 7
    out["a"][0, n + 1 :] = integrate.DOP853.A_EXTRA
    out["c"][0, n + 1 :] = integrate.DOP853.C_EXTRA
    out["error_high"][0, : n + 1] = integrate.DOP853.E5
    out["error_low"][0, : n + 1] = integrate.DOP853.E3
    out["dense"][0] = _dop853_dense()
    return out


def _short(source: Any) -> np.ndarray:
    n, out = _steps(source)
    out["order"], out["degree"] = source.order, source.P.shape[1]
    out["error_high"][0, : n + 1] = source.E
    out["dense"][0, : n + 1, : source.P.shape[1]] = source.P
    return out


_PAIRS = {
    "dop853": (_dop853(), dop853_step, dop853_fill, step_sensitivity),
    "dopri5": (_short(integrate.RK45), dopri5_step, dopri5_fill, dopri5_sensitivity),
    # Of order 3: for steps that are short beside the motion.
    "bs23": (_short(integrate.RK23), bs23_step, bs23_fill, bs23_sensitivity),
}

METHODS = ("dop853", "dopri5")
"""The pairs that a simulation offers."""


@functools.cache
def tableau(name: str, sensitivity: bool = False, effects: bool = False) -> np.ndarray:
    """A pair as a record, shape (1,), with the addresses of its code: for this process alone.

    Args:
        name: "dop853", "dopri5" or "bs23".
        sensitivity: whether it shall carry sensitivities too, which is more to compile.
        effects: whether the rig has effects, likewise.
    """
    numbers, step, fill, carry = _PAIRS[name]
    out = numbers.copy()
    out["advance"], out["step"], out["fill"] = run_pieces.address, step.address, fill.address
    out["carry"] = carry.address if sensitivity and not effects else 0
    if effects:
        out["rates"], out["stage"] = rates_with_effects.address, stage_with_effects.address
        out["gap"], out["change"] = gap_with_effects.address, change_with_effects.address
    if effects and sensitivity:
        out["carry"] = carry_with_effects.address
        out["mark"], out["jump"] = mark_event.address, jump_after_event.address
    return out
