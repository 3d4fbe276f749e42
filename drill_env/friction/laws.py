"""The set-valued friction torques (2) with the laws (5) and (7), on arrays."""

from __future__ import annotations

import functools

import numpy as np

from drill_env._types import FloatArray
from drill_env.friction.kernels import fill_clamp, map_lower, map_upper
from drill_env.parameters import Rig


def _lower(rig: Rig, speed: FloatArray, slope: bool) -> FloatArray:
    out = np.empty(speed.size)
    map_lower(rig.record()[0], np.ascontiguousarray(speed).ravel(), slope, out)
    return out.reshape(speed.shape)


def lower_curve(rig: Rig, omega: FloatArray | float) -> FloatArray:
    """T_l(omega) of equation (7) or its alternatives (Nm), a function of abs(omega).

    Args:
        rig: parameters.
        omega: lower-disc velocity in rad/s, any shape.
    """
    torque = _lower(rig, np.abs(np.asarray(omega, dtype=float)), slope=False)
    return np.maximum(torque, 0.0) if rig.clamp else torque


def lower_curve_slope(rig: Rig, omega: FloatArray | float) -> FloatArray:
    """d_l = dT_l/dabs(omega) (Nm s/rad), equation (13)."""
    speed = np.abs(np.asarray(omega, dtype=float))
    slope = _lower(rig, speed, slope=True)
    if rig.clamp:
        slope = np.where(_lower(rig, speed, slope=False) < 0.0, 0.0, slope)
    return slope


def lower_curve_derivatives(rig: Rig, omega: float) -> tuple[float, float, float]:
    """First to third derivative of T_l by the speed at `omega` > 0 (Nm s^k/rad^k)."""
    if rig.friction == "humped":
        first, second, third = rig.bl, 0.0, 0.0
        for height, steepness in ((rig.T1, rig.beta1), (rig.T2, rig.beta2)):
            s = float(np.tanh(0.5 * steepness * omega))
            d1 = 0.5 * steepness * (1.0 - s * s)
            d2 = -steepness * s * d1
            d3 = -steepness * (d1 * d1 + s * d2)
            first, second, third = first + height * d1, second + height * d2, third + height * d3
        return first, second, third
    if rig.friction == "stribeck":
        fall = rig.T1 * rig.beta1 * float(np.exp(-rig.beta1 * omega))
        return rig.bl + fall, -rig.beta1 * fall, rig.beta1**2 * fall
    return rig.bl, 0.0, 0.0


def lower_torque_set(rig: Rig, omega: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """Lower and upper end of the set T_fl(omega) (Nm), equation (2); a point for omega != 0."""
    omega = np.asarray(omega, dtype=float)
    torque = np.sign(omega) * lower_curve(rig, omega)
    rest = omega == 0.0
    return np.where(rest, -rig.Tsl, torque), np.where(rest, rig.Tsl, torque)


def upper_torque_set(rig: Rig, omega: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """Lower and upper end of the set T_fu(omega) (Nm), equations (2) and (5)."""
    omega = np.asarray(omega, dtype=float)
    torque = np.empty(omega.size)
    map_upper(rig.record()[0], np.ascontiguousarray(omega).ravel(), torque)
    torque = torque.reshape(omega.shape)
    rest = omega == 0.0
    return (
        np.where(rest, -rig.Tsu + rig.dTsu, torque),
        np.where(rest, rig.Tsu + rig.dTsu, torque),
    )


def kernel_record(rig: Rig) -> np.ndarray:
    """The parameters as the integrator reads them, shape (1,), the clamped speeds filled in."""
    p = rig.record()
    if rig.clamp:
        fill_clamp(p[0])
    return p


@functools.lru_cache(maxsize=256)
def _negative_range(rig: Rig) -> tuple[float, float] | None:
    p = rig.record()
    fill_clamp(p[0])
    low, high = float(p["clamp_low"][0]), float(p["clamp_high"][0])
    return (low, high) if low < np.inf else None


def negative_range(rig: Rig) -> tuple[float, float] | None:
    """Speeds (rad/s) up to 400 between which T_l is negative, against equation (3), or None.

    With the printed parameters: about 16.0 to 42.1 rad/s.
    """
    return _negative_range(rig.replace(effects=()) if rig.effects else rig)
