"""Effects that can be concealed: their size, their shape and where they sit in the plant.

Each has one size, from 0 (absent) upwards, and shape parameters drawn from ranges. The names are
those of the issue; the formulas are in `torques.py`, `plant.py` and `sensors.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

TURN = (0.0, 2.0 * math.pi)
COUNT = 2.0 * math.pi / 8192
LISTED_ONLY_BY_LAW = "friction_shape"
"""It is no change of the plant: the tool starts from a law without the hump."""


@dataclass(frozen=True)
class Concealed:
    """One effect.

    Attributes:
        id: its name in the issue.
        component: actuator, upper, string, lower or sensor.
        size, unit: name and unit of the parameter that grows from 0 with it.
        guess: size from which the detection limit is sought.
        largest: size beyond which the rig would no longer be one.
        depends_on: coordinates on which an unnamed finding may rightly depend.
        shape: other parameters and their ranges; equal ends fix one.
        places: parameter to the plant's field, or "sensor." and the sensors' one.
        settle: from the size to the value of its field, where they differ.
        least: smallest detection limit, where a nuisance absorbs less.
        sign: whether the size is drawn with either sign.
        siblings: names of the tool's library that count as right, where it has not this law.
    """

    id: str
    component: str
    size: str
    unit: str
    guess: float
    largest: float
    depends_on: tuple[str, ...]
    places: Mapping[str, str]
    shape: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    settle: Callable[[float], float] | None = None
    least: float = 0.0
    sign: bool = False
    siblings: tuple[str, ...] = ()

    def middle(self) -> dict[str, float]:
        """Shape parameters in the middle of their ranges."""
        return {n: math.sqrt(a * b) if a > 0 else 0.5 * (a + b) for n, (a, b) in self.shape.items()}

    def draw(self, rng: np.random.Generator) -> dict[str, float]:
        """Shape parameters drawn from their ranges, evenly in the logarithm unless from 0."""
        found = {}
        for name, (a, b) in self.shape.items():
            evenly = rng.uniform(math.log(a), math.log(b)) if a > 0 else rng.uniform(a, b)
            found[name] = math.exp(evenly) if a > 0 else float(evenly)
        return found

    def parameters(self, size: float, shape: Mapping[str, float]) -> dict[str, float]:
        """Its parameters in SI units as an answer tells them; empty where it is absent."""
        if size == 0.0:
            return {}
        return {self.size: self.settle(size) if self.settle else size, **shape}

    def settings(
        self, parameters: Mapping[str, float]
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Fields of the plant and of the sensors for its parameters."""
        plant: dict[str, float] = {}
        sensors: dict[str, float] = {}
        for name, value in parameters.items():
            place = self.places.get(name, name)
            kind, _, last = place.rpartition(".")
            (sensors if kind == "sensor" else plant)[last] = value
        return plant, sensors


def _e(
    id: str, component: str, size: str, unit: str, guess: float, largest: float, depends_on: str,
    places: str = "", **more: object,
) -> Concealed:  # fmt: skip
    pairs = dict(item.split("=") for item in places.split()) if places else {}
    return Concealed(id, component, size, unit, guess, largest, tuple(depends_on.split()), pairs,
                     **more)  # fmt: skip


