"""The motion of a rig with an effect, by the package and by the maker of the concealed cases.

Both codes were written apart: other friction functions, another integrator (classical Runge-Kutta
with bisected events against Dormand-Prince between exact events), other effect code. What they
agree on is neither's mistake.
"""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.concealed.fields import PAPER, plant_record
from benchmarks.concealed.library import LIBRARY as CONCEALED
from benchmarks.concealed.limits import stored
from benchmarks.concealed.plant import play
from benchmarks.concealed.sensors import Sensors, shown
from benchmarks.concealed.terms import in_tool_terms
from drill_env._types import FloatArray
from drill_env.effects import LIBRARY
from drill_env.parameters import Rig
from tests.made_recordings import played

T: FloatArray = 5e-3 * np.arange(3001, dtype=np.float64)
# Slow and fast, with reversals and rests.
U: FloatArray = np.round(20.0 * (2.5 * np.sin(0.7 * T) + 1.5 * np.sin(2.3 * T))) / 20.0
# Of the effect: the supply's fast part, the brake that warms (see `terms`), a second mode's losses.
NEARLY = {"supply_sag": 0.03, "friction_heating": 0.02}


def _parameters(name: str) -> dict[str, float]:
    effect = CONCEALED[name]
    size = min(5.0 * stored()[name]["size"], effect.largest)
    found = effect.parameters(size, effect.middle())
    return found | {"time": 6.0} if "time" in found else found


def _whole(name: str) -> bool:
    """Whether every number of the tool's effect has its value in the maker's."""
    if name not in LIBRARY:
        return False
    known = in_tool_terms(name, _parameters(name), PAPER)
    return set(known) == {p.name for p in LIBRARY[name].parameters}


BOTH = [name for name in CONCEALED if _whole(name)]


def _maker(name: str | None) -> FloatArray:
    plant, sensors = CONCEALED[name].settings(_parameters(name)) if name else ({}, {})
    states = play(plant_record(PAPER, plant), U[:-1], T, substeps=20).states
    return shown(T[:-1], states, Sensors(**sensors)) if sensors else states[:, ::2]


def _ours(effects: tuple[dict[str, object], ...]) -> FloatArray:
    rig = Rig(effects=effects)
    return played(rig, T[:-1], U[:-1], np.zeros(4))[1]


@pytest.fixture(scope="module")
def bare() -> FloatArray:
    return _maker(None)


def test_without_effects_both_move_alike(bare: FloatArray):
    assert np.abs(_ours(()) - bare).max() < 1e-9


def test_most_of_the_library_is_compared():
    assert len(BOTH) >= 38


@pytest.mark.parametrize("name", BOTH)
def test_both_codes_move_alike(name: str, bare: FloatArray):
    truth = _maker(name)
    ours = _ours(({"id": name, **in_tool_terms(name, _parameters(name), PAPER)},))
    # A constant is an encoder's zero.
    gap = (ours - ours[0]) - (truth - truth[0])
    moved = (truth - truth[0]) - (bare - bare[0])
    rms = np.sqrt(np.mean(gap**2)), np.sqrt(np.mean(moved**2))
    assert rms[1] > 1e-6
    assert rms[0] < NEARLY.get(name, 0.01) * rms[1]
