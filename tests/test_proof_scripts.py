"""The further scripts of the proof: discovery, ambiguity and PySINDy beside ours."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from benchmarks.concealed import ambiguity, discovery, discrepancy, oracle, smoothed
from benchmarks.concealed.cases import KINDS, Plan, draw
from benchmarks.concealed.fields import PAPER, plant_record
from benchmarks.concealed.library import LIBRARY
from benchmarks.concealed.limits import stored
from benchmarks.concealed.make import write_recording
from benchmarks.concealed.plant import play
from benchmarks.concealed.recordings import Hidden, Truth, make_recording
from benchmarks.concealed.signals import signal
from drill_env.diagnosis.declare import extended_rig
from drill_env.identification.coordinates import Coordinates
from drill_env.parameters import Rig
from drill_env.recordings import Recording, read_recording
from tests.made_recordings import played


@pytest.mark.parametrize("kind", KINDS)
def test_the_concealed_rig_of_an_answer_is_the_one_that_was_played(kind: str):
    name = "string_knee" if kind == "differ" else "string_creep"
    case = draw(5, Plan(kind, 3, (name,), (5.0,)))
    assert ambiguity.truth_of(json.loads(json.dumps(case.answer))) == case.truth


def test_the_recording_asked_for_is_played_on_the_concealed_rig(tmp_path: Path):
    answer = draw(5, Plan("single", 0, ("actuator_lag",), (5.0,))).answer
    (tmp_path / "fit-1.csv").write_text("")
    command = (
        "drill-env signal harmonic --seconds 4 --rate 200 --offset 0 --amplitude 3 --out p.csv"
    )
    ambiguity.add_recording(answer, command, tmp_path)
    made = read_recording(tmp_path / "fit-2.csv")
    assert not (tmp_path / "p.csv").exists()
    assert np.abs(made.u - 3.0 * np.sin(0.4 * np.pi * made.t)).max() < 1e-5
    # A lag of the voltage shows as its own time late in the upper disc once it turns steadily.
    bare = ambiguity.truth_of({**answer, "effects": []})
    early = make_recording(bare, np.round(made.u, 5), (*answer["seed"], 3)).angles[300:600, 0]
    speed = np.gradient(early, made.t[300:600])
    delay = float(speed @ (early - made.theta_u[300:600]) / (speed @ speed))
    assert delay == pytest.approx(answer["effects"][0]["parameters"]["tau"], rel=0.5)


def _diagnosis(first: str, probability: float, rivals: dict[str, tuple[float, float]], **more: Any):
    others = [{"id": n, "probability": p, "delta_bic": d} for n, (p, d) in rivals.items()]
    return {
        "verdict": "missing_physics", "effects": [{"id": first, "probability": probability}],
        "alternatives": others, "shape": None,
        "next_experiment": {"signal": "a chirp", "separates": ["a", "b"],
                            "expected_log_odds": 30.0}, **more,
    }  # fmt: skip


def test_an_ambiguity_is_settled_by_the_truth_alone():
    answer = {"case": "case-001", "effects": [{"id": "b"}]}
    before = _diagnosis("a", 0.7, {"b": (0.29, 20.0), "c": (0.01, 90.0)})
    right = _diagnosis("b", 0.97, {"a": (0.03, 60.0)})
    wrong = _diagnosis("a", 0.99, {"b": (0.01, 300.0)})
    assert ambiguity.ambiguous(before, "b")
    assert not ambiguity.ambiguous(before, "unheard of")
    assert not ambiguity.ambiguous({**before, "next_experiment": None}, "b")
    assert not ambiguity.ambiguous(right, "b")
    found = ambiguity.judged(answer, before, right)
    assert found["settled"] and found["before"]["rival"] == "a"
    # From 10 behind to 30 ahead, in natural logarithms.
    assert found["moved_log_odds"] == pytest.approx(40.0)
    assert found["beaten"] and found["asked"]
    found = ambiguity.judged(answer, before, wrong)
    assert not found["settled"] and not found["beaten"]
    # A newcomer leaves the old rival beaten and the matter open.
    newcomer = ambiguity.judged(answer, before, _diagnosis("b", 0.7, {"c": (0.3, 10.0)}))
    assert newcomer["beaten"] and not newcomer["settled"]


def test_a_free_shape_in_the_lead_is_the_rival():
    shaped = _diagnosis("", 0.0, {"b": (0.2, 16.0)}, effects=[])
    shaped |= {"verdict": "unexplained", "shape": {"coordinate": "omega_l"}}
    seen = ambiguity.look(shaped, "b")
    assert (seen["first"], seen["rival"]) == ("unexplained", "a")
    assert seen["rival_probability"] == pytest.approx(0.8)
    assert seen["log_odds"] == pytest.approx(-8.0)


def test_signs_of_the_slope_are_those_of_equation_7():
    found = discovery.signs(Rig.paper())
    p = PAPER

    def slope(v: float) -> float:
        first = 0.5 * p["T1"] * p["beta1"] / math.cosh(0.5 * p["beta1"] * v) ** 2
        return first + 0.5 * p["T2"] * p["beta2"] / math.cosh(0.5 * p["beta2"] * v) ** 2 + p["bl"]

    assert found["signs"] == "+-+"
    assert [slope(v) for v in found["speeds"]] == pytest.approx([0.0, 0.0], abs=1e-4)
    assert discovery.signs(Rig.paper().replace(friction="coulomb"))["signs"] == "+"


def test_interval_of_the_hopf_point_is_that_of_its_gradient():
    rig = Rig.paper()
    coordinates = Coordinates(rig, ("km",))
    # At a Hopf point km u alone is told by the rest of the rig: u follows 1 / km.
    rigs = discovery.cloud(coordinates, coordinates.vector(rig), np.array([[1e-6]]), 0)
    found = discovery.interval(rigs)
    middle = discovery.hopf_b(rig)
    assert middle is not None and found["with_b"] == found["humped"] == discovery.DRAWS
    assert (found["high"] - found["low"]) / (2 * 1.96e-3 * middle) == pytest.approx(1.0, abs=0.15)


def test_both_simulators_vibrate_without_sticking(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(discovery, "_SETTLE", 100.0)
    answer = {"effects": [], "unlisted": {"id": "gear_bad_tooth", "parameters": {}}, "rig": PAPER,
              "torque_noise_Nm": [0.0, 0.0], "counts": 8192, "lost_row_bursts": 0}  # fmt: skip
    free = discovery.shaken(answer, Rig.paper(), 1.1)
    assert free["true_stick_free"] and free["found_stick_free"]
    for name in ("least", "largest", "period"):
        assert free["found"][name] == pytest.approx(free["true"][name], abs=2e-3)
    steady = discovery.shaken(answer, Rig.paper(), 0.4)
    assert not steady["true_stick_free"] and not steady["found_stick_free"]


@pytest.fixture(scope="module")
def unbalanced(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two cases: one with a large unbalance, one without."""
    found = tmp_path_factory.mktemp("cases")
    hidden = Hidden("unbalance", {"torque": 20 * stored()["unbalance"]["size"], "phase": 0.7})
    for folder, effects in (("with", (hidden,)), ("without", ())):
        (found / folder).mkdir()
        for i, stem in enumerate(("fit-1", "fit-2", "holdout-1")):
            u = signal("random steps", np.random.default_rng(i), plant_record(PAPER))
            made = make_recording(Truth(PAPER, effects), u, (3, i))
            write_recording(found / folder / f"{stem}.csv", made)
    return found


