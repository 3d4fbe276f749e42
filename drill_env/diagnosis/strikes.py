"""A torque of one moment: something struck a disc, in one recording or in all at the same time."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env.diagnosis.linearised import Linearised
from drill_env.diagnosis.scan import Scored, best_point, scored_together
from drill_env.diagnosis.shapes import middle
from drill_env.diagnosis.terms import Named, Shape, Term
from drill_env.effects import Effect
from drill_env.effects.along import Motion
from drill_env.parameters import Rig

_DISCS = ("upper", "lower")
# Share of its duration within which a strike comes, and goes.
_FLANK = 0.1
# Fall of minus twice the log likelihood that speaks for a strike: there are thousands of moments,
# and at some of them a disc is released a little early or late.
_SURE = 100.0
# Share of it below which a first score is not worth a closer look.
_HOPEFUL = 0.3
# Durations in s; what takes longer is a torque of time, which other shapes tell.
_DURATIONS = (0.1, 0.2, 0.4, 0.8, 1.6)
# Moments of single recordings, and of all together, that get a score.
_MOMENTS = 3
# Shares of the duration by which the best moment is moved, and factors by which it is stretched.
_SHIFTS, _STRETCHES = (-0.5, -0.25, 0.0, 0.25, 0.5), (0.7, 1.0, 1.4)
_FINER = 2
_NAMED_AS, _PLACES = "torque_pulse", (0.5, 0.7, 0.85, 1.0)


@dataclass(frozen=True, slots=True)
class Strike(Shape):
    """A torque on one disc over a short time and none before and after, as a source of terms.

    Its one number is the torque; more would follow whatever happens at a release.

    Attributes:
        recording: fingerprint of the one recording that it is in; None for all of them.
        begin: s.
        end: s.
    """

    recording: int | None
    begin: float
    end: float


@dataclass(frozen=True, slots=True)
class Once(Named):
    """An effect of the library that is in one recording and in no other.

    Attributes:
        recording: that recording's fingerprint.
    """

    recording: int = 0

    def response(self, q: FloatArray, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """The effect's torques and reading errors, none in other recordings."""
        if self.recording != motion.recording:
            nothing = np.zeros((len(motion.t), 2))
            return nothing, nothing
        return Named.response(self, q, rig, motion)


@dataclass(frozen=True, slots=True)
class _Moment:
    recording: int | None
    begin: float
    duration: float


