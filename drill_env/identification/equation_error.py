"""The two equations of motion torn apart and fitted by least squares, in milliseconds.

With measured angles each disc's equation is linear in its unknowns, whatever the other
disc does. The coefficients are rough, but their signs and sizes tell which column is what.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import BoolArray, FloatArray
from drill_env.recordings import Recording

CUTOFF = 3.0
"""Usual one, Hz: the discs of the paper swing against each other at 0.25 Hz."""

_KEPT_RATE = 20.0
_EDGE = 0.3
_SHORTEST = 2.0
_BRIDGED = 0.1
_SLOW_UPPER, _SLOW_LOWER = 0.3, 0.5
_FEWEST = 40
_VARIED = 0.1
_ROUNDING = 0.6
# Neighbouring residuals are alike, since the cut-off lies far below the kept rate.
_SPREAD = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """Low-passed channels with derivatives, on a coarse grid without the gaps.

    Attributes:
        u: voltage in V, shape (n,).
        theta: angles of the two discs in rad, shape (2, n).
        omega: velocities in rad/s, shape (2, n).
        alpha: accelerations in rad/s^2, shape (2, n).
        noise: what the encoder's steps alone can make of the accelerations, rad/s^2, shape (2,).
    """

    u: FloatArray
    theta: FloatArray
    omega: FloatArray
    alpha: FloatArray
    noise: FloatArray


@dataclass(frozen=True, slots=True)
class Term:
    """One coefficient: its value and the standard deviation of that."""

    value: float
    spread: float

    def is_sure(self, sigmas: float = 6.0) -> bool:
        """Whether its sign is beyond doubt."""
        return abs(self.value) > sigmas * self.spread

    @property
    def sign(self) -> int:
        """1 or -1 where the sign is beyond doubt, else 0."""
        return int(np.sign(self.value)) if self.is_sure() else 0


@dataclass(frozen=True, slots=True)
class UpperFit:
    """omega_u' = drive u - damping omega_u + pull theta_l - hold theta_u - ..., SI units.

    Attributes:
        drive: coefficient of the voltage, km/Ju.
        damping: bu/Ju.
        hold: coefficient of its own angle, ktheta/Ju.
        share: share of the acceleration that the equation explains, 1 at best.
        driven: share of the voltage in what moves the disc besides its own friction.
    """

    drive: Term
    damping: Term
    hold: Term
    share: float
    driven: float


@dataclass(frozen=True, slots=True)
class LowerFit:
    """omega_l' = pull theta_u - hold theta_l - friction, in 1/s^2.

    Attributes:
        pull: ktheta/Jl, times the scale of theta_l over that of theta_u.
        hold: ktheta/Jl.
        share: share of the acceleration that the equation explains, 1 at best.
    """

    pull: Term
    hold: Term
    share: float


def with_integrals(recording: Recording) -> Recording:
    """The recording with the integral of the velocity as the angle of each disc that has none.

    The integral drifts with the velocity's noise, which is far slower than what is fitted.
    """
    t, added = recording.t, {}
    for angle, velocity in (("theta_u", "omega_u"), ("theta_l", "omega_l")):
        omega = getattr(recording, velocity)
        if omega is None or getattr(recording, angle) is not None:
            continue
        known = np.isfinite(omega)
        held = np.interp(t, t[known], omega[known])
        theta = np.append(0.0, np.cumsum(0.5 * (held[1:] + held[:-1]) * np.diff(t)))
        added[angle] = np.where(known, theta, np.nan)
    return replace(recording, **added) if added else recording


def smoothed(recording: Recording, cutoff: float = CUTOFF) -> Smoothed | None:
    """Channels and derivatives for the fits; None where too little of the recording is left.

    Args:
        recording: with u and at least one angle; an angle that is missing counts as 0.
        cutoff: of the zero-phase low-pass, Hz.
    """
    zero = np.zeros_like(recording.t)
    t, u = recording.t, recording.channel("u")
    angles = [zero if a is None else a for a in (recording.theta_u, recording.theta_l)]
    rows = np.isfinite(t + u + angles[0] + angles[1])
    t, u, angles = t[rows], u[rows], [a[rows] for a in angles]
    if len(t) < _FEWEST:
        return None
    step = float(np.median(np.diff(t)))
    cuts = np.flatnonzero(np.diff(t) > max(1.8 * step, _BRIDGED)) + 1
    pieces = [
        _piece(t[p], u[p], [a[p] for a in angles], step, cutoff)
        for p in np.split(np.arange(len(t)), cuts)
        if t[p[-1]] - t[p[0]] > _SHORTEST and len(p) > _FEWEST
    ]
    if not pieces:
        return None
    joined = np.concatenate(pieces, axis=1)
    quanta = [recording.quanta.get(name, 0.0) for name in ("theta_u", "theta_l")]
    # As if all of the rounding swung somewhat below the cut-off.
    noise = np.array(quanta) / math.sqrt(12.0) * (_ROUNDING * 2.0 * math.pi * cutoff) ** 2
    return Smoothed(joined[0], joined[1:3], joined[3:5], joined[5:7], noise)


def grid_step(recording: Recording) -> float:
    """Time between neighbouring samples of `smoothed`, s."""
    rate = 1.0 / float(np.median(np.diff(recording.t)))
    return max(1, round(rate / _KEPT_RATE)) / rate


def _piece(
    t: FloatArray, u: FloatArray, angles: list[FloatArray], step: float, cutoff: float
) -> FloatArray:
    """Rows u, two angles, two velocities, two accelerations of one stretch without a gap."""
    from scipy import signal

    grid = np.arange(t[0], t[-1] + 1e-9 * step, step)
    held = u[np.clip(np.searchsorted(t, grid + 1e-6 * step, side="right") - 1, 0, None)]
    # The voltage is held after its row; around the row it is the mean of before and after.
    centred = np.append(held[0], 0.5 * (held[1:] + held[:-1]))
    rows = np.stack([centred, *(np.interp(grid, t, a) for a in angles)])
    rate = 1.0 / step
    sections = signal.butter(3, min(cutoff, rate / 8.0), fs=rate, output="sos")
    rows = signal.sosfiltfilt(sections, rows, padlen=min(rows.shape[1] - 1, round(rate)))
    omega = np.gradient(rows[1:], step, axis=1)
    alpha = np.gradient(omega, step, axis=1)
    edge, stride = round(_EDGE * rate), max(1, round(rate / _KEPT_RATE))
    return np.concatenate([rows, omega, alpha])[:, edge : rows.shape[1] - edge : stride]


def fit_upper(s: Smoothed, upper: int = 0, lag: int = 0, margin: int = 0) -> UpperFit | None:
    """Fit the upper disc's equation; None where the disc hardly turns.

    Args:
        s: the channels.
        upper: row of `s.theta` taken for the upper disc.
        lag: samples of `s` by which the voltage is taken earlier.
        margin: samples of `s` left out at both ends, so that fits at several lags compare.
    """
    u = np.roll(s.u, lag)
    omega, other = s.omega[upper], s.theta[1 - upper]
    moving = _is_moving(omega, _SLOW_UPPER)
    moving[:margin] = False
    moving[len(moving) - margin :] = False
    if moving.sum() < _FEWEST:
        return None
    own = s.theta[upper]
    columns = [u, -omega, -own, other]
    sign, ones = np.sign(omega), np.ones_like(u)
    # Whatever equals the voltage up to a factor would share its coefficient.
    if is_varied(s.u):
        columns += [sign, ones]
    elif np.ptp(sign[moving]) > 0:
        columns += [sign]
    terms, share = _least_squares(columns, s.alpha[upper], moving, s.noise[upper])
    string = terms[3].value * other - terms[2].value * own
    parts = [float(np.std(x[moving])) for x in (terms[0].value * u, string)]
    return UpperFit(terms[0], terms[1], terms[2], share, parts[0] / max(sum(parts), 1e-300))


def _is_moving(omega: FloatArray, limit: float) -> BoolArray:
    """Rows away from sticking, where friction is a smooth function of the speed."""
    speed = np.abs(omega)
    return speed > min(limit, 0.3 * float(np.quantile(speed, 0.95)))


def is_varied(u: FloatArray) -> bool:
    """Whether a voltage changes enough to tell its effect from a constant's."""
    return float(np.std(u)) > _VARIED * math.sqrt(float(np.mean(u**2)) + 1e-300)


