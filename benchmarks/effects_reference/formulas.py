"""Effects that are a formula of the present state."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, exp, pi
from typing import Any

from .view import Effect, Sums, View, clip


def amplifier_saturation(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts += clip(v.u, q["level"]) - v.u


def soft_saturation(q: dict[str, Any], s: Sums, v: View) -> None:
    sharp = 1.0 / q["softness"]
    s.volts += v.u * (1.0 + (abs(v.u) / q["level"]) ** sharp) ** (-1.0 / sharp) - v.u


def amplifier_deadzone(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts -= clip(v.u, q["width"])


def supply_sag(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts -= q["sag"] * abs(v.u) * v.u


def coasting(q: dict[str, Any], s: Sums, v: View) -> None:
    if v.u == 0.0:
        s.volts += q["back_emf"] * v.wu


def gain_asymmetry(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts += q["asymmetry"] * abs(v.u)


def drive_braking_loss(q: dict[str, Any], s: Sums, v: View) -> None:
    if v.u * v.su < 0.0:
        s.volts -= q["loss"] * v.u


def motor_fade(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts -= q["loss"] * (1.0 - exp(-v.t / q["time_constant"])) * v.u


def torque_ripple(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u += q["torque"] * cos(q["order"] * v.angle_u + q["phase"])


def gear_eccentricity(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts += v.u * q["eccentricity"] * cos(v.angle_u + q["phase"])


def commutation_ripple(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts += v.u * q["depth"] * cos(q["order"] * v.angle_u + q["phase"])


def upper_coulomb(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_u += q["torque"]


def upper_stribeck(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_u += q["torque"] * exp(-v.speed_u / q["velocity"])


def lower_stribeck(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_l += q["torque"] * exp(-v.speed_l / q["velocity"])


def upper_gaussian_stribeck(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_u += q["torque"] * exp(-((v.wu / q["velocity"]) ** 2))


def lower_gaussian_stribeck(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_l += q["torque"] * exp(-((v.wl / q["velocity"]) ** 2))


def upper_load_friction(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_u += q["coefficient"] * abs(v.rig.km * v.u)


def upper_spring(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["stiffness"] * (v.angle_u - q["centre"])


def upper_viscous(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["damping"] * v.wu


def upper_quadratic_drag(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["coefficient"] * v.speed_u * v.wu


def quadratic_drag(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_l -= q["coefficient"] * v.speed_l * v.wl


def drive_speed_loss(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts -= v.u * min(q["loss"] * v.speed_u, 1.0)


def upper_drag_above_speed(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["coefficient"] * v.su * max(v.speed_u - q["speed"], 0.0) ** 2


def drag_above_speed(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_l -= q["coefficient"] * v.sl * max(v.speed_l - q["speed"], 0.0) ** 2


def upper_asymmetry(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["damping"] * v.speed_u


def upper_offset(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["torque"]


def friction_warmup(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_u += q["excess"] * exp(-v.t / q["time_constant"])


def lower_disturbance(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_l += q["torque"] * cos(2 * pi * q["frequency"] * v.t + q["phase"])


def upper_disturbance(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u += q["torque"] * cos(2 * pi * q["frequency"] * v.t + q["phase"])


def string_damping(q: dict[str, Any], s: Sums, v: View) -> None:
    s.string += q["damping"] * (v.wu - v.wl)


def string_hardening(q: dict[str, Any], s: Sums, v: View) -> None:
    s.string += q["coefficient"] * v.x**3


def string_second_spring(q: dict[str, Any], s: Sums, v: View) -> None:
    s.string += q["stiffness"] * (v.x - clip(v.x, q["twist"]))


def unbalance(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_l += q["torque"] * cos(v.angle_l + q["phase"])


def upper_unbalance(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u += q["torque"] * cos(v.angle_u + q["phase"])


def brake_runout(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_l += q["runout"] * cos(q["order"] * v.angle_l + q["phase"])


def lower_asymmetry(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_l += q["asymmetry"] * v.sl


def friction_drift(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_l += q["drift"] * v.t / 60.0


def friction_settling(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_l -= q["change"] * (1.0 - exp(-v.t / q["time_constant"]))


def whirl_drag(q: dict[str, Any], s: Sums, v: View) -> None:
    r = v.wl / q["speed"]
    s.torque_l -= q["torque"] * r**5 / ((1 - r * r) ** 2 + (2 * q["damping"] * r) ** 2)


def dwell_stiction(q: dict[str, Any], s: Sums, v: View) -> None:
    if v.dwell is not None:
        s.size_l += q["torque"] * (1.0 - exp(-v.dwell / q["time_constant"]))


FORMULAS: dict[str, Callable[[dict[str, Any], Sums, View], None]] = {
    f.__name__: f
    for f in (
        amplifier_saturation, amplifier_deadzone, supply_sag, gain_asymmetry, torque_ripple,
        coasting, gear_eccentricity, upper_coulomb, upper_stribeck, lower_stribeck, upper_viscous,
        upper_quadratic_drag, quadratic_drag, upper_asymmetry, upper_offset, friction_warmup,
        lower_disturbance, upper_disturbance, string_damping, string_hardening, unbalance,
        upper_unbalance, brake_runout, lower_asymmetry, friction_drift, whirl_drag,
        dwell_stiction, drive_braking_loss, motor_fade, upper_load_friction, upper_spring,
        friction_settling, commutation_ripple, soft_saturation, upper_gaussian_stribeck,
        lower_gaussian_stribeck, drive_speed_loss, upper_drag_above_speed, drag_above_speed,
        string_second_spring,
    )
}  # fmt: skip


class Formula(Effect):
    """One of the functions above."""

    def add(self, s: Sums, v: View) -> None:
        FORMULAS[self.q["id"]](self.q, s, v)
