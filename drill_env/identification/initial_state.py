"""The state of the rig at a row of a recording, from short smooth fits of the angles."""

from __future__ import annotations

import math

import numpy as np

from drill_env._types import FloatArray
from drill_env.friction import lower_curve
from drill_env.identification.noise import roughness
from drill_env.identification.prescribed_motion import followed_motion
from drill_env.parameters import Rig
from drill_env.recordings import Channel, Recording

_LONGEST = 0.3
_FEWEST = 5
_GROWTH = 1.4
_SIGMAS = 2.5
_REST_WINDOW = 0.06
_SPEED_WINDOW = 0.05


def local_fit(
    t: FloatArray, theta: FloatArray, row: int, step: float | None = None
) -> tuple[float, float]:
    """Angle and velocity at one row by a parabola over the samples around it.

    The window grows up to 0.3 s for as long as the velocities of all windows agree within
    their noise (Lepski's rule), so that neither noise nor curvature takes over. At the
    ends of the recording it is one-sided.

    Args:
        t: times in s, shape (n,).
        theta: angles in rad, shape (n,).
        row: the row.
        step: the encoder's step in rad where known.

    Returns:
        Angle in rad and velocity in rad/s.
    """
    noise = _noise(t, theta, row, step)
    low, high = -math.inf, math.inf
    best = (float(theta[row]), 0.0)
    width = float(_FEWEST)
    while True:
        half = int(width) // 2
        start = max(row - half, 0)
        stop = min(row + half + 1 if row > 0 else int(width), len(t))
        x = t[start:stop] - t[row]
        if len(x) < _FEWEST or (len(x) > _FEWEST and x[-1] - x[0] > _LONGEST):
            return best
        angle, velocity, spread = _parabola(x, theta[start:stop])
        margin = _SIGMAS * noise * spread
        low, high = max(low, velocity - margin), min(high, velocity + margin)
        if low > high:
            return best
        best = (angle, velocity)
        if start == 0 and stop == len(t):
            return best
        width = max(width * _GROWTH, width + 1)


def _noise(t: FloatArray, theta: FloatArray, row: int, step: float | None) -> float:
    rough = roughness(theta[np.abs(t - t[row]) <= 0.5 * _LONGEST])
    floor = 1e-12 * float(np.abs(theta).max())
    return max(rough, (step or 0.0) / math.sqrt(12.0), floor)


def _starts_at_rest(t: FloatArray, theta: FloatArray, step: float | None) -> bool:
    """Whether a motion out of rest explains the first samples within their noise."""
    rows = max(int(np.searchsorted(t, t[0] + _REST_WINDOW)), 2 * _FEWEST)
    x = (t[:rows] - t[0]) / _REST_WINDOW
    columns = np.stack([np.ones_like(x), x**2, x**3], axis=1)
    left = theta[:rows] - columns @ (np.linalg.pinv(columns) @ theta[:rows])
    return float(np.sqrt(np.mean(left**2))) <= 1.3 * _noise(t, theta, 0, step)


def _parabola(x: FloatArray, y: FloatArray) -> tuple[float, float, float]:
    """Value and slope at 0, and the slope's standard deviation for unit noise."""
    span = max(float(np.abs(x).max()), 1e-12)
    inverse = np.linalg.pinv(np.vander(x / span, 3, increasing=True))
    values = inverse @ y
    return float(values[0]), float(values[1] / span), float(np.linalg.norm(inverse[1]) / span)


def state_at(recording: Recording, rig: Rig, row: int) -> FloatArray:
    """State (twist, omega_u, omega_l, theta_l) at a row, in rad and rad/s, shape (4,).

    At the first row angles are the samples themselves, and the disc is taken at rest if
    the samples allow it, since most runs begin so. An angle that was not recorded is
    taken equal to the other one, if no velocity was recorded either; otherwise the string has
    the twist that turning steadily at its speed takes, and an angle that nothing tells is 0. Where
    the upper disc's motion is prescribed, it is that of the whole recording.
    """
    state = _as_read(recording, rig, row)
    return with_led_disc(recording, state, row) if recording.drive == "motion" else state


