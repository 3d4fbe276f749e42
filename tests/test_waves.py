"""Waves and friction that no name of the library stands for, in recordings of another plant."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env.diagnosis.declare import declaration
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.shapes import free_shapes
from drill_env.diagnosis.terms import Term
from drill_env.diagnosis.waves import free_waves
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion, responses_along
from drill_env.effects.declared import bundled
from drill_env.report.diagnosis_page import diagnosis_page
from tests.made_recordings import made, played

RIG = Rig().replace(km=3.66, bu=2.03, ktheta=0.0765, Tsl=0.0096, beta1=6.5)
KEPT = {"friction_warmup", "quadratic_drag", "string_damping"}


def without_a_name(hidden, seed):
    """The diagnosis of two recordings, a third one held out, by a library of few names."""
    *fit, held = [made(RIG, (hidden,), (seed, i)) for i in range(3)]
    options = DiagnosisOptions(leave_out=tuple(sorted(set(LIBRARY) - KEPT)), most=1)
    return diagnose(fit, Rig(), [held], options=options)


@pytest.mark.parametrize(
    ("hidden", "place", "cycles"),
    [
        (Hidden("torque_ripple", {"amplitude": 0.06, "order": 7.43, "phase": 0.3}),
         ("upper", "theta_u"), "angle_order"),
        (Hidden("upper_disturbance", {"amplitude": 0.05, "frequency": 1.31, "phase": 2.0}),
         ("upper", "time"), "frequency_hz"),
        (Hidden("lower_disturbance", {"amplitude": 0.001, "frequency": 0.47, "phase": 4.0}),
         ("lower", "time"), "frequency_hz"),
    ],
)  # fmt: skip
def test_a_wave_without_a_name_is_told_by_its_frequency(hidden, place, cycles):
    found = without_a_name(hidden, 7)
    result = found.result
    assert result.verdict == "unexplained" and result.located is not None
    assert (result.located.component, result.located.depends_on) == place
    true = hidden.parameters["order" if cycles == "angle_order" else "frequency"]
    assert getattr(result.located, cycles) == pytest.approx(true, abs=0.005)
    assert result.shape is not None and f"{true:.2f}" in result.shape.formula
    assert any("It repeats" in line and f"{true:.2f}" in line for line in result.sentences)
    size = max(result.shape.values)
    assert size == pytest.approx(hidden.parameters["amplitude"], rel=0.1)
    assert [entry["id"] for entry in found.rig.effects] == ["table"]
    page = diagnosis_page(found)
    assert f"a torque that depends on {place[1]}" in page and f"{true:.2f}" in page
    for errors in result.fit["five_second_prediction"].values():
        assert errors["after_rms"] < 2.0 * errors["floor_rms"]


def test_friction_of_the_upper_disc_over_twist_is_told_without_a_name():
    found = without_a_name(Hidden("load_dependent_friction", {"coefficient": 0.4}), 8)
    result = found.result
    assert result.verdict == "unexplained" and result.located is not None
    assert (result.located.component, result.located.depends_on) == ("upper", "twist")
    assert result.shape is not None and "|twist|" in result.shape.formula
    x, y = np.array(result.shape.knots), np.array(result.shape.values)
    slope = np.polyfit(np.abs(x), y, 1)[0]
    assert slope == pytest.approx(0.4 * RIG.ktheta, rel=0.15)


def test_the_library_comes_before_waves_of_its_formulas():
    own = ["lower_wave_of_theta_l", "string_wave_of_theta_u", "string_wave_of_theta_l"]
    assert [w.id for w in free_waves(LIBRARY)] == own
    fewer = set(LIBRARY) - {"torque_ripple", "lower_disturbance"}
    assert {"upper_wave_of_theta_u", "lower_wave_of_time"} < {w.id for w in free_waves(fewer)}


def test_under_a_prescribed_upper_motion_each_torque_is_tried_once():
    """The upper disc feels nothing then: two waves over one angle would be the same torque."""
    there = free_waves((), moved=True)
    felt = [(wave.effect.depends_on, wave.signs[1]) for wave in there]
    assert all(lower != 0.0 for _, lower in felt)
    assert len(set(felt)) == len(felt)
    assert {name for name, _ in felt} == {wave.effect.depends_on for wave in free_waves(())}


NAMES = {
    "upper_wave_of_time": "upper_disturbance",
    "lower_wave_of_time": "lower_disturbance",
    "upper_wave_of_theta_u": "torque_ripple",
}


@pytest.mark.parametrize("name", NAMES)
def test_a_wave_acts_and_runs_as_the_effect_of_its_formula(name):
    wave = next(w for w in free_waves(()) if w.id == name)
    q = np.array([0.05, 1.0, 3.7])
    t = np.arange(2001) * 0.005
    u = 4.0 + np.sin(t)
    entry = dict(zip([p.name for p in wave.effect.parameters], q.tolist(), strict=True))
    named = Rig().replace(effects=({"id": NAMES[name], **entry},))
    free = Rig().replace(effects=(declaration(Term(wave, q)),))
    plain, truth, ours = (played(r, t, u, np.zeros(4))[1] for r in (Rig(), named, free))
    moved = np.abs(truth - plain).max()
    assert np.abs(ours - truth).max() < 5e-3 * moved
    states = np.hstack([np.cumsum(np.ones((len(t), 4)), axis=0) * 0.01, np.zeros((len(t), 2))])
    motion = Motion(t, u, states, np.array([0]))
    # The last row is held for no time.
    told = wave.response(q, Rig(), motion)[0][:-1]
    np.testing.assert_allclose(
        told,
        responses_along(bundled([(LIBRARY[NAMES[name]], q)]), Rig(), motion)[0][:-1],
        atol=1e-12,
    )


def test_a_wave_of_the_string_acts_on_both_discs_against_each_other():
    wave = next(w for w in free_waves(()) if w.id == "string_wave_of_theta_u")
    q = np.array([0.004, 1.0, 2.0])
    string = declaration(Term(wave, q))
    upper = {**string, "component": "upper", "values": (-np.array(string["values"])).tolist()}
    lower = {**string, "component": "lower"}
    t = np.arange(2001) * 0.005
    u = 4.0 + np.sin(t)
    plain, one, two = (
        played(Rig().replace(effects=e), t, u, np.zeros(4))[1]
        for e in ((), (string,), (upper, lower))
    )
    assert np.abs(one - two).max() < 1e-6 < 0.01 * np.abs(one - plain).max()
    states = np.hstack([np.cumsum(np.ones((len(t), 4)), axis=0) * 0.01, np.zeros((len(t), 2))])
    told = wave.response(q, Rig(), Motion(t, u, states, np.array([0])))[0]
    np.testing.assert_array_equal(told[:, 0], -told[:, 1])


def test_friction_over_twist_runs_as_the_effect_of_its_formula():
    t = np.arange(2001) * 0.005
    u = 4.0 * np.sin(2.0 * t)
    states = np.column_stack([np.linspace(-8.0, 8.0, len(t)), np.zeros((len(t), 5))])
    shapes = free_shapes([Motion(t, u, states, np.array([0]))])
    shape = next(s for s in shapes if s.id == "upper_friction_of_twist")
    rig = Rig()
    table = declaration(Term(shape, 0.3 * rig.ktheta * np.abs(np.array(shape.knots))))
    load = {"id": "load_dependent_friction", "coefficient": 0.3}
    plain, truth, ours = (
        played(r, t, u, np.zeros(4))[1]
        for r in (rig, rig.replace(effects=(load,)), rig.replace(effects=(table,)))
    )
    assert np.abs(ours - truth).max() < 0.02 * np.abs(truth - plain).max()
