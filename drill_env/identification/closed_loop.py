"""One inertia simulated inside its position loop, and identified by the force of that run.

Nothing measured enters the simulated run but its first rows, so that noise in the loop, which
the voltage answers to, does not bias the estimates (closed-loop output error).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.friction import kernel_record
from drill_env.identification._closed_loop import N_SLOPES, run_loop
from drill_env.identification.coordinates import Coordinates
from drill_env.identification.drive import check_axis
from drill_env.identification.initial_state import state_at
from drill_env.identification.inverse_dynamics import relative_error
from drill_env.identification.known_loads import with_added_inertia
from drill_env.identification.one_inertia import identify_one_inertia
from drill_env.identification.position_law import PositionLaw
from drill_env.identification.prediction_error import Buffers
from drill_env.integrator.advance import DONE
from drill_env.integrator.records import EVENT, RUN, new_work
from drill_env.integrator.tableau import tableau
from drill_env.parameters import Rig
from drill_env.recordings import Recording

_RTOL = 1e-7
# A hold is one step or a few; only a rig far from sense takes more.
_MOST_STEPS = 2000
# The velocity at the start is not recorded; the loop forgets it.
_SETTLE = 0.05
_MEMORY = 1.0

OFFSET = ("Ju", "Tsu", "dTsu", "bu")
ASYMMETRIC = (*OFFSET, "dbu")


@dataclass(frozen=True, slots=True, eq=False)
class ClosedLoopRun:
    """A simulated closed loop at the rows of a recording.

    Attributes:
        u: voltages of the law, V, shape (n,).
        theta_u: simulated positions, shape (n,).
        slopes: d u / d (km, Ju, Tsu, dTsu, bu, dbu), shape (n, 6), or no rows.
    """

    u: FloatArray
    theta_u: FloatArray
    slopes: FloatArray


@dataclass(frozen=True, slots=True)
class ClosedLoopResult:
    """An axis identified by its simulated closed loop.

    Attributes:
        rig: the estimate, its km as given.
        law: the position law.
        free: names of the estimated parameters.
        standard_errors: of them; what is left of the force may be coloured for up to 1 s.
            Where only a few short spells tell a parameter, as accelerations tell Ju, they
            are somewhat too small.
        fit_errors: relative force error of the simulated loop on each fitted recording, by
            source, share of 1.
        fit_error: the same on all of them together.
        holdout_errors: the same on each held-out recording, by source.
        samples: forces fitted.
    """

    rig: Rig
    law: PositionLaw
    free: tuple[str, ...]
    standard_errors: Mapping[str, float]
    fit_errors: Mapping[str, float]
    fit_error: float
    holdout_errors: Mapping[str, float]
    samples: int

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)


def simulate_closed_loop(
    recording: Recording,
    rig: Rig,
    law: PositionLaw,
    *,
    speed: float | None = None,
    slopes: bool = False,
) -> ClosedLoopRun:
    """Run a one-inertia rig under a position law along the reference of a recording.

    Args:
        recording: with u, theta_u and the law's reference and no gaps; of u and theta_u only
            the first rows are used, where the law lacks its past.
        rig: one inertia.
        law: as found by `find_position_law`, say.
        speed: velocity at the first row, from the rows that follow it by default.
        slopes: whether to return sensitivities too.

    Raises:
        InputError: the rig has two inertias, a column is missing, the recording has gaps, or
            the loop is unstable.
    """
    if rig.inertias != 1:
        raise InputError("the closed loop needs a one-inertia rig (inertias = 1 in its file)")
    if recording.has_note("gap"):
        raise InputError(
            f"{recording.source}: the time has gaps, and the loop ran on in them; cut the "
            "recording at the gaps"
        )
    check_axis([recording])
    if recording.load_u is not None or recording.effects or recording.coasts():
        raise InputError(
            f"{recording.source}: a measured load, an effect of the recording or a bridge that is "
            "off does not act on the simulated closed loop; leave --reference out"
        )
    recording.channel("theta_u")
    rows = len(recording)
    u, y = recording.channel("u").copy(), np.zeros(rows)
    run = np.zeros(1, dtype=RUN)
    run["y"], run["h"] = state_at(recording, rig, 0), recording.interval
    if speed is not None:
        run["y"][0, 1] = speed
    work = new_work(_RTOL, 0.1 * _RTOL, sensitivity=slopes, event_tol=1e-12)
    work["max_steps"] = _MOST_STEPS
    found = np.zeros((rows if slopes else 0, N_SLOPES, 2))
    buffers = Buffers(
        np.zeros(2), np.zeros((1, 1)), np.zeros(0), np.zeros((0, 4)),
        np.zeros((0, 2), dtype=np.int64), np.zeros(256, dtype=EVENT), np.zeros((0, 4, 1)),
    )  # fmt: skip
    heavy = with_added_inertia(rig, recording)
    status = run_loop(
        kernel_record(heavy)[0], run[0], work[0], tableau("dopri5", slopes)[0], law.record()[0],
        recording.t - recording.t[0], recording.interval, law.wanted(recording),
        law.added(recording), u, y, found, np.zeros((N_SLOPES, 2)), buffers,
    )  # fmt: skip
    if status != DONE or not np.isfinite(u).all():
        raise InputError(
            f"{recording.source}: the simulated loop is unstable with kp = {law.kp:.4g}, "
            f"kv = {law.kv:.4g} and this rig; check the gains, the gain km and the units"
        )
    return ClosedLoopRun(u, y, found[:, :, 1])


def closed_loop_error(recording: Recording, rig: Rig, law: PositionLaw) -> float:
    """Relative error of the simulated loop's force on a recording, as a share of 1."""
    run, kept = simulate_closed_loop(recording, rig, law), _kept(recording)
    return relative_error(recording.channel("u")[kept], run.u[kept])


