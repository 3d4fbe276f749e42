"""Which parameters of the rig an effect's torques along a known motion depend on."""

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.rig_parameters import made_of
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion, responses_along
from drill_env.effects.declared import bundled
from drill_env.parameters import SYMBOLS

_ROWS = 3000


def _motion() -> Motion:
    """Both discs turn, rest and turn back, under a voltage in steps."""
    t = 0.01 * np.arange(_ROWS)
    states = np.zeros((_ROWS, 6))
    states[:, 0] = 0.5 * np.sin(t)
    for column, speed in ((1, 2.0 * np.sin(1.1 * t)), (2, 1.5 * np.sin(1.3 * t) - 0.2)):
        states[:, column] = np.where(np.abs(speed) < 0.5, 0.0, speed)
    states[:, 3] = 0.01 * np.cumsum(states[:, 2])
    return Motion(t, np.round(3.0 * np.sin(0.7 * t), 1), states, np.array([0]))


@pytest.mark.parametrize("name", LIBRARY)
def test_torques_follow_no_other_parameter(name: str) -> None:
    """Finite differences by every parameter of the rig: only those named move a torque."""
    effect, rig, motion = LIBRARY[name], Rig.paper(), _motion()
    q = np.array([p.grid[len(p.grid) // 2] for p in effect.parameters])
    below = responses_along(bundled([(effect, q)]), rig, motion)[0]
    moved = set()
    for symbol in SYMBOLS:
        value = getattr(rig, symbol)
        step = 1e-3 * max(abs(value), 1e-3)
        above = responses_along(
            bundled([(effect, q)]), rig.replace(**{symbol: value + step}), motion
        )[0]
        # Rounding of sums of torques of 1 Nm is 1e-16.
        if np.abs(above - below).max() > 1e-13:
            moved.add(symbol)
    assert moved <= set(made_of(effect))


def test_most_effects_follow_few() -> None:
    """A torque of its own follows none, one of the drive its constant, a brake's factor its law."""
    assert made_of(LIBRARY["unbalance"]) == ()
    assert made_of(LIBRARY["supply_sag"]) == ("km",)
    assert {"Tsl", "T1", "T2", "beta1", "beta2", "bl"} < set(made_of(LIBRARY["wear"]))
