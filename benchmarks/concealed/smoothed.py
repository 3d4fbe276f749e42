"""Motion of a recording by smoothing its angles: what peers of the diagnosis regress on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_coeffs, savgol_filter

from drill_env._errors import InputError
from drill_env.recordings import Recording

Array = NDArray[np.float64]
Columns = dict[str, Array]
# Near rest the sign of a speed is not known from smoothed angles.
ORDER, _LEAST_SPEED = 4, 0.3


def _felt(u: Array, length: int) -> Array:
    """Held voltages weighted as the second derivative of the smoothed angle weighs accelerations.

    That is no smoothing by the same polynomial: where a voltage jumps the two are far apart.
    """
    # A second derivative's weights are the second differences of an acceleration's, a sample late.
    weights = np.cumsum(np.cumsum(savgol_coeffs(length, ORDER, deriv=2, use="dot")))
    middles = 0.5 * (u + np.append(u[0], u[:-1]))
    return np.correlate(np.pad(middles, length // 2, mode="edge"), np.roll(weights, 1), "valid")


def motion(recording: Recording, window: float) -> Columns:
    """Smoothed motion of a recording where both discs slip all over the window.

    Raises:
        InputError: the voltage or an angle was not recorded.
    """
    if recording.u is None or recording.theta_u is None or recording.theta_l is None:
        raise InputError("a recording without u, theta_u or theta_l: give those that `make` wrote")
    step = float(np.median(np.diff(recording.t)))
    t = np.arange(recording.t[0], recording.t[-1] + 0.5 * step, step)
    length = 2 * round(0.5 * window / step) + 1
    held = np.searchsorted(recording.t, t + 0.5 * step) - 1
    # Voltages act within the window as the accelerations do.
    x: Columns = {"t": t, "u": savgol_filter(recording.u[held], length, ORDER)}
    x["u_felt"] = _felt(recording.u[held], length)
    slips = np.ones(len(t), dtype=bool)
    for disc, angle in (("u", recording.theta_u), ("l", recording.theta_l)):
        even = np.interp(t, recording.t, angle)
        for order, name in enumerate(("theta", "omega", "alpha")):
            x[f"{name}_{disc}"] = savgol_filter(even, length, ORDER, deriv=order, delta=step)
        slips &= np.abs(x[f"omega_{disc}"]) > _LEAST_SPEED
    used = np.convolve(~slips, np.ones(length), mode="same") < 0.5
    used[: length // 2] = used[len(used) - length // 2 :] = False
    # Smoothed samples repeat each other.
    used[np.arange(len(used)) % max(length // 8, 1) > 0] = False
    return {name: values[used] for name, values in x.items()}
