"""Something struck a disc at one moment, in one recording or at the same time in all."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env.diagnosis.declare import declaration
from drill_env.diagnosis.diagnose import Diagnosis, diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.strikes import Strike
from drill_env.effects import LIBRARY
from drill_env.integrator import sampled_voltage, simulate
from drill_env.report.diagnosis_page import diagnosis_page
from tests.made_recordings import made

FEW = {"torque_pulse", "friction_step", "lower_disturbance", "unbalance", "lower_stribeck"}
FIRST = {"torque": 0.02, "time": 12.3, "width": 0.4}
SECOND = {"torque": -0.015, "time": 20.0, "width": 0.3}


def struck(*pulses: dict[str, float] | None, kept: set[str], most: int = 2) -> Diagnosis:
    """The diagnosis of recordings that were struck, or not, the last one held out."""
    recordings = [
        made(Rig(), () if p is None else (Hidden("torque_pulse", p),), (21, i), volts=4.0)
        for i, p in enumerate(pulses)
    ]
    options = DiagnosisOptions(leave_out=tuple(sorted(set(LIBRARY) - kept)), most=most)
    return diagnose(recordings[:-1], Rig(), recordings[-1:], options=options)


def test_a_strike_of_each_recording_is_named_and_told_where():
    """Before, a torque at the same time in all recordings was all there was: nothing was found."""
    found = struck(FIRST, SECOND, None, kept=FEW)
    result = found.result
    assert [e.id for e in result.effects] == ["torque_pulse"] * 2
    for effect, truth in zip(result.effects, (FIRST, SECOND), strict=True):
        for name, value in zip(("torque", "time", "duration"), truth.values(), strict=True):
            number = effect.parameters[name]
            assert number.low < value < number.high
            assert number.high - number.low < 0.25 * abs(value)
    assert result.effects[0].meaning.endswith("in made-0.")
    assert result.effects[1].meaning.endswith("in made-1.")
    assert "Physics is missing from the model: torque_pulse." in result.sentences
    # What happened once is no part of the rig.
    assert found.rig.effects == ()
    assert "made-1" in diagnosis_page(found)


def test_a_strike_without_a_name_is_told_by_its_shape():
    """At the same time in all recordings, so it belongs to the rig and to held-out ones too."""
    found = struck(FIRST, FIRST, FIRST, kept=FEW - {"torque_pulse"}, most=1)
    result = found.result
    assert result.verdict == "unexplained" and result.shape is not None
    assert result.located is not None
    assert (result.located.component, result.located.depends_on) == ("lower", "time")
    ((begin, end),) = result.located.intervals_s
    assert abs(begin - 12.3) < 0.1 and abs(end - 12.7) < 0.1
    way = np.trapezoid(result.shape.values, result.shape.knots)
    assert way == pytest.approx(FIRST["torque"] * FIRST["width"], rel=0.1)
    errors = result.fit["five_second_prediction"]["theta_l"]
    assert errors["after_rms"] < 0.7 * errors["before_rms"]
    # The rig that it writes runs with it, as with the effect that the library calls so.
    named = {"id": "torque_pulse", "torque": 0.02, "time": 12.3, "duration": 0.4}
    drive = sampled_voltage(np.array([0.0, 20.0]), np.array([4.0, 4.0]))
    ends = [
        simulate(found.rig.replace(effects=effects), drive, 13.0).state[-1]
        for effects in (found.rig.effects, (named,), ())
    ]
    assert np.abs(ends[0] - ends[1]).max() < 0.2 * np.abs(ends[2] - ends[1]).max()


def test_a_table_of_a_strike_is_the_strike():
    """Straight between its knots and nothing beyond them, by numpy's own interpolation."""
    found = struck(FIRST, None, None, kept=FEW - {"torque_pulse"}, most=1).found
    (term,) = found.final.terms
    assert isinstance(term.source, Strike)
    table = declaration(term)
    struck_one, other = found.final.motions
    torque = term.source.response(term.q, found.final.rig, struck_one)[0]
    middles = 0.5 * (struck_one.t[:-1] + struck_one.t[1:])
    expected = np.interp(middles, table["knots"], table["values"])
    np.testing.assert_allclose(torque[:-1, 1], expected, atol=1e-12)
    assert np.abs(torque[:, 1]).max() > 0.015 and not torque[:, 0].any()
    assert not np.any(term.source.response(term.q, found.final.rig, other)[0])