def fit_lower(s: Smoothed, lower: int = 1) -> LowerFit | None:
    """Fit the lower disc's equation; None where the disc hardly turns.

    Args:
        s: the channels.
        lower: row of `s.theta` taken for the lower disc.
    """
    omega = s.omega[lower]
    moving = _is_moving(omega, _SLOW_LOWER)
    if moving.sum() < _FEWEST:
        return None
    sign, speed = np.sign(omega), np.abs(omega)
    friction = [sign, sign * np.tanh(3.0 * speed), omega, omega * speed, np.ones_like(omega)]
    columns = [s.theta[1 - lower], -s.theta[lower], *friction]
    terms, share = _least_squares(columns, s.alpha[lower], moving, s.noise[lower])
    return LowerFit(terms[0], terms[1], share)


def _least_squares(
    columns: list[FloatArray], y: FloatArray, rows: BoolArray, noise: float
) -> tuple[list[Term], float]:
    x, y = np.stack(columns, axis=1)[rows], y[rows]
    size = np.sqrt(np.mean(x**2, axis=0)) + 1e-300
    x = x / size
    values = np.linalg.lstsq(x, y, rcond=1e-9)[0]
    left = float(np.sum((y - x @ values) ** 2))
    freedom = max(len(y) - len(columns), 1)
    covariance = np.linalg.pinv(x.T @ x, rcond=1e-14) * (left / freedom + noise**2)
    spreads = _SPREAD * np.sqrt(np.maximum(np.diag(covariance), 0.0)) / size
    terms = [Term(float(v), float(d)) for v, d in zip(values / size, spreads, strict=True)]
    return terms, 1.0 - left / max(float(np.sum(y**2)), 1e-300)