def outline(strike: Strike, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times (s) and torques (Nm) between which a strike is straight, 0 at both ends and beyond."""
    return _corners(strike.begin, strike.end), float(q[0]) * np.array([0.0, 1.0, 1.0, 0.0])


def faint(term: Term, gain: float) -> bool:
    """Whether a term stands for something that happened once, and too little speaks for it.

    Args:
        term: of a fit.
        gain: fall of minus twice the log likelihood with it.
    """
    return isinstance(term.source, (Strike, Once)) and gain < _SURE


def score_strikes(linearised: Linearised, discs: Sequence[int] = (0, 1)) -> list[Scored]:
    """The best moment on each of some discs at which something may have struck it, best first.

    The slope of the likelihood by a torque that is held for a while is the sum of those by the
    torque of each row: one pass tells all moments.
    """
    found = [s for s in each(lambda disc: _best_on(linearised, disc), discs) if s is not None]
    return sorted(found, key=lambda s: -s.gain)


def _best_on(linearised: Linearised, disc: int) -> Scored | None:
    best = _best_of(linearised, disc, _moments_of(linearised, disc))
    for level in range(_FINER):
        if best is None or best.gain < _HOPEFUL * _SURE:
            break
        finer = _best_of(linearised, disc, _around(_strike_of(best), 0.5**level))
        best = max(best, finer or best, key=lambda s: s.gain)
    return best


def named_strikes(
    linearised: Linearised, strikes: Sequence[Scored], effects: Sequence[Effect]
) -> list[Scored]:
    """Strikes as the effect that the library has for them, where it has one."""
    hopeful = [_strike_of(s) for s in strikes if s.gain > _HOPEFUL * _SURE]
    named = [e for e in effects if e.id == _NAMED_AS]
    found = []
    for effect, strike in itertools.product(named, hopeful):
        if strike.component != effect.component:
            continue
        source = (
            Named(effect) if strike.recording is None else Once(effect, recording=strike.recording)
        )
        begin, length = strike.begin, strike.end - strike.begin
        usual = effect.parameters[0].grid[0]
        points = [
            source.bounded(np.array([usual, begin + shift * length, share * length]))
            for share in _PLACES
            for shift in (0.0, 0.5 * (1.0 - share), 1.0 - share)
        ]
        best = best_point(linearised, source, points)
        if best is not None:
            found.append(Scored(best.term, best.gain / linearised.dispersion))
    return found


def _best_of(linearised: Linearised, disc: int, moments: Sequence[_Moment]) -> Scored | None:
    scored = scored_together(linearised, [_strike(disc, m) for m in moments])
    return max(scored, key=lambda s: s.gain, default=None)


def _strike_of(scored: Scored) -> Strike:
    strike = scored.term.source
    assert isinstance(strike, Strike)
    return strike


def _strike(disc: int, moment: _Moment) -> Strike:
    begin, end = moment.begin, moment.begin + moment.duration
    corners = _corners(begin, end)

    def basis(rig: Rig, motion: Motion) -> tuple[FloatArray | None, FloatArray | None]:
        loads = np.zeros((len(motion.t), 2, 1))
        if moment.recording is None or moment.recording == motion.recording:
            loads[:, disc, 0] = np.interp(middle(motion.t), corners, [0.0, 1.0, 1.0, 0.0])
        return loads, None

    return Strike(
        f"{_DISCS[disc]}_torque_at_a_moment", _DISCS[disc], "time", "torque",
        (0.5 * (begin + end),), basis, moment.recording, begin, end,
    )  # fmt: skip


def _corners(begin: float, end: float) -> FloatArray:
    flank = _FLANK * (end - begin)
    return np.array([begin, begin + flank, end - flank, end])


def _around(strike: Strike, share: float) -> list[_Moment]:
    begin, duration = strike.begin, strike.end - strike.begin
    moments = []
    for stretch in _STRETCHES:
        length = duration * stretch**share
        for shift in _SHIFTS:
            start = begin + 0.5 * (duration - length) + share * shift * duration
            moments.append(_Moment(strike.recording, start, length))
    return moments


def _moments_of(linearised: Linearised, disc: int) -> list[_Moment]:
    """Moments of single recordings and of all together that stand out against all others."""
    interval = max(k.samples.recording.interval for k in linearised.known)
    first = min(float(k.motion.t[0]) for k in linearised.known)
    last = max(float(k.motion.t[-1]) for k in linearised.known)
    size = int((last - first) / interval) + 1
    pulls = []
    period = linearised.fit.rig.natural_period
    for known, pull in zip(linearised.known, linearised.pull, strict=True):
        # What strikes within a period of a start is as well the state that it was begun from.
        told = _since_start(known.motion) >= period
        place = ((known.motion.t - first) / interval + 0.5).astype(np.int64)
        pulls.append(np.bincount(np.minimum(place, size - 1), told * pull[:, disc], minlength=size))
    alone: list[tuple[float, _Moment]] = []
    for known, pull in zip(linearised.known, pulls, strict=True):
        alone += _outstanding(pull, known.motion.recording, first, interval)
    together = _outstanding(np.sum(pulls, axis=0), None, first, interval) if len(pulls) > 1 else []
    return [*_best(alone), *_best(together)]


def _since_start(motion: Motion) -> FloatArray:
    """Time (s) at each row since the state was begun anew."""
    lengths = np.diff([*motion.restarts.tolist(), len(motion.t)])
    return motion.t - np.repeat(motion.t[motion.restarts], lengths)


def _best(moments: Sequence[tuple[float, _Moment]]) -> list[_Moment]:
    return [moment for _, moment in sorted(moments, key=lambda pair: -pair[0])[:_MOMENTS]]


def _outstanding(
    pull: FloatArray, recording: int | None, first: float, interval: float
) -> list[tuple[float, _Moment]]:
    """For each duration the moment that stands out most, and its square over the mean square."""
    total = np.concatenate([[0.0], np.cumsum(pull)])
    found = []
    for duration in _DURATIONS:
        rows = max(int(round(duration / interval)), 1)
        squares = (total[rows:] - total[:-rows]) ** 2
        mean = float(np.mean(squares)) if len(squares) else 0.0
        if mean > 0.0:
            place = int(np.argmax(squares))
            moment = _Moment(recording, first + place * interval, rows * interval)
            found.append((float(squares[place]) / mean, moment))
    return found
