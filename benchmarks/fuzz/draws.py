"""Random rigs, effects and voltages within physical ranges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, get_args

import numpy as np

from drill_env import Rig
from drill_env._types import FloatArray, FrictionLaw
from drill_env.effects import LIBRARY, Effect
from drill_env.effects.declared import declared
from drill_env.integrator import Voltage, as_voltage, sampled_voltage, simulate

SECONDS = 10.0
MOST_VOLTS = 5.0
TURNS = 0.1
"""Speed of a disc that moves, rad/s."""
TABLES = (
    ("upper", "theta_u", "torque", 0.05), ("lower", "theta_l", "friction", 0.3),
    ("lower", "omega_l", "friction", 0.3), ("string", "twist", "stiffness", 0.3),
    ("string", "omega_u - omega_l", "torque", 0.01), ("actuator", "voltage", "drive", 0.3),
    ("upper", "omega_u", "damping", 0.3), ("lower", "time", "friction", 0.3),
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """One run: what is simulated, from where, under what."""

    number: int
    rig: Rig
    voltage: Voltage
    start: FloatArray
    sort: str


def logarithmic(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_rig(rng: np.random.Generator) -> Rig:
    """Motors of 0.3 to 10 Nm/V that turn 5 to 200 rad/s at full voltage, on any string."""
    law = str(rng.choice(get_args(FrictionLaw)))
    km = logarithmic(rng, 0.3, 10.0)
    bu = km * MOST_VOLTS / logarithmic(rng, 5.0, 200.0)
    static_u = 0.0 if rng.random() < 0.2 else logarithmic(rng, 1e-3, 3.0)
    static_l = 0.0 if rng.random() < 0.2 else logarithmic(rng, 1e-4, 1.0)
    humped = law == "humped"
    return Rig(
        km=km, Ju=logarithmic(rng, 0.01, 10.0), Jl=logarithmic(rng, 1e-3, 1.0),
        ktheta=logarithmic(rng, 0.01, 10.0), Tsu=static_u,
        dTsu=static_u * float(rng.choice([0.0, 0.03, -0.5, 0.9])), bu=bu,
        dbu=bu * float(rng.choice([0.0, 0.3, -0.6])), Tsl=static_l,
        T1=float(rng.choice([0.0826, 0.0, 0.3])) if humped else -static_l * rng.uniform(0.0, 1.0),
        T2=float(rng.choice([-0.291, 0.0, 0.2])) if humped else 0.0,
        beta1=float(rng.choice([1.0, 6.3598, 100.0])), beta2=float(rng.choice([0.0768, 3.0])),
        bl=float(rng.choice([1e-3, 0.0042, 0.1])), friction=law, clamp=bool(rng.random() < 0.3),
    )  # fmt: skip


def limits(effect: Effect, rig: Rig) -> dict[str, tuple[float, float]]:
    """Sizes that leave the rig a machine: its friction brakes, its string pulls back."""
    upper = (1e-3 * rig.km, 0.5 * rig.km)
    brake = 0.3 * (rig.Tsl + abs(rig.T1)) + 1e-3
    speed = 2.0 * MOST_VOLTS * rig.km / rig.bu
    torque = rig.Tsl + abs(rig.T1) + abs(rig.T2) + rig.bl * speed
    coldest = min(0.5, 0.45 / (torque * speed))
    back_emf = (1e-3 * rig.bu / rig.km, 0.35 * rig.bu / rig.km)
    own: dict[str, dict[str, tuple[float, float]]] = {
        "upper_asymmetry": {"damping": (1e-3 * rig.bu, 0.35 * rig.bu)},
        "upper_viscous": {"damping": (1e-3 * rig.bu, 3.0 * rig.bu)},
        "upper_friction_lag": {"torque": (1e-2 * rig.Tsu, rig.Tsu)},
        "upper_presliding": {"torque": (1e-2 * rig.Tsu, rig.Tsu)},
        "upper_offset": {"torque": upper},
        # The rig's damping holds the motor's own back-EMF.
        "current_limit": {"back_emf": back_emf},
        "coasting": {"back_emf": back_emf},
        "upper_spring": {"stiffness": upper, "centre": (0.1, 10.0)},
        "upper_quadratic_drag": {"coefficient": (1e-3 * rig.bu, 0.3 * rig.bu)},
        "string_asymmetry": {"coefficient": (1e-3 * rig.ktheta, 0.9 * rig.ktheta)},
        "string_hardening": {"coefficient": (1e-4 * rig.ktheta, rig.ktheta)},
        "string_damping": {"damping": (1e-4 * rig.ktheta, 0.1 * rig.ktheta)},
        "string_hysteresis": {"torque": (1e-2 * rig.ktheta, 2.0 * rig.ktheta)},
        "string_inertia": {"frequency": (0.3, 30.0)},
        "upper_resonator": {"share": (1e-2, 1.0)},
        "lower_resonator": {"share": (1e-2, 1.0)},
        "upper_viscous_damper": {"share": (1e-2, 1.0)},
        "lower_viscous_damper": {"share": (1e-2, 1.0)},
        "rate_state": {"torque": (1e-2 * brake, 0.3 * brake)},
        "quadratic_drag": {"coefficient": (1e-6, 1e-2)},
        # Its heat leaves the brake some friction at twice the speed of full voltage.
        "friction_heating": {"loss": (0.01 * coldest, coldest)},
        "friction_step": {"step": (0.01, 0.9), "time": (0.0, SECONDS)},
        "torque_pulse": {"time": (0.0, SECONDS)},
        "torque_ripple": {"order": (1.5, 60.0)},
    }
    for name in ("upper_coulomb", "upper_disturbance", "upper_unbalance", "upper_stribeck",
                 "torque_ripple"):  # fmt: skip
        own.setdefault(name, {})["torque"] = upper
    for name in ("unbalance", "lower_disturbance", "lower_stribeck", "torque_pulse",
                 "dwell_stiction", "whirl_drag"):  # fmt: skip
        own.setdefault(name, {})["torque"] = (1e-2 * brake, brake)
    return own.get(effect.id, {})


def draw_numbers(
    rng: np.random.Generator, effect: Effect, rig: Rig, wide: bool
) -> dict[str, float]:
    """A shape from a fifth to five times its grid, an amplitude about its usual size.

    `wide` draws shapes from all that a rig file may hold.
    """
    found, sizes = {}, limits(effect, rig)
    for number in effect.parameters:
        if number.role == "phase":
            found[number.name] = float(rng.uniform(-np.pi, np.pi))
            continue
        reach = 20.0 if number.role == "amplitude" else 5.0
        if wide and number.role == "shape":
            reach = np.inf
        if effect.id == "string_hardening":
            # A softening string lets go for ever beyond some twist.
            number = replace(number, low=0.0)
        positive = [g for g in number.grid if g > 0.0] or [1.0]
        low, high = sizes.get(number.name, (min(positive) / reach, max(positive) * reach))
        low, high = max(low, number.low, 1e-7), min(high, number.high, 1e6)
        value = logarithmic(rng, low, high) if high > low else high
        signed = number.role == "amplitude" and number.low < 0.0
        found[number.name] = float(
            -value if signed and rng.random() < 0.5 and -value >= number.low else value
        )
    return found


def draw_table(rng: np.random.Generator) -> dict[str, Any]:
    component, coordinate, sort, size = TABLES[rng.integers(len(TABLES))]
    turning = coordinate.startswith("theta")
    count = int(rng.integers(2, 12))
    knots = np.linspace(0.0, 6.0, count) if turning else np.sort(rng.uniform(-5.0, 10.0, count))
    values = size * rng.uniform(-1.0, 1.0, count)
    return {
        "id": "table", "component": component, "depends_on": coordinate, "sort": sort,
        "knots": (knots + 1e-3 * np.arange(count)).tolist(), "values": values.tolist(),
    }  # fmt: skip


def draw_effects(
    rng: np.random.Generator, rig: Rig, wide: bool, library: Sequence[str]
) -> tuple[dict[str, Any], ...]:
    """One to three effects, of which one at most replaces the drive."""
    names, found, drives = [*library, "table", "table"], [], 0
    for name in rng.choice(names, size=int(rng.integers(1, 4)), replace=False):
        if name == "table":
            found.append(draw_table(rng))
            continue
        effect = LIBRARY[str(name)]
        drives += effect.replaces_balance
        if not (effect.replaces_balance and drives > 1):
            found.append({"id": effect.id, **draw_numbers(rng, effect, rig, wide)})
    return tuple(found)


def draw_voltage(
    rng: np.random.Generator, rig: Rig, seconds: float = SECONDS
) -> tuple[str, Voltage]:
    sort = str(rng.choice(["zero", "constant", "steps", "sine", "reversing", "edge"]))
    level = float(rng.choice([0.05, 0.5, 2.0, 5.0]) * rng.choice([-1.0, 1.0]))
    hertz = logarithmic(rng, 0.05, 5.0)
    if sort == "zero":
        drive: Any = 0.0
    elif sort == "constant":
        drive = level
    elif sort == "edge":
        drive = float((rig.Tsu + rig.dTsu) / rig.km)
    elif sort == "sine":
        drive = lambda t: level * float(np.sin(2.0 * np.pi * hertz * t))  # noqa: E731
    else:
        n = max(2, round(2.0 * hertz * seconds)) if sort == "reversing" else 20
        volts = level * np.where(np.arange(n) % 2, -1.0, 1.0)
        if sort == "steps":
            volts = rng.uniform(-MOST_VOLTS, MOST_VOLTS, n) * rng.choice([0.0, 0.02, 1.0], n)
        drive = sampled_voltage(np.arange(n) * seconds / n, volts, seconds)
    return sort, as_voltage(drive, 0.0, seconds)


def draw_case(
    seed: int, number: int, *, wide: bool = False, library: Sequence[str] = tuple(LIBRARY)
) -> Case:
    """Case `number` of a seed, whatever was drawn before it, with effects of `library`."""
    rng = np.random.default_rng([seed, number])
    rig = draw_rig(rng)
    rig = rig.replace(effects=draw_effects(rng, rig, wide, library))
    declared(rig)
    sort, voltage = draw_voltage(rng, rig)
    start = np.zeros(4) if rng.random() < 0.7 else rng.uniform(-4.0, 4.0, 4)
    return Case(number, rig, voltage, start, sort)


def draw_moving(seed: int, number: int, seconds: float, name: str | None = None) -> Case:
    """A case that turns, at voltages that only jump, with one effect or none."""
    rng = np.random.default_rng([seed, number])
    while True:
        rig = draw_rig(rng)
        if name is not None:
            entry = {"id": name, **draw_numbers(rng, LIBRARY[name], rig, wide=False)}
            # The reference clamps the law at the disc's own speed alone.
            rig = rig.replace(effects=(entry,), clamp=rig.clamp and name != "friction_lag")
        sort, voltage = draw_voltage(rng, rig, seconds)
        start = np.zeros(4) if rng.random() < 0.7 else rng.uniform(-4.0, 4.0, 4)
        if voltage.pieces.shape[1] > 1:
            continue
        run = simulate(rig, voltage, seconds, initial=start, rate=10.0)
        if np.abs(run.state[1:, 1:3]).max() > TURNS:
            return Case(number, rig, voltage, start, sort)
