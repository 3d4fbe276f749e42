"""Voltages as piecewise polynomials: constant, sampled or any function of time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import polynomial

from drill_env._errors import InputError
from drill_env._types import FloatArray, VoltageFunction

_DEGREE = 7
_TOLERANCE = 1e-11
_SHORTEST = 1e-9
_MAX_PIECES = 200_000
# Chebyshev nodes on [0, 1], the map from values there to powers, and points to judge by.
_NODES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
_FIT = np.linalg.inv(np.vander(_NODES, increasing=True))
_PROBES = np.array([0.0, 0.037, 0.171, 0.391, 0.613, 0.822, 0.957])
_AT_PROBES = np.vander(_PROBES, _DEGREE + 1, increasing=True)


@dataclass(frozen=True, slots=True)
class Voltage:
    """A voltage over time, in V.

    Attributes:
        breaks: ends of the pieces in s, ascending, shape (n + 1,).
        pieces: coefficients of each piece in powers of its share s in [0, 1],
            shape (n, degree + 1).
    """

    breaks: FloatArray
    pieces: FloatArray

    def __call__(self, t: FloatArray | float) -> FloatArray:
        """Value at times `t` (s); at a jump the one that holds from there on."""
        t = np.asarray(t, dtype=float)
        if self.pieces.size == 1:
            return np.full(t.shape, self.pieces[0, 0])
        i = np.clip(np.searchsorted(self.breaks, t, side="right") - 1, 0, len(self.pieces) - 1)
        share = (t - self.breaks[i]) / (self.breaks[i + 1] - self.breaks[i])
        value = polynomial.polyval(share, self.pieces[i].T, tensor=False)
        return np.asarray(value, dtype=np.float64)


def constant_voltage(volts: float, t_start: float, t_end: float) -> Voltage:
    """One value over [t_start, t_end]."""
    if not np.isfinite(volts):
        raise InputError(f"voltage is {volts}: give a finite number")
    return Voltage(np.array([t_start, t_end]), np.array([[float(volts)]]))


def sampled_voltage(t: FloatArray, u: FloatArray, t_end: float | None = None) -> Voltage:
    """Zero-order hold: ``u[i]`` holds from ``t[i]`` to ``t[i+1]``.

    Args:
        t: times in s, strictly ascending, shape (n,).
        u: voltages in V, shape (n,) (or n - 1, then `t_end` is ``t[-1]``).
        t_end: end of the last hold; one mean interval after ``t[-1]`` by default.

    Raises:
        InputError: shapes differ, a value is not finite or times do not ascend.
    """
    t, u = np.asarray(t, dtype=float), np.asarray(u, dtype=float)
    if t.ndim != 1 or u.ndim != 1 or len(t) not in (len(u), len(u) + 1) or len(u) == 0:
        raise InputError(f"sampled voltage: t has shape {t.shape} and u {u.shape}; make them equal")
    if not (np.isfinite(t).all() and np.isfinite(u).all()):
        raise InputError("sampled voltage: t or u holds NaN or infinity; remove those rows")
    if len(t) == len(u):
        mean = (t[-1] - t[0]) / (len(t) - 1) if len(t) > 1 else 1.0
        last = t[-1] + mean if t_end is None else t_end
        t = np.append(t, last) if last > t[-1] else t
        u = u[: len(t) - 1]
    if len(u) == 0 or not (np.diff(t) > 0).all():
        raise InputError("sampled voltage: t must ascend strictly; sort it and drop repeats")
    # Equal neighbours are one piece, so that constant stretches cost nothing.
    keep = np.concatenate([[True], np.diff(u) != 0.0])
    return Voltage(np.append(t[:-1][keep], t[-1]), u[keep][:, None])


def function_voltage(function: VoltageFunction, t_start: float, t_end: float) -> Voltage:
    """Piecewise Chebyshev interpolant of any function of time, to about 1e-11.

    Pieces are halved until they fit; around a jump they shrink to 1e-9 s.

    Raises:
        InputError: the function returns something that is not a finite number, or is too
            rough for 200 000 pieces.
    """

    def values(times: FloatArray) -> FloatArray:
        found = np.array([function(float(time)) for time in times], dtype=float)
        if found.shape != times.shape or not np.isfinite(found).all():
            raise InputError(
                f"voltage function gives no finite number between {times[0]} and {times[-1]} s"
            )
        return found

    edges = np.linspace(t_start, t_end, max(2, math.ceil((t_end - t_start) / 0.5) + 1))
    pending = list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))[::-1]
    breaks, pieces, tries = [t_start], [], 0
    while pending:
        a, b = pending.pop()
        width, tries = b - a, tries + 1
        if tries > _MAX_PIECES:
            raise InputError(
                f"voltage function is too rough near {a:.6g} s to be interpolated; sample it "
                "and pass sampled_voltage(t, u)"
            )
        series = _FIT @ values(a + width * _NODES)
        truth = values(a + width * _PROBES)
        miss = np.abs(_AT_PROBES @ series - truth).max()
        if miss > _TOLERANCE * (1.0 + np.abs(truth).max()) and width > _SHORTEST:
            middle = 0.5 * (a + b)
            pending += [(middle, b), (a, middle)]
            continue
        breaks.append(b)
        pieces.append(series)
    return Voltage(np.array(breaks), np.array(pieces))


def as_voltage(voltage: float | VoltageFunction | Voltage, t_start: float, t_end: float) -> Voltage:
    """Any accepted form of voltage as a `Voltage` that covers [t_start, t_end]."""
    if isinstance(voltage, Voltage):
        return _cut(voltage, t_start, t_end)
    if callable(voltage):
        return function_voltage(voltage, t_start, t_end)
    return constant_voltage(float(voltage), t_start, t_end)


def _cut(voltage: Voltage, t_start: float, t_end: float) -> Voltage:
    breaks = voltage.breaks
    if breaks[0] > t_start or breaks[-1] < t_end - 1e-9 * (1.0 + abs(t_end)):
        raise InputError(
            f"voltage covers {breaks[0]:g} to {breaks[-1]:g} s but {t_start:g} to {t_end:g} s "
            "is asked for; shorten the time or lengthen the voltage"
        )
    if breaks[0] == t_start and breaks[-1] == t_end:
        return voltage
    first = int(np.searchsorted(breaks, t_start, side="right")) - 1
    last = max(int(np.searchsorted(breaks, t_end, side="left")), first + 1)
    rows = slice(first, min(last, len(breaks) - 1))
    new, pieces = breaks[first : rows.stop + 1].copy(), voltage.pieces[rows]
    new[0], new[-1] = t_start, t_end
    # What is constant is the same however it is cut.
    return Voltage(new, pieces if pieces.shape[1] == 1 else _pieces_between(voltage, new))


def _pieces_between(voltage: Voltage, breaks: FloatArray) -> FloatArray:
    """Coefficients of a voltage between other breaks, its own among them, shape (n, degree + 1)."""
    middle = breaks[:-1] + 0.5 * np.diff(breaks)
    rows = np.searchsorted(voltage.breaks, middle, side="right") - 1
    rows = np.clip(rows, 0, len(voltage.pieces) - 1)
    start, length = voltage.breaks[rows], np.diff(voltage.breaks)[rows]
    low, share = (breaks[:-1] - start) / length, np.diff(breaks) / length
    out = np.zeros((len(rows), voltage.pieces.shape[1]))
    for coefficients in voltage.pieces[rows].T[::-1]:
        # Horner's rule in the share of the old piece, low + share s.
        out = low[:, None] * out + share[:, None] * np.roll(out, 1, axis=1)
        out[:, 0] += coefficients
    return out


def with_past(
    voltage: Voltage, delay: float, before: float, source: Voltage
) -> tuple[Voltage, int]:
    """A voltage cut also where that of a delay ago changes.

    Args:
        voltage: over the run.
        delay: s, 0 or more.
        before: voltage before the source begins, V.
        source: the same voltage, from as early as it is known.

    Returns:
        The voltage whose pieces hold, after their own coefficients, those of the voltage a delay
        ago; and how many these are.
    """
    start, end = voltage.breaks[0], voltage.breaks[-1]
    late = Voltage(source.breaks + delay, source.pieces)
    inside = late.breaks[(late.breaks > start) & (late.breaks < end)]
    breaks = np.unique(np.concatenate([voltage.breaks, inside]))
    breaks = breaks[np.append(np.diff(breaks) > _SHORTEST, True)]
    breaks[0] = start
    past = _pieces_between(late, breaks)
    unknown = 0.5 * (breaks[:-1] + breaks[1:]) < late.breaks[0]
    past[unknown] = 0.0
    past[unknown, 0] = before
    return Voltage(breaks, np.hstack([_pieces_between(voltage, breaks), past])), past.shape[1]