# A gear motor carries part of the upper inertia.
_SHARE = {"motor_share": (0.3, 0.5)}
_ACTUATOR = (
    _e("amplifier_saturation", "actuator", "limit", "V", 0.1, 2.0, "voltage",
       "limit=voltage_limit", settle=lambda s: 5.0 / (1.0 + s)),
    _e("amplifier_deadzone", "actuator", "half_width", "V", 0.02, 1.0, "voltage",
       "half_width=deadzone"),
    _e("slew_limit", "actuator", "rate", "V/s", 0.02, 1.5, "voltage", "rate=slew_rate",
       settle=lambda s: 1.0 / s, least=2e-3),
    _e("actuator_lag", "actuator", "tau", "s", 0.02, 0.6, "voltage", "tau=lag", least=7.5e-3),
    _e("input_delay", "actuator", "delay", "s", 0.02, 0.3, "voltage", "delay=input_delay",
       least=7.5e-3),
    _e("supply_sag", "actuator", "sag", "1/V", 0.004, 0.08, "voltage", "tau=sag_tau",
       shape={"tau": (0.05, 0.05)}),
    _e("motor_heating", "actuator", "loss", "1", 0.03, 0.5, "time voltage",
       "loss=heating tau=heating_tau", shape={"tau": (10.0, 25.0)}),
    _e("gain_asymmetry", "actuator", "asymmetry", "1", 0.01, 0.3, "voltage",
       "asymmetry=gain_asymmetry", sign=True),
    _e("torque_ripple", "actuator", "amplitude", "Nm", 0.01, 0.4, "theta_u",
       "amplitude=ripple order=ripple_order phase=ripple_phase",
       shape={"order": (4.0, 12.0), "phase": TURN}),
)  # fmt: skip
_UPPER = (
    _e("gear_backlash", "upper", "gap", "rad", 0.02, 0.6, "omega_u voltage twist",
       shape=_SHARE, least=COUNT),
    _e("gear_compliance", "upper", "compliance", "rad/Nm", 0.01, 0.3, "voltage omega_u twist",
       shape=_SHARE),
    _e("load_dependent_friction", "upper", "coefficient", "1", 0.05, 0.8, "twist",
       "coefficient=load_friction"),
    _e("upper_stribeck", "upper", "torque", "Nm", 0.03, 0.5, "omega_u",
       "torque=upper_stribeck speed=upper_stribeck_speed", shape={"speed": (0.2, 0.6)}),
    _e("upper_quadratic_drag", "upper", "coefficient", "Nm s2/rad2", 0.01, 0.25, "omega_u",
       "coefficient=upper_drag"),
    _e("friction_warmup", "upper", "excess", "1", 0.03, 0.6, "time",
       "excess=warmup tau=warmup_tau", shape={"tau": (10.0, 30.0)}),
    _e("gear_eccentricity", "upper", "eccentricity", "1", 0.01, 0.3, "theta_u",
       "eccentricity=gear_eccentricity phase=gear_phase", shape={"phase": TURN}),
    _e("upper_disturbance", "upper", "amplitude", "Nm", 0.01, 0.6, "time",
       "amplitude=upper_torque frequency=upper_frequency phase=upper_phase",
       shape={"frequency": (0.4, 3.0), "phase": TURN}),
)  # fmt: skip
_STRING = (
    _e("string_damping", "string", "damping", "Nm s/rad", 5e-4, 0.01, "twist_rate omega_l omega_u"),
    _e("string_hardening", "string", "hardening", "1/rad2", 0.002, 0.1, "twist"),
    _e("string_hysteresis", "string", "amplitude", "Nm", 0.002, 0.06, "twist twist_rate",
       "amplitude=hysteresis width=hysteresis_width", shape={"width": (0.2, 0.5)}),
    _e("string_asymmetry", "string", "asymmetry", "1", 0.01, 0.3, "twist",
       "asymmetry=string_asymmetry", sign=True),
    _e("string_play", "string", "half_width", "rad", 0.02, 0.6, "twist", "half_width=play"),
    _e("string_inertia", "string", "inertia", "kg m2", 5e-4, 0.012, "twist twist_rate omega_l",
       "inertia=string_inertia"),
    _e("string_creep", "string", "creep", "1", 0.02, 0.5, "twist time", "tau=creep_tau",
       shape={"tau": (4.0, 10.0)}),
)  # fmt: skip
_LOWER = (
    _e("lower_stribeck", "lower", "torque", "Nm", 0.003, 0.08, "omega_l",
       "torque=lower_stribeck speed=lower_stribeck_speed", shape={"speed": (0.1, 0.4)}),
    _e("lower_asymmetry", "lower", "asymmetry", "1", 0.02, 0.5, "omega_l",
       "asymmetry=lower_asymmetry", sign=True),
    _e("presliding", "lower", "distance", "rad", 0.03, 1.0, "omega_l theta_l",
       "distance=presliding", least=COUNT),
    _e("friction_lag", "lower", "tau", "s", 0.01, 0.25, "omega_l", "tau=friction_lag", least=3e-4),
    _e("rate_state", "lower", "torque", "Nm", 0.002, 0.03, "omega_l",
       "torque=state_torque distance=state_distance speed=state_speed",
       shape={"distance": (0.3, 1.5), "speed": (0.3, 1.0)}),
    _e("dwell_stiction", "lower", "torque", "Nm", 0.005, 0.15, "omega_l time",
       "torque=dwell_torque tau=dwell_tau", shape={"tau": (0.5, 2.0)}),
    _e("brake_runout", "lower", "runout", "1", 0.01, 0.5, "theta_l", "phase=runout_phase",
       shape={"phase": TURN}),
    _e("unbalance", "lower", "torque", "Nm", 5e-4, 0.03, "theta_l",
       "torque=unbalance phase=unbalance_phase", shape={"phase": TURN}),
    _e("friction_drift", "lower", "drift", "1/min", 0.02, 0.8, "time", sign=True),
    _e("friction_heating", "lower", "fade", "1", 0.02, 0.5, "time omega_l",
       "fade=heat_fade tau=heat_tau", shape={"tau": (8.0, 20.0)}),
    _e("friction_step", "lower", "step", "1", 0.02, 0.6, "time", "time=step_time",
       shape={"time": (15.0, 45.0)}, sign=True),
    _e("wear", "lower", "loss", "1", 0.02, 0.6, "time theta_l",
       "loss=wear distance=wear_distance", shape={"distance": (60.0, 250.0)}),
    _e("quadratic_drag", "lower", "coefficient", "Nm s2/rad2", 3e-5, 2e-3, "omega_l",
       "coefficient=lower_drag"),
    _e("whirl_drag", "lower", "torque", "Nm", 0.002, 0.05, "omega_l",
       "torque=whirl speed=whirl_speed damping=whirl_damping",
       shape={"speed": (6.0, 10.0), "damping": (0.3, 0.3)}),
    _e("lower_disturbance", "lower", "amplitude", "Nm", 5e-4, 0.05, "time",
       "amplitude=lower_torque frequency=lower_frequency phase=lower_phase",
       shape={"frequency": (0.4, 3.0), "phase": TURN}),
    _e("torque_pulse", "lower", "torque", "Nm", 0.01, 0.3, "time",
       "torque=pulse time=pulse_time width=pulse_width",
       shape={"time": (15.0, 45.0), "width": (0.2, 0.5)}),
)  # fmt: skip


