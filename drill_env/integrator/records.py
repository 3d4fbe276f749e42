"""Records shared by the compiled integrator: one pointer each instead of many arrays."""

import numpy as np

from drill_env.effects.signal import MOST_BRANCHES, MOST_INNER, MOST_STATES, PORTS, SIGNAL
from drill_env.parameters.record import N_PARAMETERS

N_STATE = 4
# No step is judged by the error of this angle: it is the integral of a speed that is judged.
THETA_L = 3
MOST_ROWS = N_STATE + MOST_INNER
# Columns of the sensitivities: by the initial state, the external torques, the parameters.
LOAD_U, LOAD_L = N_STATE, N_STATE + 1
FIRST_PARAMETER = N_STATE + 2
N_COLUMNS = FIRST_PARAMETER + N_PARAMETERS
# Of a rig with effects at most: by the initial state, the parameters, the effects' numbers.
MOST_COLUMNS = 64
MAX_COEFFICIENTS = 8
MAX_STAGES = 16
# Place for a state that is no stage of a step.
SPARE = MAX_STAGES
# Order of the event functions: of the discs, of the clamped law, of the effects' switches.
UPPER, LOWER, LOWER_LAW, FIRST_SWITCH = 0, 1, 2, 3

# Longer steps leap over the steep friction near rest without the error estimate noticing.
STEPS_PER_PERIOD = 28.0

RUN = np.dtype(
    [
        ("y", "f8", (N_STATE,)),  # twist, omega_u, omega_l, theta_l
        ("mode", "i8", (3,)),  # upper, lower slip direction; clamped
        ("t", "f8"), ("h", "f8"),  # time, and step to try next
        ("max_speed", "f8"),
        # Place in the voltage, the samples and the log, and counts.
        ("piece", "i8"), ("sample", "i8"), ("logged", "i8"),
        ("steps", "i8"), ("rejected", "i8"), ("events", "i8"),
        ("chatter", "i8"),  # events since time last moved
        # Of rigs with effects: these count time from here, and the rest is theirs.
        ("origin", "f8"),
        ("z", "f8", (MOST_INNER,)),  # inner states
        ("branch", "i8", (MOST_BRANCHES,)),  # that each switch is on
        ("push", "i8", (2,)),  # direction in which a disc at rest would leave
        ("since", "f8", (2,)),  # when it came to rest, s
    ],
    align=True,
)  # fmt: skip
"""What one integration carries on."""