def identify_closed_loop(
    fit: Sequence[Recording],
    gain: float | None,
    law: PositionLaw,
    *,
    holdout: Sequence[Recording] = (),
    free: Sequence[str] = ASYMMETRIC,
    start: Rig | None = None,
) -> ClosedLoopResult:
    """Fit a one-inertia rig so that its simulated closed loop has the recorded force.

    Args:
        fit: recordings to fit together, with the law's reference.
        gain: force or torque per volt, km, known from elsewhere.
        law: the position law.
        holdout: recordings to judge by.
        free: parameters to estimate among Ju, Tsu, dTsu, bu and dbu; dTsu and dbu are 0 where
            they are not free.
        start: first guess; the inverse-dynamics estimate by default.

    Raises:
        InputError: an argument or a recording does not fit.
    """
    unknown = sorted(set(free) - set(ASYMMETRIC))
    if unknown or not free:
        raise InputError(f"free is {', '.join(free)}: give names among {', '.join(ASYMMETRIC)}")
    start = start or identify_one_inertia(fit, gain).rig
    asymmetries = {n: 0.0 for n in ("dTsu", "dbu") if n not in free}
    base = start.replace(**({} if gain is None else {"km": gain}), **asymmetries)
    coordinates = Coordinates(base, tuple(n for n in ASYMMETRIC if n in free))
    vector, left, slopes = _descended(fit, law, coordinates)
    rig = coordinates.rig(vector)
    errors = _standard_errors(left, slopes, fit, coordinates.jacobian(vector))
    force = rig.km * np.concatenate([r.channel("u")[_kept(r)] for r in fit])
    return ClosedLoopResult(
        rig=rig, law=law, free=coordinates.free, samples=len(force),
        standard_errors=dict(zip(coordinates.free, errors, strict=True)),
        fit_errors={r.source: closed_loop_error(r, rig, law) for r in fit},
        fit_error=relative_error(force, force - left),
        holdout_errors={r.source: closed_loop_error(r, rig, law) for r in holdout},
    )  # fmt: skip


def _kept(recording: Recording) -> slice:
    return slice(math.ceil(_SETTLE * recording.rate), len(recording))


def _left(
    fit: Sequence[Recording], law: PositionLaw, coordinates: Coordinates, vector: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Recorded minus simulated force, shape (n,), and its derivatives, shape (n, free)."""
    rig = coordinates.rig(vector)
    columns = [("km", *ASYMMETRIC).index(name) for name in coordinates.free]
    misses, slopes = [], []
    for recording in fit:
        run, kept = simulate_closed_loop(recording, rig, law, slopes=True), _kept(recording)
        misses.append(rig.km * (recording.channel("u") - run.u)[kept])
        slopes.append(-rig.km * run.slopes[kept][:, columns])
    return np.concatenate(misses), np.concatenate(slopes) @ coordinates.jacobian(vector)


def _descended(
    fit: Sequence[Recording], law: PositionLaw, coordinates: Coordinates
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Coordinates of the least squares, what is left of the force there and its derivatives."""
    from scipy.optimize import least_squares

    first = coordinates.vector(coordinates.base)
    # The start must run; what the descent tries on its way need not.
    rows = len(_left(fit, law, coordinates, first)[0])

    def at(vector: FloatArray) -> tuple[FloatArray, FloatArray]:
        try:
            return _left(fit, law, coordinates, vector)
        except (InputError, OverflowError):
            return np.full(rows, 1e6 * coordinates.base.km), np.zeros((rows, len(vector)))

    found = least_squares(lambda v: at(v)[0], first, lambda v: at(v)[1], x_scale="jac")
    return (found.x, *_left(fit, law, coordinates, found.x))


def _standard_errors(
    left: FloatArray, slopes: FloatArray, fit: Sequence[Recording], turn: FloatArray
) -> list[float]:
    """Of the parameters, from the correlation of what is left, Bartlett's weights on its lags."""
    from scipy.signal import correlate, fftconvolve

    middle, stop = np.zeros_like(turn), 0
    for recording in fit:
        start, stop = stop, stop + len(recording) - _kept(recording).start
        rows, part = left[start:stop], slopes[start:stop]
        lags = min(round(_MEMORY * recording.rate), len(rows) - 1)
        window = np.bartlett(2 * lags + 3)[1:-1] / len(rows)
        shared = correlate(rows, rows, method="fft")[len(rows) - 1 - lags : len(rows) + lags]
        middle += part.T @ fftconvolve(part, (window * shared)[:, None], mode="same", axes=0)
    inverse = turn @ np.linalg.pinv(slopes.T @ slopes, rcond=1e-14)
    return np.sqrt(np.maximum(np.diag(inverse @ middle @ inverse.T), 0.0)).tolist()
