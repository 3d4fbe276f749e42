"""Sensitivities of rigs with effects against Richardson differences, through events and memories.

With step e a difference of this kind errs by e^4 f5/30 + 2 d/e, d being the integrator's own error
(about 1e-12 of a state at rtol 1e-12): at e = 1e-4 of a number's size both are below 1e-6 of the
largest entry of its column.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drill_env import Rig
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.effects import LIBRARY
from drill_env.integrator import Disc, Kind, sampled_voltage, simulate
from drill_env.parameters import SYMBOLS

TIGHT: dict[str, Any] = {"rtol": 1e-12, "atol": 1e-14}
SECONDS = 5.0
START = np.array([1.0, 2.0, -3.0, 0.5])
DRIVE = sampled_voltage(np.array([0.0, 2.0, 3.2]), np.array([1.5, 5.0, -3.4]), SECONDS)
TIMES = np.linspace(0.0, SECONDS, 26)
NAMES = ("Ju", "Tsu", "dTsu", "Jl", "ktheta", "Tsl", "beta1")
# Where the middle of the grid would do nothing in the run, or nothing that differences can tell.
SETTINGS: dict[str, dict[str, float]] = {
    "wear": {"distance": 20.0},
    "amplifier_saturation": {"level": 3.0},
    "current_limit": {"level": 3.0, "back_emf": 0.3},
    "friction_step": {"time": 2.5},
    "torque_pulse": {"time": 2.5, "duration": 0.7},
    "amplifier_deadzone": {"width": 0.2},
    "upper_presliding": {"distance": 0.05},
    "presliding": {"distance": 0.15},
    "upper_friction_lag": {"time_constant": 0.05},
    "missed_counts_lower": {"speed": 2.0},
    "encoder_play_lower": {"width": 0.3},
    "encoder_play_upper": {"width": 0.3},
    "gear_backlash": {"frequency": 9.5, "damping": 0.07},
}
EXCLUDED = {"input_delay"}


def entry(name: str) -> dict[str, Any]:
    middle = {p.name: p.grid[len(p.grid) // 2] for p in LIBRARY[name].parameters}
    middle |= {"phase": 0.4} if "phase" in middle else {}
    middle |= {"friction_share": 0.6} if "friction_share" in middle else {}
    return {"id": name, **middle, **SETTINGS.get(name, {})}


def richardson(states: Any, value: float) -> FloatArray:
    e = 1e-4 * max(abs(value), 0.01)

    def slope(step: float) -> FloatArray:
        return (states(value + step) - states(value - step)) / (2.0 * step)

    return (4.0 * slope(e) - slope(2.0 * e)) / 3.0


def miss(rig: Rig, names: tuple[str, ...] = NAMES) -> dict[str, float]:
    """Largest errors of the columns in shares of their sizes, away from events."""
    run = simulate(rig, DRIVE, SECONDS, t_eval=TIMES, initial=START, sensitivity=True, **TIGHT)
    clear = np.array([np.abs(run.events.t - t).min(initial=1.0) > 5e-3 for t in TIMES])

    def states(changed: Rig, start: FloatArray) -> FloatArray:
        return simulate(changed, DRIVE, SECONDS, t_eval=TIMES, initial=start, **TIGHT).state

    def started(i: int, value: float) -> FloatArray:
        return states(rig, np.where(np.arange(4) == i, value, START))

    found = {f"y{i}": (i, richardson(lambda v, i=i: started(i, v), START[i])) for i in range(4)}
    for name in names:
        slope = richardson(
            lambda v, n=name: states(rig.replace(**{n: v}), START), getattr(rig, name)
        )
        found[name] = (4 + SYMBOLS.index(name), slope)
    column = 4 + len(SYMBOLS)
    for place, effect in enumerate(rig.effects):
        for key in [key for key in effect if key != "id" and effect["id"] != "table"]:

            def with_number(value: float, place: int = place, key: str = key) -> FloatArray:
                changed = list(rig.effects)
                changed[place] = {**changed[place], key: value}
                return states(rig.replace(effects=tuple(changed)), START)

            found[f"{effect['id']} {key}"] = (column, richardson(with_number, effect[key]))
            column += 1
    assert run.sensitivity.shape == (len(TIMES), 4, column)
    out = {}
    for name, (place, slope) in found.items():
        size = max(float(np.abs(slope[clear]).max()), 1e-3)
        error = np.abs(run.sensitivity[clear, :, place] - slope[clear]).max()
        out[name] = float(error) / size
    return out


@pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")
@pytest.mark.parametrize("name", [name for name in LIBRARY if name not in EXCLUDED])
def test_every_effect_of_the_library(name: str) -> None:
    found = miss(Rig(effects=(entry(name),)), ())
    assert max(found.values()) < 1e-5, found


@pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")
@pytest.mark.parametrize("names", [
    ("friction_lag", "string_hysteresis", "actuator_lag"),
    ("gear_compliance", "brake_runout", "string_damping"),
    ("slew_limit", "string_play", "lower_stribeck", "unbalance"),
    ("upper_friction_lag", "dwell_stiction", "missed_counts_lower"),
    ("gear_backlash", "drive_braking_loss"),
])  # fmt: skip
def test_several_effects_and_the_rigs_parameters(names: tuple[str, ...]) -> None:
    found = miss(Rig(effects=tuple(entry(name) for name in names)))
    assert max(found.values()) < 1e-5, found


@pytest.mark.parametrize("friction", ["stribeck", "coulomb"])
def test_other_friction_laws(friction: Any) -> None:
    law = {"T1": -0.06, "Tsl": 0.09} if friction == "stribeck" else {"Tsl": 0.1}
    rig = Rig(friction=friction, effects=(entry("friction_lag"), entry("string_creep")), **law)
    names = NAMES if friction == "stribeck" else NAMES[:-1]
    found = miss(rig, names)
    assert max(found.values()) < 1e-5, found


def test_sticks_and_a_longer_hold_before_each_release() -> None:
    """The friction that a rest has built up falls at the release: the rates jump with it."""
    held = entry("dwell_stiction") | {"torque": 0.05}
    rig = Rig(effects=(held,), friction="stribeck", Tsl=0.3, T1=-0.15, beta1=2.0)
    found = miss(rig)
    run = simulate(rig, DRIVE, SECONDS, initial=START)
    assert len(run.events.where(Disc.LOWER, Kind.STICK)) > 0
    assert len(run.events.where(Disc.LOWER, Kind.SLIP)) > 0
    assert max(found.values()) < 1e-5, found


def test_the_motion_is_the_same_and_a_table_has_no_columns() -> None:
    table = {"id": "table", "component": "lower", "depends_on": "theta_l", "sort": "friction",
             "knots": [0.0, 1.5, 3.0, 4.5], "values": [0.1, 0.0, -0.1, 0.0]}  # fmt: skip
    rig = Rig(effects=(table, entry("friction_lag")))
    plain = simulate(rig, DRIVE, SECONDS, t_eval=TIMES, initial=START)
    run = simulate(rig, DRIVE, SECONDS, t_eval=TIMES, initial=START, sensitivity=True)
    assert np.abs(plain.state - run.state).max() < 1e-8
    assert max(miss(rig).values()) < 1e-5


def test_a_delay_of_the_voltage_is_refused_with_the_reason() -> None:
    rig = Rig(effects=({"id": "input_delay", "delay": 0.01},))
    with pytest.raises(InputError, match="not offered with input_delay"):
        simulate(rig, 3.5, 1.0, sensitivity=True)
