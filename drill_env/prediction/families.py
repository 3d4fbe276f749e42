"""Families of effects: what a law says apart from its formula."""

from __future__ import annotations

FAMILIES: dict[str, tuple[str, ...]] = {
    "loss of small voltages": ("amplifier_deadzone",),
    "limit of the drive": (
        "amplifier_saturation", "soft_saturation", "current_limit", "supply_sag",
    ),
    "late drive": ("input_delay", "actuator_lag", "drive_resonance", "slew_limit"),
    "drive that differs with its direction": (
        "gain_asymmetry", "drive_braking_loss", "coasting",
    ),
    "drive that weakens with speed": ("drive_speed_loss",),
    "drive that fades": ("motor_fade", "motor_heating"),
    "drive that varies with the angle": (
        "commutation_ripple", "torque_ripple", "gear_eccentricity",
    ),
    "dry friction": ("upper_coulomb",),
    "friction that falls with speed": (
        "upper_stribeck", "upper_gaussian_stribeck", "lower_stribeck", "lower_gaussian_stribeck",
    ),
    "drag that grows with speed": (
        "upper_viscous", "upper_quadratic_drag", "quadratic_drag", "whirl_drag",
        "upper_drag_above_speed", "drag_above_speed",
    ),
    "drag that differs with the direction": ("upper_asymmetry", "lower_asymmetry"),
    "friction with a memory": (
        "upper_friction_lag", "upper_presliding", "friction_lag", "presliding", "lower_lugre",
        "rate_state", "dwell_stiction",
    ),
    "friction that grows with the load": ("upper_load_friction", "load_dependent_friction"),
    "friction that changes with time": (
        "friction_warmup", "friction_drift", "friction_heating", "friction_settling",
        "friction_step", "wear",
    ),
    "torque that varies with the angle": (
        "upper_unbalance", "upper_spring", "unbalance", "brake_runout",
    ),
    "torque from outside": (
        "upper_offset", "upper_disturbance", "lower_disturbance", "torque_pulse",
    ),
    "body on a spring": (
        "upper_resonator", "lower_resonator", "gear_compliance", "string_inertia",
    ),
    "body that is dragged along": ("upper_viscous_damper", "lower_viscous_damper"),
    "play": ("gear_backlash", "string_play"),
    "string that is not linear": (
        "string_hardening", "string_second_spring", "string_asymmetry",
    ),
    "losses in the string": ("string_damping", "string_hysteresis", "string_creep"),
    "late readings": ("encoder_delay_upper", "encoder_delay_lower"),
    "readings that err with the angle": (
        "encoder_eccentricity_upper", "encoder_eccentricity_lower", "encoder_gain_lower",
    ),
    "play of an encoder": ("encoder_play_upper", "encoder_play_lower"),
    "lost counts": ("missed_counts_upper", "missed_counts_lower"),
}  # fmt: skip
"""Effects of the library by what they say apart from their formula."""

_FAMILY = {effect: family for family, effects in FAMILIES.items() for effect in effects}


def family_of(effect: str) -> str:
    """The family of an effect of the library; empty for others and for free shapes."""
    return _FAMILY.get(effect, "")
