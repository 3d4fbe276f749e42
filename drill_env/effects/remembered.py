"""What the effects of a rig remember along a known motion."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.effects._remember import remember_along
from drill_env.effects._signal import MEMORY, RESPONSE, SIGNAL
from drill_env.effects.along import Motion
from drill_env.effects.declared import declared, new_memories
from drill_env.friction import kernel_record
from drill_env.parameters import Rig


def memories_along(rig: Rig, motion: Motion, counts: IntArray, rows: IntArray) -> FloatArray:
    """Memories with which a run can go on from rows of a known motion.

    Args:
        rig: parameters and effects.
        motion: how the rig moved, taken as straight between the rows.
        counts: substeps of each interval in the run that goes on, shape (n - 1,).
        rows: to go on from, ascending, shape (r,).

    Returns:
        Shape (r, effects, MEMORY).

    Raises:
        InputError: an effect of the rig is wrong.
    """
    bundle = declared(rig)
    kept = np.zeros((len(rows), len(bundle.codes), MEMORY))
    if len(bundle.codes) and len(rows):
        remember_along(
            kernel_record(rig)[0], bundle, new_memories(bundle), np.zeros(1, dtype=SIGNAL)[0],
            np.zeros(1, dtype=RESPONSE)[0], motion.t, motion.u, motion.states, motion.restarts,
            np.asarray(counts, dtype=np.int64), np.asarray(rows, dtype=np.int64), kept,
        )  # fmt: skip
    return kept
