"""Candidates for what is missing, and the numbers in which they are fitted."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from drill_env._types import FloatArray
from drill_env.effects import Effect, EffectParameter
from drill_env.effects.along import Motion
from drill_env.parameters import Rig

Kind: TypeAlias = Literal["linear", "cosine", "sine", "log", "place"]

# Largest torque of an effect beside what moves the disc, in usual sizes of a tenth of that:
# friction of more than most of the drive lets the disc coast; a weight, and drag at the highest
# speeds, may be all of it; a share nine tenths: a drive without force explains nothing.
_MOST, _MOST_WHOLE, _MOST_SHARE = 8.0, 16.0, 18.0
# A size, in usual ones, that counts as none: a descent that is held at 0 is there to rounding.
_NONE = 1e-6
# A shape may leave its grid by this factor.
_BEYOND = 5.0
_LEVELS = (0.4, 0.6, 0.8)
_LEAST_LEVEL = 0.25
_SMALL = 0.05
# Plays from which descents begin, in shares of the way, two a decade: between neighbours a descent
# finds the way, further off it ends at a lower peak. They decide where it begins and no answer.
_PLAYS = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1)
# Of a grid that are looked at: of a gear's five numbers the last ones stay in their middle.
_POINTS = 30


@dataclass(frozen=True, slots=True)
class Scales:
    """Sizes that occur in recordings, from which a candidate's usual numbers follow.

    Attributes:
        torque: that moves the disc, Nm.
        speed: that is hardly exceeded, rad/s.
        voltage: likewise, V.
        middle: angle about which the disc moves, rad.
        way: how far from there, or twist, likewise, rad.
        interval: between rows, s.
        seconds: length of the longest recording.
    """

    torque: float
    speed: float
    voltage: float
    middle: float
    way: float
    interval: float
    seconds: float


def scales_of(rig: Rig, motions: Sequence[Motion], disc: int) -> Scales:
    """Sizes at one disc, 0 the upper one and 1 the lower."""
    states = np.concatenate([m.states for m in motions])
    angle = states[:, 0] if disc else states[:, 0] + states[:, 3]
    inertia = rig.Jl if disc else rig.Ju
    voltage = _high(np.concatenate([m.u for m in motions]), 99)
    torque = rig.ktheta * _high(states[:, 0], 99) if disc else rig.km * voltage
    moved = inertia * _high(states[:, 4 + disc], 90)
    return Scales(
        torque if torque > 0.1 * moved else moved,
        max(_high(states[:, 1 + disc], 95), 1e-9), max(voltage, 1e-9),
        float(np.median(angle)),
        max(_high(angle - np.median(angle), 95), 1e-9),
        float(np.median(np.diff(motions[0].t))), max(float(m.t[-1] - m.t[0]) for m in motions),
    )  # fmt: skip


def _high(values: FloatArray, share: float) -> float:
    return float(np.percentile(np.abs(values), share))


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """Physics that may be missing.

    Attributes:
        id: name in tables.
        component: where it sits.
        depends_on: coordinate that it is a function of.
        kinds: of its numbers.
        usual: what 1 stands for, in SI units; of a logarithm the grid of values.
        low: least numbers.
        high: largest numbers.
        effect: of the library; None for a free shape.
        table: the free shape's entry without values.
    """

    id: str
    component: str
    depends_on: str
    kinds: tuple[Kind, ...]
    usual: tuple[tuple[float, ...], ...]
    low: FloatArray
    high: FloatArray
    effect: Effect | None = None
    table: dict[str, Any] | None = None

    @property
    def size(self) -> int:
        """How many numbers it has."""
        return len(self.kinds)

    def entry(self, z: FloatArray) -> dict[str, Any]:
        """The entry of [[effects]] at some numbers."""
        if self.table is not None:
            values = [u[0] * v for u, v in zip(self.usual, z.tolist(), strict=True)]
            return {**self.table, "values": values}
        assert self.effect is not None
        numbers: list[float] = []
        for i, kind in enumerate(self.kinds):
            if kind == "cosine":
                numbers.append(self.usual[i][0] * math.hypot(z[i], z[i + 1]))
            elif kind == "sine":
                numbers.append(math.atan2(-z[i], z[i - 1]))
            else:
                numbers.append(self._number(i, float(z[i])))
        pairs = zip(self.effect.parameters, numbers, strict=True)
        return {"id": self.id, **{p.name: min(max(v, p.low), p.high) for p, v in pairs}}

    def _number(self, i: int, z: float) -> float:
        if self.kinds[i] == "log":
            return math.exp(z)
        if self.kinds[i] == "place":
            middle, way = self.usual[i]
            return middle + way * z
        return self.usual[i][0] * z

    def starts(self) -> Iterator[tuple[FloatArray, list[int]]]:
        """Numbers of each point of its grid, and which of them it is linear in, 0 there."""
        linear = [i for i, kind in enumerate(self.kinds) if kind not in ("log", "place")]
        choices = [
            usual if kind == "log" else (1.0,)
            for kind, usual in zip(self.kinds, self.usual, strict=True)
        ]
        for i in reversed(range(len(choices))):
            if math.prod(map(len, choices)) > _POINTS:
                choices[i] = (self._middle(i),)
        for point in itertools.product(*choices):
            yield np.log(point), linear

    def _middle(self, i: int) -> float:
        """Of the grid of one number: of shares, or of what may be of any size."""
        assert self.effect is not None
        share = self.effect.parameters[i].unit == "1"
        return float(np.mean(self.usual[i]) if share else np.exp(np.mean(np.log(self.usual[i]))))

    def at_end(self, z: FloatArray) -> bool:
        """Whether a number came to the end of its range, so that it is not determined.

        A size of 0 is such an end: what half of the recordings do without is not there.
        """
        room = 1e-3 * (self.high - self.low)
        room = np.where(self.low == 0.0, np.minimum(room, _NONE), room)
        return bool(((z >= self.high - room) | (z <= self.low + room)).any())


def candidate_of(effect: Effect, scales: Scales) -> Candidate:
    """An effect of the library at the scales of its disc."""
    kinds: list[Kind] = []
    usual: list[tuple[float, ...]] = []
    low: list[float] = []
    high: list[float] = []
    for i, p in enumerate(effect.parameters):
        follows = effect.parameters[i + 1 : i + 2]
        if p.role == "shape" and p.low < 0.0:
            # A place that may lie on either side of 0.
            kinds.append("place")
            usual.append((scales.middle, scales.way))
            low.append(-_BEYOND)
            high.append(_BEYOND)
            continue
        if p.role == "shape":
            values = _grid(p, scales)
            if p.name == "level" and any(q.name == "back_emf" for q in effect.parameters):
                # When the motion turns, the back EMF adds to the voltage that reverses it.
                values = tuple(sorted({*values, *(2.0 * value for value in values)}))
            least = max(p.low, values[0] / _BEYOND, 1e-12)
            if p.name == "level":
                # What cuts off most of the drive lets the rig coast and predicts for that alone.
                least = max(least, _LEAST_LEVEL * scales.voltage)
            kinds.append("log")
            usual.append(values)
            low.append(math.log(least))
            high.append(math.log(max(min(p.high, values[-1] * _BEYOND), least)))
            continue
        if p.role == "phase":
            kinds.append("sine")
            usual.append(usual[-1])
            low.append(low[-1])
            high.append(high[-1])
            continue
        turned = bool(follows) and follows[0].role == "phase"
        size = _usual(p, scales)
        whole = effect.depends_on.startswith("theta") and p.unit in ("Nm", "Nm/rad")
        whole |= p.unit in ("Nm s/rad", "Nm s^2/rad^2")
        most = _MOST_SHARE if p.unit in ("1", "s/rad") else _MOST_WHOLE if whole else _MOST
        most = min(most, p.high / size)
        kinds.append("cosine" if turned else "linear")
        usual.append((size,))
        low.append(-most if turned or p.low < 0.0 else 0.0)
        high.append(most)
    return Candidate(
        effect.id, effect.component, effect.depends_on, tuple(kinds), tuple(usual), np.array(low),
        np.array(high), effect,
    )  # fmt: skip


def _usual(p: EffectParameter, s: Scales) -> float:
    """A tenth of what moves the disc, or a small share."""
    torque = 0.1 * s.torque
    sizes = {
        "Nm": torque, "Nm s/rad": torque / s.speed, "Nm s^2/rad^2": torque / s.speed**2,
        "Nm/rad": torque / s.way, "Nm/rad^3": torque / s.way**3, "1/V": _SMALL / s.voltage,
        "rad": 0.03, "V s/rad": 0.1 * s.voltage / s.speed, "1/min": 0.2,
        "s/rad": _SMALL / s.speed,
    }  # fmt: skip
    return min(sizes.get(p.unit, max(p.grid[0], _SMALL)), p.high)


def _grid(p: EffectParameter, s: Scales) -> tuple[float, ...]:
    """Values that a shape is tried at."""
    if p.name == "level":
        values = [share * s.voltage for share in _LEVELS]
    elif p.name == "delay":
        values = [s.interval * n for n in (2.0, 5.0, 15.0)]
    elif p.unit == "s":
        short = p.grid[0] < 1.0
        values = [0.005, 0.02, 0.08, 0.3] if short else [0.1 * s.seconds, 0.4 * s.seconds]
        if p.name == "time":
            values = [share * s.seconds for share in np.linspace(0.1, 0.9, 9).tolist()]
    else:
        values = {
            "rad/s": [share * s.speed for share in (0.03, 0.1, 0.3, 1.0)],
            "V": [share * s.voltage for share in (0.02, 0.05, 0.1, 0.2)],
            "V/s": [s.voltage / seconds for seconds in (0.5, 0.1, 0.02)],
            "V s/rad": [share * s.voltage / s.speed for share in (0.2, 0.5)],
            "rad": [share * min(s.way, math.pi) for share in _PLAYS],
        }.get(p.unit, list(p.grid))
    inside = {min(max(v, p.low, 1e-12), p.high) for v in values}
    return tuple(sorted(inside))