def _encoders() -> tuple[Concealed, ...]:
    found = []
    for disc, last in (("upper", "u"), ("lower", "l")):
        angle, speed = f"theta_{last}", f"omega_{last}"
        found += [
            _e(f"encoder_eccentricity_{disc}", "sensor", "amplitude", "rad", 3e-3, 0.3, angle,
               f"amplitude=sensor.eccentricity_{last} phase=sensor.eccentricity_phase_{last}",
               shape={"phase": TURN}),
            _e(f"encoder_delay_{disc}", "sensor", "delay", "s", 0.02, 0.3, speed,
               f"delay=sensor.delay_{last}", least=7.5e-3),
            _e(f"missed_counts_{disc}", "sensor", "size", "rad", 4 * COUNT, 0.5, f"time {angle}",
               f"size=sensor.missed_{last} rate=sensor.missed_rate", shape={"rate": (0.03, 0.1)},
               least=COUNT),
        ]  # fmt: skip
    return tuple(found)


_SENSOR = (
    *_encoders(),
    _e("encoder_gain_lower", "sensor", "gain", "1", 5e-3, 0.1, "theta_l", "gain=sensor.gain_l"),
    _e("lost_encoder_bits", "sensor", "step", "rad", 4 * COUNT, 256 * COUNT, "theta_l",
       "step=sensor.coarse_l", least=2 * COUNT),
    _e("clock_jitter", "sensor", "sigma", "s", 1e-4, 2e-3, "omega_l omega_u time",
       "sigma=sensor.clock", least=5e-5),
    _e("missing_samples", "sensor", "share", "1", 5e-3, 0.3, "time omega_l omega_u",
       "share=sensor.repeated run=sensor.repeated_run", shape={"run": (3.0, 8.0)}, least=5e-4),
)  # fmt: skip
LIBRARY = {effect.id: effect for effect in (*_ACTUATOR, *_UPPER, *_STRING, *_LOWER, *_SENSOR)}

