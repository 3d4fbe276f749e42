"""Records that hold one environment each, and what all of them share."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drill_env._types import FloatArray, IntArray
from drill_env.integrator.records import EVENT, N_STATE, RUN, new_work
from drill_env.parameters.record import PARAMETERS

VIEWS = ("both", "surface", "state")
VIEW_BOTH, VIEW_SURFACE, VIEW_STATE = range(3)

REWARD_TERMS = ("track", "error", "twist_rate", "stick", "effort")
TRACK, ERROR, TWIST_RATE, STICK, EFFORT = range(5)
WIDTH, STICK_SPEED = 5, 6

ROW = np.dtype(
    [
        ("run", RUN),
        ("p", PARAMETERS),
        ("voltage", "f8"),
        ("setpoint", "f8"),
        ("memory", "f8", (2, 3)),  # velocity filters of both discs
        ("measured", "f8", (2,)),  # encoder angles
        ("speed", "f8", (2,)),  # filtered velocities
        ("lost", "f8", (2,)),  # angle of the counts missed so far
        ("torque", "f8", (2,)),  # true friction torques
        ("reward", "f8"),
        ("parts", "f8", (len(REWARD_TERMS),)),
        ("friction_factor", "f8"),
        ("friction_step", "i8"),
        ("step", "i8"),
        ("head", "i8"),  # newest place in the ring of past angles
        ("delay", "i8"),  # in encoder samples
        ("noise_row", "i8"),
    ],
    align=True,
)
"""One environment."""

SETTING = np.dtype(
    [
        ("period", "f8"),
        ("samples", "i8"),
        ("quantum", "f8"),
        ("noise_rad", "f8"),
        ("missed", "f8"),
        ("rate", "f8"),
        ("b", "f8", (3,)),
        ("a", "f8", (3,)),
        ("limit", "f8"),
        ("weights", "f8", (7,)),
        ("shown", "i8"),
        ("bounds", "f8", (4,)),
    ],
    align=True,
)
"""Options that all environments share."""


class Rows(NamedTuple):
    """All environments; axis 0 counts them."""

    row: np.ndarray
    ring: FloatArray
    schedule_steps: IntArray
    schedule_values: FloatArray
    noise: FloatArray
    observation: NDArray[np.float32]


class Buffers(NamedTuple):
    """Working arrays of the compiled functions."""

    work: np.ndarray
    log: np.ndarray
    breaks: FloatArray
    piece: FloatArray
    times: FloatArray
    out: FloatArray
    modes: IntArray
    sens: FloatArray


def new_buffers(samples: int, period: float, rtol: float) -> Buffers:
    """Working arrays for `samples` encoder samples per control period (s)."""
    times = period * np.arange(1, samples + 1) / samples
    times[-1] = period
    return Buffers(
        new_work(rtol, 0.1 * rtol, 0.3, event_tol=0.1 * rtol), np.zeros(64, dtype=EVENT),
        np.zeros(2), np.zeros((1, 1)), times, np.zeros((samples, N_STATE)),
        np.zeros((samples, 2), dtype=np.int64), np.zeros((0, 1, 1)),
    )  # fmt: skip
