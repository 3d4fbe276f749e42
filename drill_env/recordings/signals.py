"""Voltages to play on the rig: the paper's validation signals, steps and a chirp."""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass, fields
from typing import Literal, TypeAlias, cast, get_args

import numpy as np

from drill_env._checks import real, whole
from drill_env._errors import InputError
from drill_env._types import FloatArray

SignalKind: TypeAlias = Literal[
    "quasi-random", "harmonic", "constant", "ramp", "parabolic", "chirp", "steps"
]
SIGNAL_KINDS: tuple[SignalKind, ...] = get_args(SignalKind)

_LONGEST = 20_000_000
# Shares of the limit: (offset, amplitude). The paper names its signals and, in Fig. 3, shows
# 50 s within +-5 V; where it says no more, these keep the lower disc in the range of Fig. 4.
_LEVELS: dict[SignalKind, tuple[float, float]] = {
    "quasi-random": (0.0, 1.0),
    "harmonic": (0.5, 0.4),
    "constant": (0.7, 0.0),
    "ramp": (0.0, 1.0),
    "parabolic": (0.0, 1.0),
    "chirp": (0.5, 0.4),
    "steps": (0.0, 1.0),
}
_DWELL: dict[SignalKind, float] = {"quasi-random": 1.5, "steps": 3.0}
_FREQUENCY: dict[SignalKind, float] = {"harmonic": 0.2, "chirp": 0.02}
_USED: dict[SignalKind, tuple[str, ...]] = {
    "quasi-random": ("seed", "dwell", "smoothing"),
    "harmonic": ("frequency",),
    "constant": (),
    "ramp": (),
    "parabolic": (),
    "chirp": ("frequency", "frequency_end"),
    "steps": ("seed", "dwell"),
}
_COMMON = ("kind", "seconds", "rate", "limit", "offset", "amplitude")


@dataclass(frozen=True, slots=True)
class Signal:
    """A voltage to play, described by a few numbers; `signal_samples` gives its samples.

    - ``quasi-random``: random levels, each held for a random time, behind a first-order lag
    - ``steps``: the same without the lag
    - ``harmonic``: offset + amplitude sin(2 pi frequency t)
    - ``chirp``: the same, its frequency rising linearly to `frequency_end`
    - ``ramp``, ``parabolic``: offset + amplitude (t/seconds), or its square
    - ``constant``: the offset

    Args:
        kind: one of `SIGNAL_KINDS`.
        seconds: duration in s, 50 as in Fig. 3 of the paper.
        rate: samples per second.
        limit: largest voltage the drive takes, V; 5 as in Fig. 3.
        offset: centre or start in V; a share of the limit by default.
        amplitude: largest departure from the offset in V; a share of the limit by default.
        seed: of the random levels and holding times.
        dwell: mean time a random level is held, s.
        smoothing: time constant of the lag of ``quasi-random``, s.
        frequency: of ``harmonic``, or where ``chirp`` begins, Hz.
        frequency_end: where ``chirp`` ends, Hz.

    Raises:
        InputError: a value is out of range, or the voltage would pass the limit.
    """

    kind: SignalKind
    seconds: float = 50.0
    rate: float = 200.0
    limit: float = 5.0
    offset: float | None = None
    amplitude: float | None = None
    seed: int = 0
    dwell: float | None = None
    smoothing: float = 0.25
    frequency: float | None = None
    frequency_end: float = 1.0

    def __post_init__(self) -> None:
        _validate(self)

    @property
    def levels(self) -> tuple[float, float]:
        """Offset and amplitude in V, defaults settled."""
        offset, amplitude = (share * self.limit for share in _LEVELS[self.kind])
        if self.offset is not None:
            offset = self.offset
            # The default amplitude gives way to a stated offset.
            amplitude = math.copysign(min(abs(amplitude), self.limit - abs(offset)), amplitude)
        return offset, amplitude if self.amplitude is None else self.amplitude

    @property
    def text(self) -> str:
        """One line, as typed behind ``drill-env signal``; `parse_signal` reads it."""
        words: list[str] = [self.kind]
        for entry in fields(self)[1:]:
            value = getattr(self, entry.name)
            if value != entry.default:
                words.append(f"--{entry.name.replace('_', '-')} {value!r}")
        return " ".join(words)


def parse_signal(text: str) -> Signal:
    """Read the one-line form of a signal.

    Args:
        text: kind and options, for example "chirp --offset 2 --frequency-end 1.5".

    Raises:
        InputError: an unknown kind or option, or a value that is no number.
    """
    try:
        kind, *words = shlex.split(text) or [""]
    except ValueError as error:
        raise InputError(f"signal {text!r}: {error}; close the quotation") from error
    names = [entry.name for entry in fields(Signal)][1:]
    values: dict[str, float | int] = {}
    for option, value in zip(words[::2], [*words[1::2], ""], strict=False):
        name = option.removeprefix("--").replace("-", "_")
        if not option.startswith("--") or name not in names:
            known = " ".join(f"--{n.replace('_', '-')}" for n in names)
            raise InputError(f"signal {text!r}: unknown option {option!r}; known: {known}")
        try:
            values[name] = int(value) if name == "seed" else float(value)
        except ValueError as error:
            raise InputError(f"signal {text!r}: {option} needs a number, not {value!r}") from error
    return Signal(cast(SignalKind, kind), **values)  # pyright: ignore[reportArgumentType]


