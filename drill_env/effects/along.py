"""What an effect does along a known motion of the rig."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.effects import Effect
from drill_env.effects._run import errors_along, torques_along
from drill_env.effects._signal import MEMORY, RESPONSE, SIGNAL
from drill_env.friction import kernel_record
from drill_env.parameters import Rig


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """How the rig moved.

    Attributes:
        t: times in s, shape (n,).
        u: held voltages, V, shape (n,).
        states: twist, omega_u, omega_l, theta_l and both accelerations, shape (n, 6).
        restarts: rows after a gap, and row 0; shape (m,).
        recording: fingerprint of the recording it was told by, see `Recording.fingerprint`.
    """

    t: FloatArray
    u: FloatArray
    states: FloatArray
    restarts: IntArray
    recording: int = 0


def response_along(
    effect: Effect, q: FloatArray, rig: Rig, motion: Motion
) -> tuple[FloatArray, FloatArray]:
    """Torques and encoder errors of an effect.

    Args:
        effect: of `drill_env.effects.LIBRARY`.
        q: its parameters in their order.
        rig: parameters of the rig.
        motion: how the rig moved.

    Returns:
        Mean torques (Nm) on the upper and lower disc over the interval after each row and errors
        (rad) of theta_u and theta_l at each row, both of shape (n, 2).
    """
    p = kernel_record(rig)[0]
    s, out = np.zeros(1, dtype=SIGNAL)[0], np.zeros(1, dtype=RESPONSE)[0]
    result = np.zeros((len(motion.t), 2))
    run = errors_along if effect.senses else torques_along
    run(
        effect.code, p, np.array(q, dtype=np.float64), np.zeros(MEMORY), s, out,
        motion.t, motion.u, motion.states, motion.restarts, result,
    )  # fmt: skip
    nothing = np.zeros_like(result)
    return (nothing, result) if effect.senses else (result, nothing)
