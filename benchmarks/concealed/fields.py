"""Numbers and states of the plant: one record of parameters, one vector of states."""

from __future__ import annotations

import math

import numpy as np

RIG = ("km", "Ju", "Tsu", "dTsu", "bu", "dbu", "Jl", "ktheta", "Tsl", "T1", "T2", "beta1",
       "beta2", "bl")  # fmt: skip

# Equations (6) and (8) of the paper, typed off it here again.
PAPER = {
    "km": 3.5693, "Ju": 0.4765, "Tsu": 0.3212, "dTsu": 0.0095, "bu": 1.9833, "dbu": -0.0167,
    "Jl": 0.0326, "ktheta": 0.078, "Tsl": 0.0094, "T1": 0.0826, "T2": -0.291,
    "beta1": 6.3598, "beta2": 0.0768, "bl": 0.0042,
}  # fmt: skip

ACTUATOR = (
    "voltage_limit", "deadzone", "slew_rate", "lag", "input_delay", "sag", "sag_tau", "heating",
    "heating_tau", "gain_asymmetry", "ripple", "ripple_order", "ripple_phase",
)  # fmt: skip
UPPER = (
    "gap", "compliance", "motor_share", "load_friction", "upper_stribeck", "upper_stribeck_speed",
    "upper_drag", "warmup", "warmup_tau", "gear_eccentricity", "gear_phase",
    "upper_torque", "upper_frequency", "upper_phase", "tooth", "tooth_angle",
)  # fmt: skip
STRING = (
    "damping", "cubic_damping", "hardening", "hysteresis", "hysteresis_width",
    "string_asymmetry", "play", "string_inertia", "creep", "creep_tau",
)  # fmt: skip
LOWER = (
    "lower_stribeck", "lower_stribeck_speed", "lower_asymmetry", "presliding", "friction_lag",
    "state_torque", "state_distance", "state_speed", "dwell_torque", "dwell_tau", "runout",
    "runout_phase", "unbalance", "unbalance_phase", "drift", "heat_fade", "heat_tau",
    "step", "step_time", "wear", "wear_distance", "lower_drag", "whirl", "whirl_speed",
    "whirl_damping", "lower_torque", "lower_frequency", "lower_phase", "pulse", "pulse_time",
    "pulse_width", "spot", "spot_angle",
)  # fmt: skip
# Laws that no library has; and the library's own, whose exponents are those of `POWERS` elsewhere.
OTHER = (
    "arctan_limit", "tanh_limit", "rational_stribeck", "rational_stribeck_speed",
    "rational_warmup", "rational_warmup_time", "stiffening", "stiffening_from", "settling",
    "settling_time",
)  # fmt: skip
POWERS = {
    "heating_power": 1.0, "upper_stribeck_power": 1.0, "upper_drag_power": 2.0,
    "load_power": 1.0, "damping_power": 1.0, "hardening_power": 3.0, "hysteresis_power": 1.0,
    "lower_stribeck_power": 1.0, "presliding_power": 1.0, "lower_drag_power": 2.0,
}  # fmt: skip
PLANT = np.dtype(
    [(name, "f8") for name in (*RIG, *ACTUATOR, *UPPER, *STRING, *LOWER, *OTHER, *POWERS)]
)
"""Every effect's size is 0 where it is absent."""

# States that the Runge-Kutta steps carry ...
TH_U, W_U, TH_L, W_L, TH_M, W_M, TH_S, W_S, HYST, CREEP, LAGGED, AGE = range(12)
N_STEPPED = 12
# ... and states updated once a substep, exactly where they are linear.
SLEWED, VOLTS, SAGGED, WINDING, DWELL, BRAKE_HEAT, SLID = range(12, 19)
# Presliding keeps the bristles' bend and the angle at the last reversal: it is exact from there.
BEND, ANCHOR = range(19, 21)
N_STATES = 21
# Held over a substep: motor torque, other torques on the discs, friction factors, extra hold.
DRIVE, NOISE_U, NOISE_L, FACTOR_U, FACTOR_L, HOLD = range(6)
N_HELD = 6

MESH_STIFFNESS = 2e4
"""Nm/rad, of gear teeth in contact behind a gap."""


def plant_record(rig: dict[str, float], settings: dict[str, float] | None = None) -> np.ndarray:
    """The parameters of a rig and of its effects; what else is no exponent is 0, shape (1,)."""
    record = np.zeros(1, dtype=PLANT)
    for name, value in {**POWERS, **rig, **(settings or {})}.items():
        record[name] = value
    return record


def substeps_for(record: np.ndarray, interval: float, least: int = 10) -> int:
    """Substeps a sample that the fastest mode of the plant asks for."""
    q = record[0]
    rates = [0.0]
    if q["gap"] > 0 or q["compliance"] > 0:
        stiffness = MESH_STIFFNESS if q["gap"] > 0 else 1.0 / q["compliance"]
        share = q["motor_share"]
        rates.append(math.sqrt(stiffness / (share * (1.0 - share) * q["Ju"])))
    if q["string_inertia"] > 0:
        rates.append(math.sqrt(4.0 * q["ktheta"] / q["string_inertia"]))
    if q["presliding"] > 0:
        rates.append(math.sqrt(q["Tsl"] / q["presliding"] / q["Jl"]))
    if q["hysteresis"] > 0:
        rates.append(25.0 / q["hysteresis_width"])
    if q["friction_lag"] > 0:
        # Stable is enough: a lag shorter than a substep is none.
        rates.append(0.25 / q["friction_lag"])
    return max(least, math.ceil(interval * max(rates) / 0.5))
