"""The signals that the design of experiments chooses from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._errors import InputError
from drill_env.recordings.signals import SIGNAL_KINDS, Signal, SignalKind

_GRID = 20
_DWELLS = (0.5, 1.5, 4.0)
_BANDS = {"harmonic": (0.02, 0.5), "chirp": (0.3, 2.0)}


def menu(
    kinds: Sequence[SignalKind] = SIGNAL_KINDS,
    *,
    seconds: float = 60.0,
    rate: float = 200.0,
    limit: float = 5.0,
    variants: int = 6,
    seed: int = 0,
) -> tuple[Signal, ...]:
    """Signals to choose from: variants of each kind with seeded levels and frequencies.

    Args:
        kinds: see `Signal`.
        seconds: duration of each in s.
        rate: samples per second.
        limit: largest voltage, V.
        variants: of each kind.
        seed: of levels, frequencies and random signals.
    """
    if variants < 1:
        raise InputError(f"variants is {variants}: give 1 or more")
    unknown = [kind for kind in kinds if kind not in SIGNAL_KINDS]
    if unknown or not kinds:
        named = f"{unknown[0]!r} is no" if unknown else "the menu is empty: name a"
        raise InputError(f"menu: {named} kind of signal; known: {', '.join(SIGNAL_KINDS)}")
    found: list[Signal] = []
    for kind in dict.fromkeys(kinds):
        plain = Signal(kind, seconds=seconds, rate=rate, limit=limit)
        rng = np.random.default_rng([seed, SIGNAL_KINDS.index(kind)])
        found += [_variant(plain, number, seed, rng) for number in range(variants)]
    return tuple(dict.fromkeys(found))


def _variant(plain: Signal, number: int, seed: int, rng: np.random.Generator) -> Signal:
    if plain.kind in ("quasi-random", "steps"):
        dwell = min(_DWELLS[number % len(_DWELLS)], plain.seconds)
        return replace(plain, seed=seed + number, dwell=dwell)
    side = -1 if rng.random() < 0.5 else 1
    step = side * plain.limit / _GRID
    if plain.kind == "constant":
        return replace(plain, offset=step * int(rng.integers(1, _GRID + 1)), amplitude=0.0)
    if plain.kind in ("ramp", "parabolic"):
        # From somewhere on one side to the limit on the other.
        start = -int(rng.integers(0, _GRID + 1))
        return replace(plain, offset=step * start, amplitude=step * (_GRID - start))
    centre = int(rng.integers(0, _GRID - 3))
    low, high = (min(f, 0.25 * plain.rate) for f in _BANDS[plain.kind])
    frequency = float(f"{math.exp(rng.uniform(math.log(low), math.log(high))):.2g}")
    moved = replace(plain, offset=step * centre, amplitude=abs(step) * (_GRID - centre))
    if plain.kind == "chirp":
        return replace(moved, frequency_end=min(frequency, high))
    return replace(moved, frequency=min(frequency, high))
