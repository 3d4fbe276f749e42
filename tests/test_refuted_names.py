"""Names that the rest of the recordings speak against are given up."""

from __future__ import annotations

import math

import jsonschema

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env._documents import plain
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.schema import schema
from drill_env.effects import LIBRARY
from drill_env.report.diagnosis_page import diagnosis_page
from tests.made_recordings import made

SMALL = ("friction_step", "quadratic_drag", "unbalance", "whirl_drag")


def without(*names):
    """A small library, without some of it."""
    return DiagnosisOptions(leave_out=tuple({*LIBRARY} - {*SMALL} | {*names}))


def recorded(effect, parameters, seed):
    return made(Rig(), (Hidden(effect, parameters),), (seed,))


def test_what_held_out_recordings_contradict_is_no_name():
    """The unbalance of the held-out rig pulls the other way: nothing that was fitted holds."""
    fit = [recorded("unbalance", {"torque": 0.01, "phase": 0.7}, seed) for seed in (1, 2)]
    held = recorded("unbalance", {"torque": 0.01, "phase": 0.7 + math.pi}, 3)
    found = diagnose(fit, Rig(), [held], options=without())
    result = found.result
    assert result.verdict == "unexplained" and not result.effects and not found.rig.effects
    assert result.located is not None
    assert (result.located.component, result.located.depends_on) == ("lower", "theta_l")
    told = {rival.id: rival.probability for rival in result.alternatives}
    assert told["unbalance"] == 0.0
    before, after = (result.fit["holdout"]["log_likelihood"][k] for k in ("before", "after"))
    assert after >= before
    jsonschema.Draft202012Validator(schema()).validate(plain(result.as_dict()))
    page = diagnosis_page(found)
    assert "Rejected:" in page and "makes the" in page
    assert any("do not bear out" in line for line in result.sentences)
    assert any("unbalance was rejected" in line for line in result.sentences)
    assert not any("confused with unbalance" in line for line in result.sentences)


def test_where_the_library_lacks_the_law_the_nearest_one_is_told_with_its_place():
    """Drag that grows with the square of speed, where the library has whirl's alone."""
    drag = {"coefficient": 2e-3}
    fit = [recorded("quadratic_drag", drag, seed) for seed in (1, 2)]
    held = recorded("quadratic_drag", drag, 3)
    result = diagnose(fit, Rig(), [held], options=without("quadratic_drag")).result
    assert result.verdict in ("unexplained", "missing_physics")
    assert {effect.id for effect in result.effects} <= {"whirl_drag"}
    assert result.grades is not None
    assert (result.grades.component, result.grades.depends_on) == ("lower", "omega_l")
    named = diagnose(fit, Rig(), [held], options=without()).result
    assert [effect.id for effect in named.effects] == ["quadratic_drag"]
