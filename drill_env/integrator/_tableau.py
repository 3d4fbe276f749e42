"""Runge-Kutta coefficients, taken from SciPy's published pairs."""

import numpy as np
from numpy.polynomial import polynomial as poly
from scipy.integrate import DOP853, RK45

from drill_env._types import FloatArray, Method
from drill_env.integrator._records import MAX_STAGES, TABLEAU


def _dop853_dense() -> FloatArray:
    """SciPy's nested interpolant, expanded to monomials once and for all."""
    n = DOP853.n_stages
    step = np.zeros(MAX_STAGES)
    step[:n] = DOP853.B
    start, end = np.zeros(MAX_STAGES), np.zeros(MAX_STAGES)
    start[0] = end[n] = 1.0
    rows = [step, start - step, 2.0 * step - (end + start), *DOP853.D]
    dense = np.zeros((MAX_STAGES, len(rows)))
    basis = np.array([1.0])
    for i, row in enumerate(rows):
        basis = poly.polymul(basis, [0.0, 1.0] if i % 2 == 0 else [1.0, -1.0])
        dense += np.outer(row, np.pad(basis[1:], (0, len(rows) - len(basis) + 1)))
    return dense


def _dop853() -> np.ndarray:
    n = DOP853.n_stages
    out = np.zeros(1, dtype=TABLEAU)
    out["stages"], out["extra"], out["order"], out["degree"] = n, 3, 8, 7
    a = out["a"][0]
    a[:n, :n] = DOP853.A
    a[n, :n] = DOP853.B
    a[n + 1 :, :] = DOP853.A_EXTRA
    out["c"][0] = np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA])
    out["error_high"][0, : n + 1] = DOP853.E5
    out["error_low"][0, : n + 1] = DOP853.E3
    out["dense"][0] = _dop853_dense()
    return out


def _dopri5() -> np.ndarray:
    n = RK45.n_stages
    out = np.zeros(1, dtype=TABLEAU)
    out["stages"], out["order"], out["degree"] = n, 5, 4
    a = out["a"][0]
    a[:n, : RK45.A.shape[1]] = RK45.A
    a[n, :n] = RK45.B
    out["c"][0, : n + 1] = np.concatenate([RK45.C, [1.0]])
    out["error_high"][0, : n + 1] = RK45.E
    out["dense"][0, : n + 1, :4] = RK45.P
    return out


TABLEAUX: dict[Method, np.ndarray] = {"dop853": _dop853(), "dopri5": _dopri5()}
"""The pairs as records, shape (1,)."""