def test_pysindy_finds_a_large_unbalance_and_nothing_in_nothing(unbalanced: Path):
    sindy = pytest.importorskip("benchmarks.concealed.sindy", reason="of the bench extra")
    rig = Rig.paper()
    assert list(sindy.sparse(unbalanced / "with", rig, True, 0.5, 1.03)) == ["unbalance"]
    assert not sindy.sparse(unbalanced / "without", rig, True, 0.5, 1.03)


def test_a_process_finds_where_an_unbalance_is_and_nothing_in_nothing(
    unbalanced: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(discrepancy, "_KERNEL_ROWS", 150)
    monkeypatch.setattr(discrepancy, "_ROWS", 400)
    found = discrepancy.told(unbalanced / "with", 0.5)
    assert (found["component"], found["coordinate"]) == ("lower", "theta_l")
    assert discrepancy.told(unbalanced / "without", 0.5)["component"] is None


def test_voltages_are_felt_as_the_smoothed_angle_s_second_derivative_feels_them():
    """Steps of acceleration: the angle is exact, and so must be the weights."""
    step = 0.005
    push = np.repeat(np.random.default_rng(0).normal(size=20), 100)
    speed = np.append(0.0, np.cumsum(push * step))
    angle = np.append(0.0, np.cumsum((speed[:-1] + 0.5 * push * step) * step))[:-1]
    at = np.arange(len(push)) * step
    # The mean keeps both discs from rest.
    x = smoothed.motion(Recording(at, push, angle + 9.0 * at, angle + 9.0 * at), 0.5)
    assert len(x["t"]) > 100
    assert np.abs(x["u_felt"] - x["alpha_u"]).max() < 1e-5
    assert np.abs(x["u"] - x["alpha_u"]).max() > 0.05


def test_a_process_takes_up_what_the_terms_cannot():
    rng = np.random.default_rng(0)
    noise, parts = 0.05, []
    for n in (400, 200):
        x, term = rng.uniform(-2.0, 2.0, n), rng.normal(size=n)
        # A line in the coordinate would be the term's as well: the wave is not.
        y = 3.0 * term + 0.4 * x + np.sin(4.0 * x) + 7.0 + rng.normal(0.0, noise, n)
        inputs = {"twist": x[:, None], "time": rng.uniform(size=(n, 1))}
        block = np.arange(n) // 20
        parts.append(discrepancy.Equation(y, term[:, None], inputs, np.zeros(n, int), block))
    with threadpool_limits(1):
        bare = discrepancy.left_over(*parts, None)
        left = {name: discrepancy.left_over(*parts, name) for name in ("twist", "time")}
    assert np.std(bare) > 0.7 and np.std(left["twist"]) == pytest.approx(noise, rel=0.15)
    size, z = discrepancy.gain(bare, left["twist"], parts[1].block)
    assert size > 3.0 and z > 10.0
    assert discrepancy.gain(bare, left["time"], parts[1].block)[1] < 3.0


def test_what_a_process_says_is_held_against_the_answer(tmp_path: Path):
    one = draw(5, Plan("single", 0, ("unbalance",), (5.0,))).answer
    none = draw(5, Plan("null", 0)).answer
    silent = {"component": None, "coordinate": None, "gains": {}}
    said = {"component": "lower", "coordinate": "theta_l", "gains": {"l theta_l": 0.3}}
    rows = [discrepancy.beside({"case": "case-001", **a}, found, tmp_path / "no.json")
            for a in (one, none) for found in (silent, said)]  # fmt: skip
    for key in ("component_right", "coordinate_right"):
        assert [r[key] for r in rows] == [False, True, True, False]
    assert "| single | 1/2 | 1/2 |  |  |" in discrepancy.table(rows)
    assert "| null | 1/2 | 1/2 |  |  |" in discrepancy.table(rows)


HEAVY = {**PAPER, "Ju": 1.3 * PAPER["Ju"], "ktheta": 0.09, "bu": 2.2}


def _told(name: str, times: float) -> dict[str, Any]:
    effect = LIBRARY[name]
    return {"id": name, "identifiable": True,
            "parameters": effect.parameters(times * effect.guess, effect.middle())}  # fmt: skip


@pytest.mark.parametrize(
    "name", ["unbalance", "string_hardening", "upper_disturbance", "motor_heating", "torque_pulse"]
)
def test_the_true_structure_at_the_held_scale_moves_as_the_concealed_rig(name: str):
    told = _told(name, 5.0)
    told["parameters"] |= {"time": 4.0} if "time" in told["parameters"] else {}
    plant, _ = LIBRARY[name].settings(told["parameters"])
    u = np.repeat([3.5, -2.0, 4.0], 600)
    times = np.arange(len(u) + 1) / 200.0
    truth = play(plant_record(HEAVY, plant), u, times).states
    rig, scale = oracle.true_rig(HEAVY, Rig.paper())
    term = oracle.true_term(told, HEAVY, scale)
    assert term is not None and rig.Ju == Rig.paper().Ju
    _, angles = played(extended_rig(rig, [term]), times[:-1], u, np.zeros(4))
    bare = play(plant_record(HEAVY), u, times).states
    moved = np.abs(truth[:, ::2] - bare[:, ::2]).max()
    assert np.abs(angles - truth[:, ::2]).max() < 0.01 * moved


def test_the_refitted_oracle_comes_as_near_as_the_true_plant(tmp_path: Path):
    told = _told("actuator_lag", 2.0)
    # At the scale that is held: what is left of the rig may be off by as much as drilled rigs are.
    rig = {**PAPER, "bu": 2.05, "ktheta": 0.08}
    hidden = (Hidden(told["id"], told["parameters"]),)
    case, made = tmp_path / "case-001", {}
    case.mkdir()
    for i, stem in enumerate(("fit-1", "fit-2", "holdout-1")):
        u = signal("random steps", np.random.default_rng(i), plant_record(rig))[:4000]
        made = make_recording(Truth(rig, hidden), u, (3, i), oracle=True)
        write_recording(case / f"{stem}.csv", made)
    answer = {"case": "case-001", "kind": "single", "effects": [told], "rig": rig}
    assert oracle.has_oracle(answer)
    assert not oracle.has_oracle({**answer, "effects": [_told("missing_samples", 1.0)]})
    assert oracle.one(tmp_path, tmp_path, answer) == ("case-001", None)
    path = tmp_path / "case-001.json"
    found = json.loads(path.read_text())
    for channel, least in made.oracle.items():
        before = found["base_five_second_rms"][channel]
        assert before - found["five_second_rms"][channel] > 0.9 * (before - least)
    lag = found["parameters"]["actuator_lag"]["time_constant"]
    assert lag == pytest.approx(told["parameters"]["tau"], rel=0.03)
    path.write_text("{}")
    oracle.one(tmp_path, tmp_path, answer)
    assert path.read_text() == "{}"
