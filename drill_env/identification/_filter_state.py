"""Working arrays and records of the filter."""

import numpy as np

from drill_env.integrator.records import N_STATE
from drill_env.parameters.record import N_PARAMETERS

N_FILTER = 6
D_U, D_L = 4, 5
N_START = 5
START_OFFSET = 4
N_SLOPES = N_PARAMETERS + N_START

FILTER = np.dtype(
    [
        ("variance", "f8", (2,)),  # of the latent torques, Nm^2
        ("rate", "f8", (2,)),  # reciprocal of their correlation times, 1/s
        ("robust", "f8"),  # innovations beyond so many standard deviations lose weight
        ("release", "f8"),  # innovations beyond so many standard deviations free a stuck disc
        ("relative", "i8"),  # whether theta_l is read as its difference from theta_u
        ("slopes", "i8"),  # columns of S; 0 for none
        ("summed", "i8"),  # whether gradient and information are wanted
        ("offset", "f8"),
        ("load", "f8", (2,)),  # known torques on the discs, Nm
        # Effects at the filtered state: their torques (Nm), the slopes of these by the speeds,
        # into how many parts the coming interval is cut, and whether nothing came before.
        ("acted", "f8", (2,)),
        ("answer", "f8", (2,)),
        ("rates", "f8", (2,)),  # of both speeds, foreseen, rad/s^2
        ("bend", "f8", (2, 2)),
        ("parts", "i8"),
        ("fresh", "i8"),
        ("y", "f8", (N_FILTER,)),
        ("P", "f8", (N_FILTER, N_FILTER)),
        ("S", "f8", (N_FILTER, N_SLOPES)),
        ("F", "f8", (N_STATE, N_FILTER)),
        ("FP", "f8", (N_FILTER, N_FILTER)),
        ("FS", "f8", (N_STATE, N_SLOPES)),
        ("PH", "f8", (N_FILTER,)),
        ("slope", "f8", (N_SLOPES,)),
        ("value", "f8"),  # -2 log likelihood without its constant
        ("volume", "f8"),  # product of the variances that are not in it yet
        ("count", "i8"),
    ],
    align=True,
)
"""Working arrays and sums of one recording's filter."""


def path_type(readings: int) -> np.dtype:
    """What the filter did at one row, enough to smooth and to carry any other error through it.

    Args:
        readings: 2, or 4 with velocities.
    """
    return np.dtype(
        [
            ("F", "f8", (N_STATE, N_FILTER)),  # transition into the row
            ("gain", "f8", (readings, N_FILTER)),  # of each reading; 0 where no sample is
            ("white", "f8", (readings,)),  # innovations over their standard deviations
            ("weight", "f8", (readings,)),  # reciprocals of these, 1/rad or s/rad
            ("stuck", "i8", (2,)),
            ("P", "f8", (N_FILTER, N_FILTER)),  # covariance after the row's samples
        ],
        align=True,
    )


# Compiled code is kept by the type of its arguments: one for each kind of recording.
PATH, PATH_WITH_VELOCITIES = path_type(2), path_type(4)
