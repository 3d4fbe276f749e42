"""A run that goes on from the middle of a known motion."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray
from drill_env.effects.along import Motion, reading_errors
from drill_env.effects.steady import acting
from drill_env.integrator.simulate import simulate
from drill_env.integrator.voltage import Voltage
from drill_env.parameters import Rig


def resume(
    rig: Rig, motion: Motion, rows: slice, inner: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """Simulate on from a row of a motion, through the voltage that was recorded with it.

    Effects that depend on time count it as the motion does. What they read of the past is that of
    the motion.

    Args:
        rig: parameters and effects.
        motion: how the rig moved.
        rows: from the row to begin with to the one after the last, without a restart between.
        inner: inner states of the effects that move the rig, of `inner_states`; None to begin
            anew.

    Returns:
        States, shape (n, 4), and theta_u and theta_l as the encoders read them, rad, (n, 2).

    Raises:
        InputError: an effect of the rig is wrong.
        RuntimeError: the step size collapsed.
    """
    first = int(motion.restarts[motion.restarts <= rows.start].max())
    known, t = slice(first, rows.stop), motion.t[rows]
    moving = acting(rig)
    run = simulate(
        moving, Voltage(motion.t[known], motion.u[first : rows.stop - 1, None]),
        float(t[-1] - t[0]), t_start=float(t[0]), t_eval=t, initial=motion.states[rows.start, :4],
        inner=inner, method="dopri5", rtol=1e-7, atol=1e-9,
    )  # fmt: skip
    angles = np.column_stack([run.theta_u, run.theta_l])
    if len(moving.effects) < len(rig.effects):
        both = np.vstack([motion.states[first : rows.start, :4], run.state])
        whole = Motion(
            motion.t[known], motion.u[known], np.hstack([both, np.zeros((len(both), 2))]),
            np.zeros(1, dtype=np.int64),
        )  # fmt: skip
        angles += reading_errors(rig, whole)[rows.start - first :]
    return run.state, angles
