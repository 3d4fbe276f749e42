"""The vector field of a rig with effects, for equilibria and their stability."""

from __future__ import annotations

import numpy as np

from drill_env._jit import entry
from drill_env._types import FloatArray
from drill_env.integrator.acting import rates_with_effects
from drill_env.integrator.prepared import Prepared
from drill_env.integrator.records import N_STATE, RUN, SPARE, new_work
from drill_env.integrator.signatures import call_rates
from drill_env.parameters import Rig


@entry
def rates_along(p, run, work, code, volts, states, rates):
    """Fill the rates of states under constant voltages, see `vector_field` for their shapes.

    `code` is the address of `rates_with_effects`.
    """
    run.mode[0] = run.mode[1] = 1
    run.mode[2] = 0
    work.coefficients = work.late = 1
    work.start, work.end = 0.0, 1.0
    work.signal.choose = 1
    for k in range(volts.size):
        work.piece[0] = work.past[0] = volts[k]
        for i in range(3):
            work.ys[SPARE, i] = states[k, i]
        work.ys[SPARE, 3] = 0.0
        for r in range(work.inner):
            work.ys[SPARE, N_STATE + r] = states[k, 3 + r]
        call_rates(code, p, run, work, SPARE, 0.0, volts[k])
        for i in range(3):
            rates[k, i] = work.k[SPARE, i]
        for r in range(work.inner):
            rates[k, 3 + r] = work.k[SPARE, N_STATE + r]


def vector_field(rig: Rig, volts: FloatArray, states: FloatArray) -> FloatArray:
    """Rates of a rig with effects whose discs both turn forward, equation (4).

    Args:
        rig: parameters and effects, none of which follows time or an angle.
        volts: constant voltages, V, shape (n,).
        states: twist (rad), omega_u, omega_l (rad/s) > 0, then the inner states of the effects,
            shape (n, 3 + m).

    Returns:
        Shape (n, 3 + m).

    Raises:
        InputError: an effect of the rig is wrong.
    """
    prepared, work = Prepared(rig, "dopri5"), new_work(1e-6, 1e-6)
    prepared.equip(work)
    out = np.zeros_like(states)
    rates_along(
        prepared.p[0], np.zeros(1, dtype=RUN)[0], work[0], rates_with_effects.address,
        np.ascontiguousarray(volts, dtype=float), np.ascontiguousarray(states, dtype=float), out,
    )  # fmt: skip
    return out


def first_inner(rig: Rig, volts: float, state: FloatArray) -> FloatArray:
    """Inner states with which a run begins in a state (4,), shape (m,)."""
    prepared, work, run = Prepared(rig, "dopri5"), new_work(1e-6, 1e-6), np.zeros(1, dtype=RUN)
    prepared.equip(work)
    run["y"] = state
    prepared.start(run, work, volts)
    return run["z"][0, : prepared.effects.inner].copy()
