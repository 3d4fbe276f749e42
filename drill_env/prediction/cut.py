"""Recordings cut into windows that are predicted from their start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion
from drill_env.identification.known_loads import loaded
from drill_env.identification.samples import Samples
from drill_env.integrator.prepared import Prepared
from drill_env.integrator.windows import METHOD, Windows
from drill_env.parameters import Rig
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.likelihood import FAR, scales
from drill_env.prediction.starts import WIDEST, Starts, rows_within, starts_of, widths_of
from drill_env.recordings.units import ANGLES

# Sampling intervals: below them encoder counts are all there is.
_FIRST = 3.0


@dataclass(frozen=True, eq=False)
class Cut:
    """One recording as windows.

    Attributes:
        samples: the recording.
        windows: what is predicted from where.
        target: readings at the predicted rows, shape (w, k, c).
        width: of the readings before and behind a start that tell it, s.
        starts: what tells where each window begins.
        lower: measured angle of the lower disc, rad, where the upper one alone is predicted;
            shape (n,).
    """

    samples: Samples
    windows: Windows
    target: FloatArray
    width: float
    starts: Starts
    lower: FloatArray | None = None

    @cached_property
    def interval(self) -> float:
        """Between two rows, s."""
        return float(np.median(np.diff(self.samples.t)))

    def predicted(
        self, rig: Rig | Prepared, shift: float, windows: Windows | None = None
    ) -> FloatArray:
        """Readings that a rig predicts, rad, shape (w, k, c); infinite where it failed.

        Args:
            rig: parameters and effects; laid out already, where it is asked more than once.
            shift: of the drive behind the readings, in sampling intervals.
            windows: of the same motion; those of the cut by default.
        """
        count, starts = self.target.shape[2], self.starts
        acting, motion, delay = self._acting(rig, shift)
        if windows is not None:
            starts = starts_of(self.samples, windows, count, self.width).led(acting, motion, delay)
        elif _corrected_twice(acting.rig):
            # By how much depends on the state that is sought, so one step of Newton falls short.
            starts = starts.led(acting, motion, delay)
        windows = self.windows if windows is None else windows
        begin, inner = starts.states(acting, motion, delay)
        windows = replace(windows, motion=motion, begin=begin, inner=inner)
        return windows.predicted(acting, shift=delay).readings[..., :count]

    def begun(self, width: float, rig: Rig, shift: float) -> Cut:
        """The same windows with starts from other readings.

        Args:
            width: of those before and behind a start that tell it, s.
            rig: fitted to the recording.
            shift: of the drive, likewise.
        """
        starts = starts_of(self.samples, self.windows, self.target.shape[2], width)
        return replace(self, width=width, starts=starts.led(*self._acting(rig, shift)))

    def _acting(self, rig: Rig | Prepared, shift: float) -> tuple[Prepared, Motion, float]:
        """The rig with what acts on it in this recording, the drive, and its delay, s."""
        motion, delay = self.windows.motion, shift * self.interval
        alone = rig.rig if isinstance(rig, Prepared) else rig
        acting = alone
        if self.lower is not None:
            acting, motion = _pulled(alone, motion, self.lower, delay)
        acting = loaded(acting, self.samples.recording)
        if isinstance(rig, Prepared) and acting is alone:
            return rig, motion, delay
        return Prepared(acting, METHOD), motion, delay

    def errors(self, rig: Rig | Prepared, shift: float) -> FloatArray:
        """Predicted less read, rad; large where the prediction failed; shape (w, k, c)."""
        try:
            gap = self.predicted(rig, shift) - self.target
        except RuntimeError:
            return np.full_like(self.target, FAR)
        return np.where(np.isfinite(gap), np.clip(gap, -FAR, FAR), FAR)


def _corrected_twice(rig: Rig) -> bool:
    """Whether an encoder errs or an effect has inner states."""
    there = [LIBRARY[e["id"]] for e in rig.effects if e["id"] in LIBRARY]
    return any(effect.senses or effect.states for effect in there)


def upper_axis(rig: Rig) -> Rig:
    """The upper disc of a rig without its string."""
    if rig.inertias == 1:
        return rig
    return Rig.one_inertia(
        km=rig.km, Ju=rig.Ju, Tsu=rig.Tsu, dTsu=rig.dTsu, bu=rig.bu, dbu=rig.dbu
    ).replace(effects=rig.effects)


def _pulled(rig: Rig, motion: Motion, lower: FloatArray, delay: float) -> tuple[Rig, Motion]:
    """The upper disc on a string whose other end moves as it was measured."""
    known = np.isfinite(lower)
    # The drive acts late, the string does not; held over an interval is what it is in the middle.
    middle = motion.t + delay + 0.5 * float(np.median(np.diff(motion.t)))
    end = np.interp(middle, motion.t[known], lower[known])
    drive = motion.u + rig.ktheta / rig.km * end
    spring = {"id": "upper_spring", "stiffness": rig.ktheta, "centre": 0.0}
    axis = upper_axis(rig)
    axis = axis.replace(effects=(*axis.effects, spring))
    return axis, replace(motion, u=drive)


def leads_of(samples: Sequence[Samples], criteria: Criteria, horizon: float) -> FloatArray:
    """Times ahead at which windows are judged, s, shape (k,).

    Args:
        samples: recordings that are to be cut.
        criteria: leads, and how many windows there must be.
        horizon: s, shortened where the recordings are too short for it; leads that are no row apart
            are left out.

    Raises:
        InputError: the recordings are too short.
    """
    interval = max(float(np.median(np.diff(s.t))) for s in samples)
    seconds = sum(float(s.t[-1]) for s in samples)
    horizon = min(horizon, seconds / criteria.windows)
    leads = [_FIRST * interval]
    # A lead that is no row after the one before shows nothing else.
    for lead in (share * horizon for share in criteria.leads):
        leads += [lead] if lead >= leads[-1] + interval else []
    if leads[-1] < criteria.leads[-1] * horizon or len(leads) == 1:
        raise InputError(
            f"{samples[0].recording.source}: {seconds:.3g} s at {1.0 / interval:.3g} rows a second "
            "hold too few windows to predict; record longer or at a higher rate"
        )
    return np.array(leads)


def cut(
    samples: Samples, motion: Motion, rig: Rig, leads: FloatArray, *, pulled: bool = False
) -> Cut:
    """Cut a recording into windows side by side, none across a gap.

    Args:
        samples: of the recording.
        motion: as it is read, see `motion_as_read`.
        rig: whose discs are predicted.
        leads: times ahead, s.
        pulled: whether the upper disc alone is predicted, on a string whose other end was measured.

    Raises:
        InputError: a disc's angle is missing.
    """
    lower = samples.angles[:, 1] if pulled else None
    t, channels, side = samples.t, 1 if pulled else rig.inertias, rows_within(samples, WIDEST)
    starts, rows = [], []
    edges = [*samples.restarts.tolist(), len(t)]
    for a, b in zip(edges, edges[1:], strict=False):
        if b - a <= 2 * side:
            continue
        last = min(float(t[b - 1]) - leads[-1], float(t[b - 1 - side]))
        for begin in np.arange(float(t[a + side]), last, leads[-1] + 1e-9).tolist():
            row = int(np.searchsorted(t, begin))
            ahead = _rows(t, row, leads)
            if np.isfinite(samples.angles[ahead][:, :channels]).all():
                starts.append(row)
                rows.append(ahead)
    if not starts:
        raise InputError(
            f"{samples.recording.source}: no stretch of {leads[-1] + WIDEST:.3g} s without a "
            "gap or a missing angle; record longer or repair the file"
        )
    windows = Windows(motion, np.array(starts), np.array(rows))
    target = samples.angles[windows.rows][..., :channels]
    starts = starts_of(samples, windows, channels, WIDEST)
    return Cut(samples, windows, target, WIDEST, starts, lower)


def _rows(t: FloatArray, start: int, leads: FloatArray) -> IntArray:
    """Rows at the leads after a start, each later than the one before."""
    rows = np.maximum(np.searchsorted(t, t[start] + leads - 1e-9), start + 1)
    for k in range(1, len(rows)):
        rows[k] = max(rows[k], rows[k - 1] + 1)
    return np.minimum(rows, len(t) - 1)


def begun_best(cut: Cut, rig: Rig, shift: float, degrees: float) -> Cut:
    """A recording's windows with the starts from which a rig predicts them best.

    Many readings average the encoder's errors, few follow what the rig lacks.

    Args:
        cut: the recording.
        rig: fitted to it.
        shift: of the drive, likewise.
        degrees: of freedom of the errors.
    """
    choices = [cut.begun(width, rig, shift) for width in widths_of(cut.samples)]
    least = rounding_of([cut])

    def logarithms(one: Cut) -> float:
        return float(np.log(scales(one.errors(rig, shift), degrees, least=least)).sum())

    return min(choices, key=logarithms)


def rounding_of(cuts: Sequence[Cut]) -> FloatArray:
    """Standard deviation of the errors of rounding in recordings' readings, rad, shape (c,).

    An error within a step is as likely everywhere in it, so its variance is a twelfth of the step's
    square (Widrow and Kollar, Quantization Noise, 2008).
    """
    read = ANGLES[: cuts[0].target.shape[2]]
    steps = [[c.samples.recording.quanta.get(name, 0.0) for name in read] for c in cuts]
    return np.asarray(np.sqrt(np.mean(np.square(steps), axis=0) / 12.0), dtype=np.float64)
