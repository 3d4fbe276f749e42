"""The acceleration of an upper disc whose motion was measured and whose drive is unknown."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solveh_banded

from drill_env._errors import InputError
from drill_env._types import FloatArray

UNKNOWN = "unknown"
"""What a column map says of `u` where the upper disc's motion was measured, and not its drive."""

# Reduced frequencies, radians a row, from which a spline smooths: up to half of the highest that
# there is, so that half of white noise is left as such, and down to two cycles in all. The
# equations' condition is 16 over its fourth power: 2e11 at the lowest, of a double's 4e15.
_HIGHEST, _LOWEST, _FALL, _CYCLES = 0.5 * np.pi, 3e-3, 2.0**-0.5, 2.0
_FEWEST = 10


def held_acceleration(
    t: FloatArray, angle: FloatArray | None, velocity: FloatArray | None, source: str
) -> FloatArray:
    """Acceleration of a disc held from each row to the next, rad/s^2, shape (n,).

    Held so it leads along the smoothing spline of the angle, or where only the velocity was
    measured, of that. How much is smoothed, generalised cross-validation tells.

    Args:
        t: times in s, shape (n,).
        angle: as measured, rad, NaN where missing, shape (n,), or None.
        velocity: likewise, rad/s; not looked at beside an angle.
        source: of the recording, for messages.

    Raises:
        InputError: neither was measured, or too seldom.
    """
    read = velocity if angle is None else angle
    known = np.zeros(0, dtype=np.int64) if read is None else np.flatnonzero(np.isfinite(read))
    if read is None or len(known) < _FEWEST:
        raise InputError(
            f"{source}: u is unknown, so that the upper disc's measured motion is the input, and "
            f"there are {len(known)} readings of it; map theta_u or omega_u"
        )
    spline, bend = smoothing_spline(t[known], read[known])
    steps = np.diff(t)
    if angle is None:
        return _last_again(np.diff(np.interp(t, t[known], spline)) / steps)
    # The second derivative of a cubic spline is straight between its knots.
    curve = np.interp(t, t[known], bend)
    held = _last_again(0.5 * (curve[1:] + curve[:-1]))
    # Held, and not straight, it is ahead by a twelfth of the interval squared times itself.
    held[1:-1] -= np.diff(held, 2) / 12.0
    return held


def smoothing_spline(t: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The natural cubic smoothing spline that generalised cross-validation chooses.

    By Reinsch's equations (Green and Silverman 1994, section 2.3); the criterion is that of Craven
    and Wahba (1979), with the degrees of freedom of evenly spaced knots. SciPy's
    `make_smoothing_spline` is the same spline and takes 7 s for the choice with 3000 rows.

    Args:
        t: knots in s, ascending, shape (n,).
        values: to smooth, shape (n,).

    Returns:
        The spline and its second derivative at the knots, both of shape (n,).
    """
    count, h = len(t), float(np.median(np.diff(t)))
    turns = np.pi * (np.arange(count) + 0.5) / count
    rough = _roughness(turns, h)
    best, least = (values, np.zeros(count)), np.inf
    cutoff = _HIGHEST
    while cutoff > max(_LOWEST, 2.0 * np.pi * _CYCLES / count):
        penalty = 1.0 / float(_roughness(np.array([cutoff]), h)[0])
        spline, bend = _reinsch(t, values, penalty)
        freedom = float(np.sum(1.0 / (1.0 + penalty * rough)))
        score = float(np.mean((values - spline) ** 2)) / (1.0 - freedom / count) ** 2
        if score < least:
            best, least = (spline, bend), score
        cutoff *= _FALL
    return best


def _roughness(turns: FloatArray, h: float) -> FloatArray:
    """The integral of the squared second derivative of a spline that is a wave on even knots."""
    return 3.0 * (2.0 - 2.0 * np.cos(turns)) ** 2 / (h**3 * (2.0 + np.cos(turns)))


def _reinsch(t: FloatArray, values: FloatArray, penalty: float) -> tuple[FloatArray, FloatArray]:
    h = np.diff(t)
    # Second differences, Q in the book: three numbers a row.
    left, right = 1.0 / h[:-1], 1.0 / h[1:]
    middle = -left - right
    bands = np.zeros((3, len(h) - 1))
    bands[2] = (h[:-1] + h[1:]) / 3.0 + penalty * (left**2 + middle**2 + right**2)
    bands[1, 1:] = h[1:-1] / 6.0 + penalty * (middle[:-1] * left[1:] + right[:-1] * middle[1:])
    bands[0, 2:] = penalty * right[:-2] * left[2:]
    bend = np.zeros(len(t))
    bend[1:-1] = solveh_banded(bands, np.diff(np.diff(values) / h))
    inner = bend[1:-1]
    moved = np.zeros(len(t))
    moved[:-2] += left * inner
    moved[1:-1] += middle * inner
    moved[2:] += right * inner
    return values - penalty * moved, bend


def _last_again(held: FloatArray) -> FloatArray:
    return np.append(held, held[-1])