def with_led_disc(recording: Recording, state: FloatArray, row: int = 0) -> FloatArray:
    """A state, shape (4,), with the upper disc where its prescribed motion has it at a row.

    Raises:
        InputError: u is no acceleration of that motion.
    """
    angle, velocity = followed_motion(recording)
    twist = state[0] if angle is None or recording.theta_l is None else angle[row] - state[3]
    theta_l = state[3] if angle is None else angle[row] - twist
    return np.array([twist, velocity[row], state[2], theta_l])


def _as_read(recording: Recording, rig: Rig, row: int) -> FloatArray:
    if recording.velocities():
        return _state_with_velocities(recording, rig, row)
    fits = _angle_fits(recording, row)
    upper = fits["theta_u"] if "theta_u" in fits else fits["theta_l"]
    if rig.inertias == 1:
        return np.array([upper[0], upper[1], 0.0, 0.0])
    lower = fits.get("theta_l", upper)
    return np.array([upper[0] - lower[0], upper[1], lower[1], lower[0]])


def _angle_fits(recording: Recording, row: int) -> dict[Channel, tuple[float, float]]:
    fits: dict[Channel, tuple[float, float]] = {}
    for name, theta in recording.angles().items():
        step = recording.quanta.get(name)
        known = np.flatnonzero(np.isfinite(theta))
        t, read = recording.t[known], theta[known]
        near = 0 if row == 0 else min(int(np.searchsorted(known, row)), len(known) - 1)
        angle, velocity = local_fit(t, read, near, step)
        if row == 0:
            angle = float(read[0])
            velocity = 0.0 if _starts_at_rest(t, read, step) else velocity
        fits[name] = (angle + velocity * float(recording.t[row] - t[near]), velocity)
    return fits


def _state_with_velocities(recording: Recording, rig: Rig, row: int) -> FloatArray:
    fits = _angle_fits(recording, row)
    speeds = {
        name: _speed_at(recording.t, omega, row) for name, omega in recording.velocities().items()
    }
    either = next(iter([v for _, v in fits.values()] or speeds.values()))
    upper, lower = (
        fits[angle][1] if angle in fits else speeds.get(omega, either)
        for angle, omega in (("theta_u", "omega_u"), ("theta_l", "omega_l"))
    )
    if rig.inertias == 1:
        return np.array([fits["theta_u"][0] if "theta_u" in fits else 0.0, upper, 0.0, 0.0])
    if len(fits) == 2:
        theta_u, theta_l = fits["theta_u"][0], fits["theta_l"][0]
        return np.array([theta_u - theta_l, upper, lower, theta_l])
    twist = float(lower_curve(rig, lower)) * float(np.sign(lower)) / rig.ktheta
    theta_u = fits["theta_u"][0] if "theta_u" in fits else None
    theta_l = fits["theta_l"][0] if "theta_l" in fits else 0.0
    return np.array([twist, upper, lower, theta_l if theta_u is None else theta_u - twist])


def _speed_at(t: FloatArray, omega: FloatArray, row: int) -> float:
    """Velocity at a row by a straight line over the samples around it, 0 where rest explains it."""
    known = np.flatnonzero(np.isfinite(omega))
    if row == 0:
        first = known[: max(int(np.searchsorted(t, t[0] + _REST_WINDOW)), 2 * _FEWEST)]
        x = (t[first] - t[0]) / _REST_WINDOW
        columns = np.stack([x, x**2], axis=1)
        left = omega[first] - columns @ (np.linalg.pinv(columns) @ omega[first])
        floor = max(roughness(omega), 1e-9 * float(np.abs(omega[known]).max()))
        if float(np.sqrt(np.mean(left**2))) <= 1.3 * floor:
            return 0.0
    place = int(np.searchsorted(known, row))
    step = max((t[-1] - t[0]) / (len(t) - 1), 1e-12)
    half = max(round(_SPEED_WINDOW / step), _FEWEST)
    near = known[max(place - half, 0) : place + half] if row > 0 else known[: 2 * half]
    if len(near) < 2:
        return 0.0
    return float(np.polyfit(t[near] - t[row], omega[near], 1)[1])