UNLISTED = {effect.id: effect for effect in (
    _e("brake_hard_spot", "lower", "excess", "1", 0.05, 2.0, "theta_l",
       "excess=spot angle=spot_angle", shape={"angle": TURN}),
    _e("gear_bad_tooth", "upper", "excess", "1", 0.05, 2.0, "theta_u",
       "excess=tooth angle=tooth_angle", shape={"angle": TURN}),
    _e("string_cubic_damping", "string", "damping", "Nm s3/rad3", 1e-5, 5e-4,
       "twist_rate omega_l omega_u", "damping=cubic_damping"),
    _e("encoder_second_order_lower", "sensor", "amplitude", "rad", 2e-3, 0.2, "theta_l",
       "amplitude=sensor.second_order_l"),
)}  # fmt: skip
"""In no library: a small one is in every case, a large one in some of those out of it."""

# Left out of the library, their nearest neighbours do not stand in for them.
LEAVE_OUT = (
    "amplifier_deadzone", "torque_ripple", "gear_eccentricity", "upper_stribeck",
    "upper_quadratic_drag", "load_dependent_friction", "upper_disturbance", "string_hardening",
    "string_asymmetry", "lower_stribeck", "lower_asymmetry", "brake_runout", "unbalance",
    "friction_step", "quadratic_drag", "lower_disturbance", "torque_pulse",
)  # fmt: skip

STAND_INS = {
    "torque_ripple": ("commutation_ripple",), "upper_stribeck": ("upper_gaussian_stribeck",),
    "upper_quadratic_drag": ("upper_drag_above_speed",),
    "string_hardening": ("string_second_spring",), "lower_stribeck": ("lower_gaussian_stribeck",),
    "quadratic_drag": ("drag_above_speed",),
}  # fmt: skip
"""What the tool's library has by another law goes with them."""

# Two of one group in the same rig would look like one of them.
NEIGHBOURS = (
    frozenset({"actuator_lag", "input_delay", "slew_limit", "encoder_delay_upper",
               "encoder_delay_lower", "gear_backlash", "gear_compliance", "friction_lag"}),
    frozenset({"friction_drift", "friction_heating", "friction_step", "wear"}),
    frozenset({"motor_heating", "friction_warmup"}),
    frozenset({"quadratic_drag", "whirl_drag"}),
    frozenset({"supply_sag", "upper_quadratic_drag", "amplifier_saturation"}),
    frozenset({"amplifier_deadzone", "upper_stribeck", "load_dependent_friction"}),
    frozenset({"lower_stribeck", "rate_state", "dwell_stiction", "presliding"}),
    frozenset({"unbalance", "brake_runout", "encoder_eccentricity_lower"}),
    frozenset({"gear_eccentricity", "torque_ripple", "encoder_eccentricity_upper"}),
    frozenset({"encoder_gain_lower", "missed_counts_lower", "missed_counts_upper"}),
    frozenset({"string_hysteresis", "string_damping", "string_play", "string_creep"}),
    frozenset({"clock_jitter", "missing_samples", "lost_encoder_bits"}),
)  # fmt: skip
