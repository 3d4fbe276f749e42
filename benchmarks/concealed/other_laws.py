"""Effects whose law nature might have and the tool's library has not: each has siblings there.

The exponent or the way to saturate is another one. An answer of kind `differ` tells the siblings:
the names that count as right, chosen by the physics before any run. The formulas are in
`torques.py` and `held.py`.
"""

from __future__ import annotations

from benchmarks.concealed.library import COUNT, LIBRARY, UNLISTED, Concealed

_SOFT = ("amplifier_saturation", "soft_saturation")
_UPPER_STRIBECK = ("upper_stribeck", "upper_gaussian_stribeck")
_LOWER_STRIBECK = ("lower_stribeck", "lower_gaussian_stribeck")
_LAWS = (
    # 2/pi limit atan(pi/2 u/limit).
    Concealed("arctan_saturation", "actuator", "limit", "V", 0.3, 2.5, ("voltage",),
              {"limit": "arctan_limit"}, settle=lambda s: 5.0 / s, siblings=_SOFT),
    # limit tanh(u/limit).
    Concealed("tanh_saturation", "actuator", "limit", "V", 0.3, 2.5, ("voltage",),
              {"limit": "tanh_limit"}, settle=lambda s: 5.0 / s, siblings=_SOFT),
    # -km u loss h, tau dh/dt = u^2/(25 V^2) - h^power: air that moves by its own warmth.
    Concealed("convective_motor_heating", "actuator", "loss", "1", 0.03, 0.5, ("time", "voltage"),
              {"loss": "heating", "tau": "heating_tau", "power": "heating_power"},
              {"tau": (10.0, 25.0), "power": (1.25, 1.25)}, siblings=("motor_heating",)),
    # torque exp(-(w/speed)^power).
    Concealed("upper_power_stribeck", "upper", "torque", "Nm", 0.03, 0.5, ("omega_u",),
              {"torque": "upper_stribeck", "speed": "upper_stribeck_speed",
               "power": "upper_stribeck_power"},
              {"speed": (0.2, 0.6), "power": (1.3, 1.7)}, siblings=_UPPER_STRIBECK),
    # torque/(1 + w/speed).
    Concealed("upper_rational_stribeck", "upper", "torque", "Nm", 0.03, 0.5, ("omega_u",),
              {"torque": "rational_stribeck", "speed": "rational_stribeck_speed"},
              {"speed": (0.2, 0.6)}, siblings=_UPPER_STRIBECK),
    # coefficient w^power.
    Concealed("upper_power_drag", "upper", "coefficient", "Nm (s/rad)^power", 0.01, 0.5,
              ("omega_u",), {"coefficient": "upper_drag", "power": "upper_drag_power"},
              {"power": (1.4, 1.6)}, siblings=("upper_quadratic_drag",)),
    # coefficient |torque of the string|^power.
    Concealed("power_load_friction", "upper", "coefficient", "Nm^(1 - power)", 0.05, 0.8,
              ("twist",), {"coefficient": "load_friction", "power": "load_power"},
              {"power": (0.75, 0.85)}, siblings=("load_dependent_friction",)),
    # excess/(1 + t/time_constant) of the upper friction.
    Concealed("rational_warmup", "upper", "excess", "1", 0.03, 0.6, ("time",),
              {"excess": "rational_warmup", "time_constant": "rational_warmup_time"},
              {"time_constant": (5.0, 15.0)}, siblings=("friction_warmup",)),
    # ktheta hardening sign(twist) |twist|^power.
    Concealed("string_power_hardening", "string", "hardening", "rad^(1 - power)", 0.002, 0.3,
              ("twist",), {"power": "hardening_power"}, {"power": (1.4, 1.6)},
              siblings=("string_second_spring", "string_hardening")),
    # ktheta stiffening times the twist beyond an angle, in either direction.
    Concealed("string_knee", "string", "stiffening", "1", 0.01, 0.5, ("twist",),
              {"knee": "stiffening_from"}, {"knee": (0.7, 1.4)},
              siblings=("string_second_spring", "string_hardening")),
    # Bouc-Wen with |z|^power: its sliders let go nearer to one another.
    Concealed("string_power_hysteresis", "string", "amplitude", "Nm", 0.002, 0.06,
              ("twist", "twist_rate"),
              {"amplitude": "hysteresis", "width": "hysteresis_width", "power": "hysteresis_power"},
              {"width": (0.2, 0.5), "power": (2.0, 4.0)}, siblings=("string_hysteresis",)),
    # damping sign(rate) |rate of the twist|^power.
    Concealed("string_power_damping", "string", "damping", "Nm (s/rad)^power", 5e-4, 0.01,
              ("twist_rate", "omega_l", "omega_u"), {"power": "damping_power"},
              {"power": (1.4, 1.7)}, siblings=("string_damping",)),
    Concealed("lower_power_stribeck", "lower", "torque", "Nm", 0.003, 0.08, ("omega_l",),
              {"torque": "lower_stribeck", "speed": "lower_stribeck_speed",
               "power": "lower_stribeck_power"},
              {"speed": (0.1, 0.4), "power": (0.6, 0.75)}, siblings=_LOWER_STRIBECK),
    Concealed("lower_power_drag", "lower", "coefficient", "Nm (s/rad)^power", 1e-5, 1e-3,
              ("omega_l",), {"coefficient": "lower_drag", "power": "lower_drag_power"},
              {"power": (2.4, 2.6)}, siblings=("quadratic_drag",)),
    # distance dz/dtheta_l = sign(1 - z) |1 - z|^power before it slides forward.
    Concealed("power_presliding", "lower", "distance", "rad", 0.03, 1.0, ("omega_l", "theta_l"),
              {"distance": "presliding", "power": "presliding_power"}, {"power": (1.5, 2.0)},
              least=COUNT, siblings=("presliding",)),
    # change t/(t + time_constant) of the brake's friction.
    Concealed("rational_settling", "lower", "change", "1", 0.03, 0.6, ("time",),
              {"change": "settling", "time_constant": "settling_time"},
              {"time_constant": (5.0, 15.0)}, sign=True, siblings=("friction_settling",)),
)  # fmt: skip
OTHER_LAWS = {effect.id: effect for effect in _LAWS}
CONCEALABLE = {**LIBRARY, **UNLISTED, **OTHER_LAWS}
"""Everything that can be concealed, by its id."""
