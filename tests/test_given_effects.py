"""Effects that a rig file holds are known as well as its own numbers, and are fitted so."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import InputError, Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.diagnose import Diagnosis, diagnose
from drill_env.diagnosis.extended import evaluate, value_at
from drill_env.diagnosis.offered import free_parameters, offered_effects
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.identification.samples import prepare
from tests.made_recordings import made

RIG = Rig().replace(km=3.66, bu=2.03, ktheta=0.0765, Tsl=0.0096, beta1=6.5)
TORQUE, HALF_WIDTH = 0.01, 0.25
UNBALANCE = Hidden("unbalance", {"torque": TORQUE, "phase": 0.7})
# The plant counts its angle from another mark.
PHASE = -0.8707
GIVEN = {"id": "unbalance", "torque": 1.04 * TORQUE, "phase": PHASE + 0.02}
KNOWN = ("unbalance", "amplifier_deadzone", "brake_runout", "quadratic_drag")
OPTIONS = DiagnosisOptions(
    leave_out=tuple(name for name in LIBRARY if name not in KNOWN), given_rig=True
)


def told(hidden: list[Hidden], effects: tuple[dict, ...], seed: int) -> Diagnosis:
    *fit, held = [made(RIG, tuple(hidden), (seed, i)) for i in range(3)]
    found = diagnose(fit, RIG.replace(effects=effects), [held], options=OPTIONS)
    assert isinstance(found, Diagnosis)
    return found


def test_a_known_effect_a_little_off_is_no_missing_physics():
    found = told([UNBALANCE], (GIVEN,), 31)
    assert found.result.verdict == "parameters" and not found.result.effects
    change = found.result.parameters_changed["unbalance.torque"]
    assert change.before == GIVEN["torque"]
    assert change.low < TORQUE < change.high and change.high - change.low < 4e-4
    assert found.rig.effects[0]["torque"] == change.after


def test_what_is_missing_is_named_beside_what_is_known():
    hidden = [UNBALANCE, Hidden("amplifier_deadzone", {"half_width": HALF_WIDTH})]
    found = told(hidden, (GIVEN,), 32)
    assert [e.id for e in found.result.effects] == ["amplifier_deadzone"]
    width = found.result.effects[0].parameters["width"]
    assert width.low < HALF_WIDTH < width.high
    assert [e["id"] for e in found.rig.effects] == ["unbalance", "amplifier_deadzone"]


def test_what_the_file_has_is_not_offered_again():
    rig = RIG.replace(effects=(GIVEN, {"id": "string_damping", "damping": 1e-4}))
    offered = {e.id for e in offered_effects(rig, free_parameters(rig))}
    assert not offered & {"unbalance", "string_damping"} and "brake_runout" in offered


@pytest.mark.parametrize(
    "effect",
    [
        GIVEN,
        {"id": "lower_stribeck", "torque": 0.004, "velocity": 0.5},
        {"id": "string_creep", "compliance": 0.3, "time_constant": 2.0},
    ],
)
def test_slopes_by_given_numbers_are_those_of_the_likelihood(effect):
    rig = RIG.replace(effects=(effect,))
    samples = prepare(made(RIG, (UNBALANCE,), (33, 0), seconds=10.0), rig)
    setting, fit = base_fit([samples], rig, free_parameters(rig))
    for place in range(len(setting.coordinates.free), len(fit.vector)):
        along = np.eye(len(fit.vector))[place] / np.sqrt(fit.information[place, place])

        def at(steps: float, along: np.ndarray = along) -> tuple[np.ndarray, list[np.ndarray]]:
            # Along the way that the starts take, which the gradient leaves out.
            starts = zip(fit.starts, fit.start_slopes, strict=True)
            return fit.vector + steps * along, [s - steps * (k @ along) for s, k in starts]

        vector, starts = at(6.0)
        here = evaluate(setting, vector, (), fit.noise, starts, fit.motions)
        low, high = (
            value_at(setting, v, (), fit.noise, s, fit.motions) for v, s in (at(5.5), at(6.5))
        )
        # Six deviations off, half of the value rises by six for each; the gradient holds the gains.
        assert 0.5 * (high - low) == pytest.approx(6.0, rel=0.3)
        assert -here.gradient @ along == pytest.approx(0.5 * (high - low), rel=0.05)


def test_an_effect_that_is_none_is_refused():
    recording = made(RIG, (), (34, 0), seconds=6.0)
    with pytest.raises(InputError, match="rig effect 1: id is 'unknown'"):
        diagnose([recording], RIG.replace(effects=({"id": "unknown"},)))
