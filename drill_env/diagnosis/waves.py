"""Waves without a name: a cosine of one frequency of time, or of one order of an angle."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy.ndimage import uniform_filter1d

from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env.diagnosis.grids import MOST_PLACES
from drill_env.diagnosis.linearised import Linearised
from drill_env.diagnosis.scan import Scored, best_point, information_of
from drill_env.diagnosis.shapes import COORDINATES, TURN, middle
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import Effect, EffectParameter
from drill_env.effects.along import Motion
from drill_env.parameters import Rig

# Torque on the upper and on the lower disc of a wave of size 1.
_SIGNS = {"upper": (1.0, 0.0), "lower": (0.0, 1.0), "both": (-1.0, 1.0)}
_USUAL = {"upper": 0.02, "lower": 3e-4, "both": 3e-4}
# Fewer cycles over what a recording covers are a drift, which other shapes tell.
_CYCLES = 3.0
_LOWEST_ORDER, _HIGHEST_ORDER = 0.5, 60.0
_HIGHEST_HZ = 40.0
# Bins of a turn and of a second for the search of peaks.
_BINS = 512
_PEAKS = 3
# Frequencies or orders at which the information of a wave is computed and not interpolated.
_PROBES = 8
# Peaks' widths over which the mean is what noise gives, where that is more than the information.
_AROUND = 40
_FINER = 2


@dataclass(frozen=True, slots=True)
class Wave(Named):
    """A wave as a source of terms: the effect has a formula and stands in no library."""

    @property
    def made_of(self) -> tuple[str, ...]:
        """No parameter of the rig: it is a torque of its own."""
        return ()

    def response(self, q: FloatArray, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """The wave's torques; it misreads nothing."""
        along = middle(COORDINATES[self.effect.depends_on](motion))
        torque = np.outer(q[0] * np.cos(self.rate * q[2] * along + q[1]), self.signs)
        return torque, np.zeros_like(torque)

    @property
    def signs(self) -> tuple[float, float]:
        """Torque on the upper and on the lower disc where the wave is 1."""
        return _SIGNS[self.effect.equation]

    @property
    def rate(self) -> float:
        """Radians of phase for one unit of the coordinate at frequency or order 1."""
        return TURN if self.effect.depends_on == "time" else 1.0


def period_of(term: Term) -> float:
    """Way along its coordinate after which a wave comes back: s or rad."""
    assert isinstance(term.source, Wave)
    return TURN / (term.source.rate * float(term.q[2]))


def one_period(term: Term, count: int) -> tuple[FloatArray, FloatArray]:
    """Evenly spaced values of a wave's coordinate over one period, and the wave there."""
    turn = TURN * np.arange(count) / count
    return turn * period_of(term) / TURN, term.q[0] * np.cos(turn + term.q[1])


def formula_of(term: Term) -> str:
    """The wave as a formula with its numbers."""
    assert isinstance(term.source, Wave)
    size, turn, cycles = term.q.tolist()
    name = term.source.effect.depends_on
    inner = f"2 pi {cycles:.4g} t" if name == "time" else f"{cycles:.4g} {name}"
    return f"{size:.3g} cos({inner} {'-' if turn < 0 else '+'} {abs(turn):.3g})"


def _refused(*given: Any) -> None:
    raise NotImplementedError("a wave without a name runs as a table of its period")


def _wave(component: Literal["upper", "lower", "string"], name: str) -> Wave:
    equation = "both" if component == "string" else component
    if name == "time":
        number = EffectParameter("frequency", "Hz", "shape", (), 1e-3, 200.0)
        formula, words = "torque cos(2 pi frequency t + phase)", "at a fixed frequency"
    else:
        number = EffectParameter("order", "1", "shape", (), 0.1, 500.0)
        formula, words = f"torque cos(order {name} + phase)", "with the angle of a disc"
    place = "of the string" if component == "string" else f"on the {component} disc"
    return Wave(
        Effect(
            id=f"{component}_wave_of_{name}",
            component=component,
            equation=equation,
            depends_on=name,
            parameters=(
                EffectParameter("torque", "Nm", "amplitude", (_USUAL[equation],), 0.0, 5.0),
                EffectParameter("phase", "rad", "phase", (0.0,), -7.0, 7.0),
                number,
            ),
            formula=formula,
            meaning=f"A torque {place} that comes and goes {words}.",
            kernel=_refused,
        )
    )


_PLACES: tuple[tuple[Literal["upper", "lower", "string"], str], ...] = (
    ("upper", "time"), ("upper", "theta_u"), ("lower", "time"), ("lower", "theta_l"),
    ("string", "theta_u"), ("string", "theta_l"),
)  # fmt: skip
# Under a prescribed motion of the upper disc, torques on it are not felt, and one of the string is
# one on the lower disc: over its angle both waves are the same.
_NOT_IF_MOVED = (("upper", "time"), ("upper", "theta_u"), ("string", "theta_l"))
_KNOWN_AS = {
    "upper_wave_of_time": "upper_disturbance",
    "upper_wave_of_theta_u": "torque_ripple",
    "lower_wave_of_time": "lower_disturbance",
}