def signal_samples(signal: Signal) -> tuple[FloatArray, FloatArray]:
    """The samples of a signal, to be held from each time to the next.

    Returns:
        Times in s from 0 and voltages in V, both of shape (seconds * rate,).
    """
    count = round(signal.seconds * signal.rate)
    t = np.arange(count) / signal.rate
    offset, amplitude = signal.levels
    u = offset + amplitude * _shape(signal, t)
    # Rounding must not pass the limit.
    return t, np.clip(u, -signal.limit, signal.limit)


def _shape(signal: Signal, t: FloatArray) -> FloatArray:
    """The signal between -1 and 1, shape (n,)."""
    share = t / signal.seconds
    match signal.kind:
        case "constant":
            return np.zeros_like(t)
        case "ramp":
            return share
        case "parabolic":
            return share**2
        case "harmonic":
            return np.sin(2.0 * np.pi * _frequency(signal) * t)
        case "chirp":
            start = _frequency(signal)
            rise = (signal.frequency_end - start) / signal.seconds
            return np.sin(2.0 * np.pi * (start * t + 0.5 * rise * t**2))
        case "steps":
            return _random_levels(signal, t)
        case "quasi-random":
            return lagged(_random_levels(signal, t), signal.smoothing * signal.rate)


def _frequency(signal: Signal) -> float:
    return _FREQUENCY[signal.kind] if signal.frequency is None else signal.frequency


def _dwell(signal: Signal) -> float:
    return _DWELL[signal.kind] if signal.dwell is None else signal.dwell


def _random_levels(signal: Signal, t: FloatArray) -> FloatArray:
    rng = np.random.default_rng(signal.seed)
    # No hold is shorter than half the mean: the first of a longer one outlasts the signal too.
    dwell = min(_dwell(signal), 2.0 * signal.seconds)
    count = math.ceil(2.0 * signal.seconds / dwell) + 1
    ends = np.cumsum(rng.uniform(0.5 * dwell, 1.5 * dwell, count))
    levels = rng.uniform(-1.0, 1.0, count)
    return levels[np.searchsorted(ends, t, side="right")]


def lagged(levels: FloatArray, samples: float) -> FloatArray:
    """Values behind a first-order lag that begins at 0.

    Args:
        levels: evenly spaced, shape (n,).
        samples: the lag's time constant in samples; 0 for no lag.
    """
    if samples == 0.0:
        return levels
    from scipy.signal import lfilter

    pole = math.exp(-1.0 / samples)
    return np.asarray(lfilter([1.0 - pole], [1.0, -pole], levels), dtype=np.float64)


def _validate(signal: Signal) -> None:
    name = signal.kind
    if name not in SIGNAL_KINDS:
        raise InputError(f"signal kind is {name!r}: give one of {', '.join(SIGNAL_KINDS)}")
    for entry in fields(signal)[1:]:
        value, option = getattr(signal, entry.name), f"--{entry.name.replace('_', '-')}"
        if entry.name == "seed":
            whole(value, f"signal {name}: {option}", 0)
        elif value is not None:
            real(value, f"signal {name}: {option}")
        if value != entry.default and entry.name not in (*_COMMON, *_USED[name]):
            used = ", ".join(f"--{n.replace('_', '-')}" for n in (*_COMMON[1:], *_USED[name]))
            raise InputError(f"signal {name} has no {option}; it takes {used}")
    _check_ranges(signal)


def _check_ranges(signal: Signal) -> None:
    name = signal.kind
    above_zero = ("seconds", "rate", "limit", "dwell", "frequency")
    for key in (*above_zero, "smoothing", "frequency_end"):
        value = getattr(signal, key)
        if value is not None and (value < 0 or (value == 0 and key in above_zero)):
            wanted = "greater than 0" if key in above_zero else "0 or greater"
            raise InputError(f"signal {name}: --{key.replace('_', '-')} is {value}: give {wanted}")
    count = signal.seconds * signal.rate
    # Not rounded: a product of two large numbers may be infinite.
    if not 1.5 <= count < _LONGEST + 0.5:
        raise InputError(
            f"signal {name}: {signal.seconds:g} s at {signal.rate:g} Hz are {count:.3g} samples; "
            f"give 2 to {_LONGEST}"
        )
    if name in _DWELL and signal.seconds / _dwell(signal) > _LONGEST:
        raise InputError(
            f"signal {name}: {signal.seconds:g} s are more than {_LONGEST} levels held for "
            f"{_dwell(signal):g} s; give a longer --dwell or fewer --seconds"
        )
    highest = max(signal.frequency or 0.0, signal.frequency_end if name == "chirp" else 0.0)
    if highest > 0.25 * signal.rate:
        raise InputError(
            f"signal {name}: {highest:g} Hz needs more than {signal.rate:g} samples per second; "
            f"give --rate {4 * highest:g} or more"
        )
    offset, amplitude = signal.levels
    ends = [offset + amplitude]
    ends.append(offset if name in ("ramp", "parabolic") else offset - amplitude)
    if max(abs(end) for end in ends) > signal.limit * (1 + 1e-12):
        raise InputError(
            f"signal {name} would reach {max(ends, key=abs):g} V, more than the limit of "
            f"{signal.limit:g} V; give a smaller --offset or --amplitude, or another --limit"
        )
