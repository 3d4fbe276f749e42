"""A concealed truth in the tool's own terms, wherever the two formulas are the same function.

Read off `torques.py`, `held.py`, `plant.py` and `sensors.py` on the maker's side and off
`drill_env.effects` and `drill_env.diagnosis.faults` on the tool's; `LEFT_OUT` says which numbers
have no counterpart there, and why. All in SI units at the true scale of torque: what the tool
tells in Nm carries its doubt about that scale.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from benchmarks.concealed.recordings import JITTER

Numbers = Mapping[str, float]

# "maker's name=tool's name", or one name for both.
_SAME = {
    "amplifier_saturation": "limit=level",
    "amplifier_deadzone": "half_width=width",
    "slew_limit": "rate",
    "actuator_lag": "tau=time_constant",
    "input_delay": "delay",
    # The maker's supply gives way within 0.05 s: one law for voltages that are held longer.
    "supply_sag": "sag",
    "motor_heating": "tau=time_constant",
    "gain_asymmetry": "asymmetry",
    "torque_ripple": "amplitude=torque order phase",
    # The teeth are damped otherwise and all of the friction is the disc's: see LEFT_OUT.
    "gear_backlash": "gap motor_share",
    "gear_compliance": "motor_share",
    "load_dependent_friction": "coefficient",
    "upper_stribeck": "torque speed=velocity",
    "upper_quadratic_drag": "coefficient",
    "friction_warmup": "excess tau=time_constant",
    "gear_eccentricity": "eccentricity phase",
    "upper_disturbance": "amplitude=torque frequency phase",
    "string_damping": "damping",
    "string_hysteresis": "amplitude=torque width",
    "string_creep": "creep=compliance tau=time_constant",
    "lower_stribeck": "torque speed=velocity",
    "lower_asymmetry": "asymmetry",
    "presliding": "distance",
    "friction_lag": "tau=time_constant",
    "dwell_stiction": "torque tau=time_constant",
    "brake_runout": "runout phase",
    "unbalance": "torque phase",
    "friction_drift": "drift",
    # To first order: the brake that warms is the faded one for the maker, the cold one for the
    # tool.
    "friction_heating": "fade=loss tau=time_constant",
    "friction_step": "step time",
    "wear": "loss distance",
    "quadratic_drag": "coefficient",
    "whirl_drag": "torque speed damping",
    "lower_disturbance": "amplitude=torque frequency phase",
    "torque_pulse": "torque time width=duration",
    "encoder_eccentricity_upper": "amplitude=error phase",
    "encoder_eccentricity_lower": "amplitude=error phase",
    "encoder_delay_upper": "delay",
    "encoder_delay_lower": "delay",
    # Losses at single moments, as the diagnosis tells them, not those of its library.
    "missed_counts_upper": "size",
    "missed_counts_lower": "size",
    "encoder_gain_lower": "gain=error",
}

_SINES = frozenset({
    "torque_ripple", "upper_disturbance", "lower_disturbance", "unbalance",
    "encoder_eccentricity_upper", "encoder_eccentricity_lower",
})  # fmt: skip
"""Sines for the maker, cosines for the tool; a constant that an encoder adds is its zero."""


def _repeated(p: Numbers, rig: Numbers, counts: int) -> dict[str, float]:
    # Runs begin at random and overlap: a row is fresh where none began in a run's length.
    run = int(p["run"])
    return {"share": 1.0 - (1.0 - p["share"] / run) ** run}


def _ringing(stiffness: float, motor: float, disc: float) -> float:
    return math.sqrt(stiffness * (1.0 / motor + 1.0 / disc)) / (2.0 * math.pi)


_MADE: dict[str, Callable[[Numbers, Numbers, int], dict[str, float]]] = {
    # Per u^2/25 V^2 there, per u^2/9 V^2 here.
    "motor_heating": lambda p, rig, counts: {"loss": p["loss"] * 9.0 / 25.0},
    "gear_compliance": lambda p, rig, counts: {
        "frequency": _ringing(
            1.0 / p["compliance"],
            p["motor_share"] * rig["Ju"],
            (1.0 - p["motor_share"]) * rig["Ju"],
        ),
        "damping": 0.05,
    },
    "gear_backlash": lambda p, rig, counts: {"damping": 0.3},
    "string_hardening": lambda p, rig, counts: {"coefficient": rig["ktheta"] * p["hardening"]},
    "string_asymmetry": lambda p, rig, counts: {"coefficient": rig["ktheta"] * p["asymmetry"]},
    "string_play": lambda p, rig, counts: {"gap": 2.0 * p["half_width"]},
    # J in the middle of two halves of stiffness 2 ktheta.
    "string_inertia": lambda p, rig, counts: {
        "frequency": math.sqrt(4.0 * rig["ktheta"] / p["inertia"]) / (2.0 * math.pi),
        "damping": 0.002,
    },
    "brake_runout": lambda p, rig, counts: {"order": 1.0},
    # Every clock of the maker jitters by this much.
    "clock_jitter": lambda p, rig, counts: {"jitter": math.hypot(JITTER, p["sigma"])},
    "missing_samples": _repeated,
    "lost_encoder_bits": lambda p, rig, counts: {
        "bits": float(round(math.log2(max(p["step"] * counts / (2.0 * math.pi), 1.0))))
    },
}

LEFT_OUT = {
    "rate_state.torque": "its steady part bends the law of speed as no humped law can; the tool "
    "has none, and its contact stops growing older at rest",
    "rate_state.distance": "as its torque",
    "rate_state.speed": "as its torque",
    "supply_sag.tau": "the tool's supply gives way at once",
    "missed_counts_upper.rate": "a chance for each rad travelled; the tool counts losses a second",
    "missed_counts_lower.rate": "as of the upper encoder",
}
"""Numbers of the maker that the tool does not have, by "effect.parameter".

Numbers of the tool that the maker does not have: of both gears `friction_share`, 0 for the maker
and so below the tool's range, and the frequency of the backlash's teeth, which never pull there.
Another friction law ("friction_shape") is left out too: its intervals hold Ju as given, and with
it a scale of torque that is not the true one.
"""


def in_tool_terms(
    effect: str, parameters: Numbers, rig: Numbers, counts: int = 8192
) -> dict[str, float]:
    """The true values of the tool's parameters, as far as there are any.

    Args:
        effect: its id.
        parameters: as the answer tells them, SI units.
        rig: the fourteen true parameters.
        counts: of the encoders, a turn.

    Returns:
        By the names of `drill_env.effects`, or of the diagnosis for faults of the recording.
    """
    found: dict[str, float] = {}
    for item in _SAME.get(effect, "").split():
        name, _, other = item.partition("=")
        found[other or name] = parameters[name]
    if effect in _SINES:
        found["phase"] -= 0.5 * math.pi
    if effect in _MADE:
        found |= _MADE[effect](parameters, rig, counts)
    return found