def free_waves(known: Container[str], *, moved: bool = False) -> list[Wave]:
    """The waves for which the library has no name.

    Args:
        known: ids of the library; an effect of the same formula is its name.
        moved: whether the motion of the upper disc is the input. Then no torque there shows, and
            one of the string is a torque on the lower disc: over its angle they are the same.
    """
    places = [place for place in _PLACES if not (moved and place in _NOT_IF_MOVED)]
    waves = [_wave(component, name) for component, name in places]
    return [wave for wave in waves if _KNOWN_AS.get(wave.id, "") not in known]


def score_waves(linearised: Linearised, waves: Iterable[Wave]) -> list[Scored]:
    """The best numbers of each wave, best first."""
    found = each(lambda wave: _best(linearised, wave), waves)
    scored = [Scored(s.term, s.gain / linearised.dispersion) for s in found if s is not None]
    return sorted(scored, key=lambda s: -s.gain)


def _best(linearised: Linearised, wave: Wave) -> Scored | None:
    peaks, apart = _peaks(linearised, wave)
    best = best_point(linearised, wave, _points(wave, peaks, apart, (-0.25, 0.0, 0.25)))
    for level in range(_FINER):
        if best is None:
            break
        shares = 0.125 * 0.4**level * np.array([-1.0, -0.5, 0.5, 1.0])
        points = _points(wave, [float(best.term.q[2])], apart, shares.tolist())
        finer = best_point(linearised, wave, points)
        if finer is not None and finer.gain > best.gain:
            best = finer
    return best


def _points(
    wave: Wave, cycles: Sequence[float], apart: float, shares: Sequence[float]
) -> list[FloatArray]:
    usual = wave.effect.parameters[0].grid[0]
    return [np.array([usual, 0.0, c + share * apart]) for c in cycles for share in shares]


def _peaks(linearised: Linearised, wave: Wave) -> tuple[list[float], float]:
    """Frequencies or orders of most promise, and the width of a peak.

    The slope of the likelihood by a wave's two amplitudes is the Fourier transform of that by a
    torque: one transform tells all of them. Recordings share the phase.
    """
    along = [middle(COORDINATES[wave.effect.depends_on](k.motion)) for k in linearised.known]
    first = min(float(values.min()) for values in along)
    span = max(float(values.max()) for values in along) - first
    longest = max(float(np.ptp(values)) for values in along)
    if not longest > 0.0:
        return [], 1.0
    # A motion that goes further than the grid has places for is binned more coarsely.
    bins = min(_BINS * wave.rate / TURN, MOST_PLACES / (4.0 * span))
    size = int(2 ** np.ceil(np.log2(4.0 * (span * bins + 2.0))))
    pull = np.concatenate([p @ wave.signs for p in linearised.pull])
    place = np.floor((np.concatenate(along) - first) * bins).astype(np.int64)
    power = np.abs(np.fft.rfft(np.bincount(place, weights=pull, minlength=size))) ** 2
    cycles = np.arange(len(power), dtype=np.float64) * (bins * TURN / (wave.rate * size))
    apart = TURN / (wave.rate * longest)
    low, high = _range(linearised, wave, apart)
    kept = (cycles >= low) & (cycles <= high)
    if kept.sum() < 2:
        return [], apart
    cycles, power = cycles[kept], power[kept]
    wide = min(int(_AROUND * apart / (cycles[1] - cycles[0])), len(power))
    usual = uniform_filter1d(power, wide, mode="constant")
    gains = power / np.maximum(usual, _information(linearised, wave, cycles))
    return _highest(cycles, gains, apart), apart


def _range(linearised: Linearised, wave: Wave, apart: float) -> tuple[float, float]:
    if wave.effect.depends_on != "time":
        return max(_LOWEST_ORDER, _CYCLES * apart), _HIGHEST_ORDER
    interval = max(k.samples.recording.interval for k in linearised.known)
    return _CYCLES * apart, min(_HIGHEST_HZ, 0.45 / interval)


def _information(linearised: Linearised, wave: Wave, cycles: FloatArray) -> FloatArray:
    """Information about a wave's amplitudes, at few frequencies and between them."""
    probes = np.geomspace(cycles[0], cycles[-1], _PROBES)
    usual = wave.effect.parameters[0].grid[0]
    terms = [Term(wave, np.array([usual, 0.0, probe])) for probe in probes.tolist()]
    both = information_of(linearised, terms) / usual**2
    told = np.maximum(both.reshape(_PROBES, 2).mean(axis=1), 1e-300)
    between = np.interp(np.log(cycles), np.log(probes), np.log(told))
    return np.exp(between, dtype=np.float64)


def _highest(cycles: FloatArray, gains: FloatArray, apart: float) -> list[float]:
    found: list[float] = []
    for place in np.argsort(-gains).tolist():
        if all(abs(cycles[place] - other) > 2.0 * apart for other in found):
            found.append(float(cycles[place]))
        if len(found) == _PEAKS:
            break
    return found
