"""Whether a residual repeats in time, at a phase of its own in each recording.

Pumps, governors and a shaking floor go on between two recordings, so no clock of theirs tells the
phase, and no function of time or motion that was learnt from some recordings foresees it in others.
The frequency is the same in all. It is sought in the fitted ones by their periodograms (Schuster,
Terrestrial Magnetism 3, 1898) and asked of those held out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.residual_torque import PREDICTABLE
from drill_env.diagnosis.result import DiagnosisResult, FoundShape, Located
from drill_env.prediction.criteria import Criteria

# Points of a periodogram for each frequency that the longest recording resolves: a line between
# two of them loses 5 % at most, sinc^2(1/8) (Harris, Proceedings of the IEEE 66, 1978).
_FINER = 4
# Resolved frequencies: next to a line, which its main lobe and the first beside it fill, and beyond
# them those of which the median is its background (not derived: more follow a steep spectrum
# worse). As many periods must a recording hold.
_NEXT, _AROUND = 2, 6
# Rows a second that are looked at, and the share of the frequencies that these tell; above it a
# cosine is no longer told from another one.
_RATE, _SLOWER = 50.0, 0.8
# Values in which one period is drawn.
_DRAWN = 32


@dataclass(frozen=True, slots=True, eq=False)
class Residual:
    """What a fit leaves of one recording.

    Attributes:
        t: times, s, shape (n,).
        values: of the residual, shape (n,).
        drive: voltage or torque there, shape (n,).
    """

    t: FloatArray
    values: FloatArray
    drive: FloatArray

    def evenly(self, step: float) -> Residual:
        """The same every so many s."""
        t = np.arange(self.t[0], self.t[-1], step)
        return Residual(t, np.interp(t, self.t, self.values), np.interp(t, self.t, self.drive))


@dataclass(frozen=True, slots=True)
class Repetition:
    """A cosine of time that a residual holds.

    Attributes:
        disc: 0 for the upper one, 1 for the lower one.
        frequency: Hz.
        share: of the squares of the residual that were not searched, beyond what frequencies
            around it explain.
        driven: whether it is a share of the drive, and not added to it.
        amplitude: root mean square of its amplitudes, in the residual's unit, or in that over the
            drive's.
    """

    disc: int
    frequency: float
    share: float
    driven: bool
    amplitude: float

    def told(self, unit: float = 1.0) -> tuple[Located, FoundShape, dict[str, Any]]:
        """Where it is, its shape, and its entry among the errors.

        Args:
            unit: what the amplitude counts in: `km` where it is a share of the drive.
        """
        disc, size = ("upper", "lower")[self.disc], self.amplitude / unit
        torque = {"upper": 0.0, "lower": 0.0}
        if not self.driven:
            torque[disc] = size / math.sqrt(2.0)
        located = Located(
            "actuator" if self.driven else disc, disc, "time", "", [], {}, None, self.frequency,
            torque, {"upper": 0.0, "lower": 0.0},
        )  # fmt: skip
        t = np.arange(_DRAWN) / (_DRAWN * self.frequency)
        shape = FoundShape(
            "time", "drive" if self.driven else "torque",
            f"{size:.3g} cos(2 pi {self.frequency:.4g} t + phase)", 1.0,
            t.tolist(), (size * np.cos(2.0 * np.pi * self.frequency * t)).tolist(),
        )  # fmt: skip
        told = {
            "disc": disc, "frequency_hz": self.frequency, "share": self.share, "amplitude": size,
            "driven": self.driven,
        }  # fmt: skip
        return located, shape, told


def with_repetition(result: DiagnosisResult, found: Repetition, km: float) -> DiagnosisResult:
    """A result in which nothing stands, with what repeats.

    Args:
        result: plain values.
        found: what repeats.
        km: of the fitted rig, Nm/V.
    """
    located, shape, told = found.told(km if found.driven else 1.0)
    fit = {**result.fit, "repeats": told}
    return replace(result, verdict="unexplained", located=located, shape=shape, fit=fit)


def repetition_of(
    fitted: Sequence[Residual], held: Sequence[Residual], *, disc: int = 0, driven: bool
) -> Repetition | None:
    """The cosine that explains most of a residual, if it explains enough of it.

    It must explain the share of the held-out recordings from which something is missing, and stand
    out of the frequencies around it there by as much as a name must to be listed.

    Args:
        fitted: among whose frequencies it is sought.
        held: recordings of which it is asked.
        disc: whose residual it is.
        driven: whether it may be a share of the drive.
    """
    every = [*fitted, *held]
    if not fitted or not held or not all(np.any(one.values) for one in every):
        return None
    step = max(1.0 / _RATE, *(float(np.median(np.diff(one.t))) for one in every))
    seconds = max(float(one.t[-1] - one.t[0]) for one in every)
    if seconds > 2.0 * step * max(len(one.t) for one in every):
        # More gap than recording: evenly spaced rows would be made up, and any number of them.
        return None
    fitted, held = ([one.evenly(step) for one in group] for group in (fitted, held))
    f = np.asarray(np.fft.rfftfreq(int(_FINER * seconds / step), step), dtype=np.float64)
    f = f[: int(_SLOWER * len(f))]
    if len(f) < 3 * _FINER * (_NEXT + _AROUND):
        return None
    found = [_best(fitted, held, f, kind) for kind in ((False, True) if driven else (False,))]
    best = max((one for one in found if one), key=lambda one: one.share, default=None)
    return None if best is None or best.share < PREDICTABLE else replace(best, disc=disc)


def _best(
    fitted: Sequence[Residual], held: Sequence[Residual], f: FloatArray, driven: bool
) -> Repetition | None:
    from scipy.special import gammaincc
    from scipy.stats import norm

    seen, unseen = _explained(fitted, f, driven), _explained(held, f, driven)
    slowest = _FINER * (_NEXT + _AROUND)
    beyond = (seen - _background(seen)).sum(axis=0)
    place = slowest + int(np.argmax(beyond[slowest:]))
    # A frequency is known to about what a recording resolves.
    near = np.arange(place - _FINER // 2, min(place + _FINER // 2 + 1, len(f)))
    place = int(near[np.argmax(unseen.sum(axis=0)[near])])
    around = _background(unseen)[:, place]
    # Of noise, a periodogram over its mean is distributed exponentially.
    chance = float(gammaincc(len(held), np.sum(unseen[:, place] / np.maximum(around, 1e-300))))
    if chance > norm.sf(Criteria().z):
        return None
    frequency, share = float(f[place]), float(np.sum(unseen[:, place] - around))
    squares = [_square(one, frequency, driven) for one in (*fitted, *held)]
    return Repetition(0, frequency, share, driven, math.sqrt(float(np.mean(squares))))


def _explained(group: Sequence[Residual], f: FloatArray, driven: bool) -> FloatArray:
    """Share of the squares of residuals that a cosine of each frequency explains in each of them.

    Shape (recordings, frequencies); all of them together are 1 at most.
    """
    length = round(1.0 / (f[1] * (group[0].t[1] - group[0].t[0])))
    explained = np.zeros((len(group), len(f)))
    for i, one in enumerate(group):
        scale = one.drive if driven else np.ones(len(one.t))
        power = np.abs(np.fft.rfft(scale * one.values, length)[: len(f)]) ** 2
        explained[i] = 2.0 * power / max(float(scale @ scale), 1e-300)
    return explained / sum(float(one.values @ one.values) for one in group)


def _background(explained: FloatArray) -> FloatArray:
    """Mean of the noise at each frequency, by the medians of those below and above, the larger.

    The spectrum of a slow torque is steep: the other side alone would leave a slope of it over.
    """
    away, width = _FINER * _NEXT, _FINER * _AROUND
    padded = np.pad(explained, ((0, 0), (away + width,) * 2), mode="edge")
    medians = np.median(np.lib.stride_tricks.sliding_window_view(padded, width, axis=1), axis=2)
    count, above = explained.shape[1], 2 * away + width
    # The median of an exponential distribution is ln 2 of its mean.
    return np.maximum(medians[:, :count], medians[:, above : above + count]) / math.log(2.0)


def _square(one: Residual, frequency: float, driven: bool) -> float:
    """Square of the best amplitude of a cosine and a sine in a residual."""
    phase = 2.0 * np.pi * frequency * one.t
    scale = one.drive if driven else np.ones(len(one.t))
    waves = scale[:, np.newaxis] * np.column_stack([np.cos(phase), np.sin(phase)])
    return float(np.sum(np.linalg.lstsq(waves, one.values, rcond=None)[0] ** 2))
