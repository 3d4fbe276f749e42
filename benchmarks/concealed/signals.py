"""Voltage families of the cases: what is fitted and what is held out never share one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from benchmarks.concealed.plant import play

Array = NDArray[np.float64]
RATE, SECONDS, TOP = 200.0, 60.0, 5.0
# Above it the paper's friction turns negative and a free run may jump between branches.
FASTEST = 16.0


def _times() -> Array:
    return np.arange(round(SECONDS * RATE)) / RATE


def _steps(rng: np.random.Generator, shortest: float, longest: float, levels: Array) -> Array:
    t, u, end = _times(), np.zeros(round(SECONDS * RATE)), 0.0
    for level in levels:
        start, end = end, end + rng.uniform(shortest, longest)
        u[(t >= start) & (t < end)] = level
    return u


def _random_steps(rng: np.random.Generator) -> Array:
    levels = rng.uniform(-4.5, 4.5, 60)
    levels[rng.random(60) < 0.15] *= 0.02
    return _steps(rng, 0.8, 3.0, levels)


def _sines(rng: np.random.Generator) -> Array:
    frequencies, phases = rng.uniform(0.01, 0.3, 10), rng.uniform(0.0, 2.0 * np.pi, 10)
    wave = np.sin(2.0 * np.pi * np.outer(_times(), frequencies) + phases).sum(axis=1)
    return 4.8 * wave / np.abs(wave).max()


def _constants(rng: np.random.Generator) -> Array:
    side = rng.choice([-1.0, 1.0])
    levels = side * np.array([rng.uniform(2.2, 3.6), rng.uniform(3.4, 4.6), 0.0,
                              -rng.uniform(2.2, 4.0), rng.uniform(1.0, 2.2)])  # fmt: skip
    return _steps(rng, 12.0, 14.0, np.append(levels, levels[-1]))


def _ramp(rng: np.random.Generator) -> Array:
    side, top = rng.choice([-1.0, 1.0]), rng.uniform(4.0, 4.8)
    knots = [0.0, rng.uniform(18.0, 24.0), rng.uniform(38.0, 44.0), SECONDS]
    return side * np.interp(_times(), knots, [0.0, top, 0.0, -rng.uniform(2.0, 3.5)])


def _parabola(rng: np.random.Generator) -> Array:
    phase = _times() / SECONDS
    side, top = rng.choice([-1.0, 1.0]), rng.uniform(4.2, 4.8)
    return side * (top - (top + rng.uniform(1.5, 3.0)) * (2.0 * phase - 1.0) ** 2)


def _harmonic(rng: np.random.Generator) -> Array:
    offset, frequency = rng.uniform(-1.0, 1.0), rng.uniform(0.03, 0.12)
    return offset + 3.6 * np.sin(2.0 * np.pi * frequency * _times())


def _chirp(rng: np.random.Generator) -> Array:
    t, first, last = _times(), rng.uniform(0.01, 0.03), rng.uniform(0.15, 0.3)
    offset = rng.uniform(0.0, 1.5) * rng.choice([-1.0, 1.0])
    return offset + 3.4 * np.sin(2.0 * np.pi * (first * t + (last - first) * t**2 / 2 / SECONDS))


def _square(rng: np.random.Generator) -> Array:
    period, share = rng.uniform(8.0, 16.0), rng.uniform(0.4, 0.6)
    high, low = rng.uniform(2.5, 4.2), rng.uniform(-3.0, 1.5)
    return np.where((_times() / period) % 1.0 < share, high, low)


FAMILIES: dict[str, Callable[[np.random.Generator], Array]] = {
    "random steps": _random_steps, "sines": _sines, "constants": _constants, "ramp": _ramp,
    "parabola": _parabola, "harmonic": _harmonic, "chirp": _chirp, "square": _square,
}  # fmt: skip
# One of each pair is fitted; the two held out are drawn from what is left.
_PAIRS = (("random steps", "sines"), ("constants", "square"), ("ramp", "parabola"),
          ("harmonic", "chirp"))  # fmt: skip


def draw_families(rng: np.random.Generator) -> tuple[list[str], list[str]]:
    """Names of four families to fit and of two others to hold out."""
    fitted = [str(rng.choice(pair)) for pair in _PAIRS]
    left = [name for name in FAMILIES if name not in fitted]
    return fitted, [str(name) for name in rng.choice(left, 2, replace=False)]


def signal(name: str, rng: np.random.Generator, rig: np.ndarray) -> Array:
    """Voltages of a family, made smaller until the bare rig stays below 16 rad/s, shape (n,)."""
    u = np.clip(FAMILIES[name](rng), -TOP, TOP)
    times = np.arange(len(u) + 1) / RATE
    for _ in range(12):
        fastest = float(np.abs(play(rig, u, times, substeps=5).states[:, 3]).max())
        if fastest <= FASTEST:
            break
        u *= 0.9
    return np.round(u, 5)