WORK = np.dtype(
    [
        ("rtol", "f8"), ("atol", "f8"),
        ("event_tol", "f8"),  # event function below which its zero is taken as found
        ("max_step", "f8"), ("max_steps", "i8"),
        # Fastest rate of an inner state at a step's start and end, 1/s, and how it grows, 1/s^2.
        ("pace", "f8", (3,)),
        ("extrema", "i8"), ("sensitivity", "i8"),
        ("columns", "i8"),  # sensitivities carried: all, or those before the parameters
        ("start", "f8"), ("end", "f8"),  # of the present voltage piece, and its polynomial
        ("coefficients", "i8"), ("piece", "f8", (MAX_COEFFICIENTS,)),
        # The voltage of a delay ago, in the same piece; no coefficients where nothing reads it.
        ("late", "i8"), ("past", "f8", (MAX_COEFFICIENTS,)),
        # Addresses and lengths of what `advance` was called with.
        ("breaks", "i8"), ("pieces", "i8"), ("piece_count", "i8"),
        ("t_eval", "i8"), ("samples", "i8"), ("out", "i8"), ("modes", "i8"),
        ("log", "i8"), ("log_size", "i8"), ("sens_out", "i8"),
        ("has_rates", "i8"),  # whether stage 0 is already filled
        # Rates and values at each stage: of the state, then of the inner states.
        ("k", "f8", (MAX_STAGES + 1, MOST_ROWS)), ("ys", "f8", (MAX_STAGES + 1, MOST_ROWS)),
        ("shares", "f8", (MAX_STAGES + 1, 2)),  # of the lower friction law at each stage
        ("dense", "f8", (MOST_ROWS, 7)), ("turn", "f8", (N_STATE,)),
        # Sensitivities, and slope of the lower law and forcing of every column at the stages.
        ("sens", "f8", (N_STATE, N_COLUMNS)), ("ks", "f8", (MAX_STAGES, N_STATE, N_COLUMNS)),
        ("stage", "f8", (N_STATE, N_COLUMNS)), ("jac", "f8", (4,)),
        ("slopes", "f8", (MAX_STAGES,)), ("force", "f8", (MAX_STAGES, 2, N_COLUMNS)),
        # Of rigs with effects: address and count of their entries, and working arrays.
        ("effects", "i8"), ("acting", "i8"),
        ("restless", "i8"),  # what changes while nothing moves: 0 none, 1 inner states, 2 others
        ("asked", "i8"),  # row for which they were asked last
        ("sided", "i8"),  # whether they differ between the two sides of a disc at rest
        ("own_law", "i8"),  # whether the lower law is read at the disc's own speed
        ("inner", "i8"), ("switches", "i8"),  # of all of them
        ("inner_out", "i8"),  # address of the inner states at the samples, or 0
        ("gaps", "f8", (MAX_STAGES + 1, 3 + MOST_BRANCHES)),  # a mode ends where one is negative
        ("next", "i8", (MOST_BRANCHES,)),
        ("net", "f8", (2,)),  # torques on the discs but for their friction, Nm
        # Of each disc at rest on its side -1 and 1: stiction left, and friction below none, Nm.
        ("held", "f8", (2, 2)), ("driving", "f8", (2, 2)),
        # There too: rates of the inner states, and functions of the switches.
        ("kz_sides", "f8", (2, MOST_INNER)), ("gap_sides", "f8", (2, MOST_BRANCHES)),
        ("z_slopes", "f8", (5, MOST_STATES)),  # how these rates change with the inner states
        ("signal", SIGNAL), ("ports", PORTS),
        # Of rigs with effects whose sensitivities are asked for: address of a record of `SLOPES`
        # and of its matrix, columns to hand out, and whether the event at hand has been located.
        ("variation", "i8"), ("variation_at", "i8"), ("width", "i8"), ("located", "i8"),
    ],
    align=True,
)  # fmt: skip
"""Options and working arrays of one thread."""

EVENT = np.dtype([("t", "f8"), ("disc", "i8"), ("kind", "i8"), ("y", "f8", (N_STATE,))], align=True)
"""One logged event."""

TABLEAU = np.dtype(
    [
        # Addresses of its compiled code; `carry` is 0 where no sensitivities are asked for, the
        # second row where no effects are, and the third serves their sensitivities.
        ("advance", "i8"), ("step", "i8"), ("fill", "i8"), ("carry", "i8"),
        ("rates", "i8"), ("stage", "i8"), ("gap", "i8"), ("change", "i8"),
        ("mark", "i8"), ("jump", "i8"),
        ("stages", "i8"), ("extra", "i8"), ("order", "f8"), ("degree", "i8"),
        ("a", "f8", (MAX_STAGES, MAX_STAGES)), ("c", "f8", (MAX_STAGES,)),
        ("error_high", "f8", (MAX_STAGES,)), ("error_low", "f8", (MAX_STAGES,)),
        ("dense", "f8", (MAX_STAGES, 7)),
    ],
    align=True,
)  # fmt: skip
"""One explicit Runge-Kutta pair with dense output.

`stages` come before the derivative at the step's end, whose row of `a` holds the
solution's weights; `extra` stages serve the dense output only. The interpolant is
y(s) = y0 + h sum_jm dense[j, m] K_j s^(m+1).
"""


def new_work(
    rtol: float, atol: float, max_step: float = np.inf, *,
    extrema: bool = False, sensitivity: bool = False, event_tol: float = 1e-16,
) -> np.ndarray:  # fmt: skip
    """Options and working arrays, shape (1,)."""
    work = np.zeros(1, dtype=WORK)
    work["rtol"], work["atol"], work["max_step"] = rtol, atol, max_step
    work["event_tol"] = event_tol
    work["max_steps"] = 200_000_000
    work["extrema"], work["sensitivity"] = extrema, sensitivity
    work["columns"] = N_COLUMNS
    work["sens"][0, :, :N_STATE] = np.eye(N_STATE)
    return work
