"""The vector field of a rig with effects, for equilibria and their stability."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray
from drill_env.integrator._vector_field import rates_along
from drill_env.integrator.acting import rates_with_effects
from drill_env.integrator.prepared import Prepared
from drill_env.integrator.records import RUN, new_work
from drill_env.parameters import Rig


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
