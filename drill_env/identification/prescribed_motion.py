"""The motion along which a recorded acceleration leads an upper disc."""

from __future__ import annotations

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.noise import roughness
from drill_env.recordings import Recording

# Share of the disc's departure from a steady turn that its own acceleration leaves at most, and
# times the noise: that of the motion found with u = 0 is all of it.
_LEFT, _NOISE = 0.3, 5.0


def followed_motion(recording: Recording) -> tuple[FloatArray | None, FloatArray]:
    """Angle (rad) and velocity (rad/s) of an upper disc whose acceleration is `Recording.u`.

    Each stretch between gaps begins so that it comes nearest to what was measured.

    Args:
        recording: whose drive is the motion.

    Returns:
        Both of shape (n,); no angle where only the velocity was measured.

    Raises:
        InputError: u is no acceleration of this motion.
    """
    ends = [0, *(recording.gaps + 1).tolist(), len(recording)]
    angle, velocity = np.zeros(len(recording)), np.zeros(len(recording))
    for a, b in zip(ends, ends[1:], strict=False):
        angle[a:b], velocity[a:b] = _stretch(recording, slice(a, b))
    if recording.theta_u is None:
        return None, velocity
    _check_led(recording, angle)
    return angle, velocity


def _stretch(recording: Recording, rows: slice) -> tuple[FloatArray, FloatArray]:
    t, u = recording.t[rows] - recording.t[rows.start], recording.channel("u")[rows]
    step = np.diff(t)
    speed = np.append(0.0, np.cumsum(u[:-1] * step))
    way = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * step))
    if recording.theta_u is None:
        omega = recording.channel("omega_u")[rows]
        known = np.isfinite(omega)
        return way, speed + (float(np.mean((omega - speed)[known])) if known.any() else 0.0)
    theta = recording.theta_u[rows]
    known = np.isfinite(theta)
    if not known.any():
        return way, speed
    columns = np.column_stack([np.ones_like(t), t])
    begin, faster = np.linalg.lstsq(columns[known], (theta - way)[known], rcond=None)[0].tolist()
    return begin + faster * t + way, speed + faster


def _check_led(recording: Recording, angle: FloatArray) -> None:
    theta = recording.channel("theta_u")
    known = np.isfinite(theta)
    steady = np.polyval(np.polyfit(recording.t[known], theta[known], 1), recording.t[known])
    least = _NOISE * max(recording.quanta.get("theta_u", 0.0), roughness(theta))
    apart = float(np.sqrt(np.mean((theta - angle)[known] ** 2)))
    moved = float(np.sqrt(np.mean((theta[known] - steady) ** 2)))
    if apart > max(_LEFT * moved, least):
        raise InputError(
            f"{recording.source}: drive is motion, and u is not the acceleration of theta_u, from "
            f"which it leads {apart:.3g} rad away: leave u out, it is found from theta_u"
        )
