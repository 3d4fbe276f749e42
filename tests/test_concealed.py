"""The maker and the scorer of concealed cases: against SciPy, and on diagnoses made by hand."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.concealed import seal
from benchmarks.concealed.cases import Plan
from benchmarks.concealed.fields import PAPER, plant_record
from benchmarks.concealed.library import LEAVE_OUT, LIBRARY, Concealed
from benchmarks.concealed.limits import stored
from benchmarks.concealed.make import make_case
from benchmarks.concealed.marks import mark
from benchmarks.concealed.measures import calibration_error, measure, wilson
from benchmarks.concealed.other_laws import CONCEALABLE
from benchmarks.concealed.plant import play
from benchmarks.concealed.recordings import Hidden, Truth, make_recording
from benchmarks.concealed.run import diagnose
from benchmarks.concealed.score import score
from drill_env._errors import InputError
from drill_env.recordings import read_recording
from tests import reference

EFFECTS = CONCEALABLE
VOLTS = (3.5, -2.0, 0.05, 4.0, -4.0)


def _voltages(seconds: float) -> np.ndarray:
    return np.repeat(VOLTS, round(200 * seconds / len(VOLTS)))


def test_bare_plant_follows_scipy_through_sticking_and_reversal():
    u = _voltages(10.0)
    times = np.arange(len(u) + 1) / 200.0
    states = play(plant_record(PAPER), u, times).states
    breaks = np.linspace(0.0, 10.0, len(VOLTS) + 1)
    truth = reference.solve(reference.PAPER, breaks, np.array(VOLTS), times[:-1]).state
    assert (states[:, 3] == 0.0).sum() > 10
    assert np.abs(states[:, 2] - truth[:, 3]).max() < 1e-8
    assert np.abs(states[:, 0] - truth[:, 0] - truth[:, 3]).max() < 1e-8


def _angles(effect: Concealed | None, size: float, seconds: float, counts: int) -> np.ndarray:
    hidden = ()
    if effect is not None:
        hidden = (Hidden(effect.id, effect.parameters(size, effect.middle())),)
    truth = Truth(PAPER, hidden, counts=counts, pretwist=0.0, jitter=0.0)
    return make_recording(truth, _voltages(seconds), (3,)).angles


@pytest.fixture(scope="module")
def bare() -> dict[float, np.ndarray]:
    return {seconds: _angles(None, 0.0, seconds, 2**24) for seconds in (5.0, 10.0, 30.0)}


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=lambda e: e.id)
def test_effect_vanishes_with_its_size_and_shows_at_its_largest(effect: Concealed, bare):
    assert np.array_equal(_angles(effect, 0.0, 5.0, 2**24), bare[5.0])
    seconds = 30.0 if "time" in effect.shape else 10.0
    moved = np.abs(_angles(effect, effect.largest, seconds, 2**24) - bare[seconds])
    assert moved.max() > 4 * 2 * math.pi / 8192
    # Counts are lost and samples repeated at random moments: these do not shrink evenly.
    if effect.id not in ("missed_counts_upper", "missed_counts_lower", "missing_samples"):
        small = 1e-2 * (effect.least or 0.1 * stored()[effect.id]["size"])
        assert np.abs(_angles(effect, small, 5.0, 2**24) - bare[5.0]).max() < 2e-3


def test_limits_cover_every_effect_and_leave_out_only_known_ones():
    assert set(stored()) == set(EFFECTS)
    assert set(LEAVE_OUT) <= set(LIBRARY)
    for name, limit in stored().items():
        assert EFFECTS[name].least <= limit["size"] <= EFFECTS[name].largest


def test_a_case_is_readable_repeatable_and_tells_only_what_it_may(tmp_path: Path):
    for name in ("a", "b"):
        make_case(1, Plan("out", 0), tmp_path / name, tmp_path / f"{name}.json")
    first = sorted((tmp_path / "a").iterdir())
    assert [p.name for p in first] == ["case.json", *(f"fit-{i}.csv" for i in range(1, 5)),
                                       "holdout-1.csv", "holdout-2.csv"]  # fmt: skip
    for path in first:
        assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes()
    answer = json.loads((tmp_path / "a.json").read_text())
    assert set(json.loads(first[0].read_text())) == {"leave_out"}
    assert not set(answer["families"]["fit"]) & set(answer["families"]["holdout"])
    recording = read_recording(first[1])
    assert len(recording.t) == 12000
    assert recording.quanta["theta_l"] == pytest.approx(2 * math.pi / 8192, rel=1e-3)


def test_the_process_gets_copies_of_its_recordings_and_no_more(tmp_path: Path):
    case = tmp_path / "cases" / "case-001"
    case.mkdir(parents=True)
    (case / "fit-1.csv").write_text("t\n")
    (case / "holdout-1.csv").write_text("t\n")
    (case / "case.json").write_text('{"leave_out": "wear"}')
    out = tmp_path / "reports" / "case-001"
    out.mkdir(parents=True)
    script = "import json, sys; print(json.dumps(sys.argv[1:])); sys.exit(3)"
    record = diagnose((sys.executable, "-c", script), case, out, 60.0)
    told = json.loads(record["output_tail"])
    assert record["exit_status"] == 3 and record["cpu_s"] > 0
    assert [Path(p).name for p in told[:3:2]] == ["fit-1.csv", "holdout-1.csv"]
    assert told[3:] == ["--leave-out", "wear", "--out", str(out)]
    assert str(case.parent) not in record["output_tail"].replace(str(out), "")


def _answer(kind: str, *effects: str, **more: Any) -> dict[str, Any]:
    told = [{"id": n, "component": EFFECTS[n].component,
             "parameters": {"torque": 1.0, "phase": 6.0}, "ratio": 5.0,
             "depends_on": list(EFFECTS[n].depends_on),
             "asked_ratio": 5.0, "identifiable": True} for n in effects]  # fmt: skip
    oracle = {f"holdout-{i}": {"theta_u": 0.1, "theta_l": 0.2} for i in (1, 2)}
    return {"kind": kind, "nasty": False, "effects": told, "oracle_five_second_rms": oracle,
            "rig": PAPER, "counts": 8192, **more}  # fmt: skip


def _diagnosis(verdict: str, *effects: dict[str, Any], **more: Any) -> dict[str, Any]:
    return {"schema": 1, "verdict": verdict, "effects": list(effects), "alternatives": [], **more}


UNBALANCE = {
    "id": "unbalance", "probability": 0.9, "alias_class": [],
    "parameters": {"torque": {"value": 1.1, "low": 0.9, "high": 1.3},
                   "phase": {"value": -1.8, "low": -1.9, "high": -1.7}},
}  # fmt: skip


def test_marks_follow_names_aliases_places_and_intervals():
    five = {"theta_u": {"before_rms": 0.1, "after_rms": 0.1},
            "theta_l": {"before_rms": 0.6, "after_rms": 0.3}}  # fmt: skip
    right = mark(_answer("single", "unbalance"), _diagnosis(
        "missing_physics", UNBALANCE, located={"component": "lower"},
        fit={"five_second_prediction": five}))  # fmt: skip
    assert right["first"] and right["three"] and right["component"] and right["surplus"] == 0
    assert right["gap_closed"] == pytest.approx(0.75)
    # The true phase, a sine's, is a turn away from the interval, a cosine's.
    assert [c["inside"] for c in right["covered"]] == [True, True]
    near = mark(_answer("single", "unbalance"), _diagnosis(
        "missing_physics", UNBALANCE, fit={"five_second_prediction": five}),
        {"theta_u": 0.05, "theta_l": 0.25})  # fmt: skip
    # The refitted oracle does better where the tool does nothing, and worse where it does much.
    assert near["gap_closed"] == pytest.approx(0.5 * 0.3 / 0.35)
    assert near["gap_closed_true_plant"] == pytest.approx(0.75) and near["refitted"]
    alias = {**UNBALANCE, "id": "lower_disturbance", "alias_class": ["unbalance"]}
    assert mark(_answer("single", "unbalance"), _diagnosis("missing_physics", alias))["first"]
    late = _diagnosis(
        "missing_physics", {**UNBALANCE, "id": "rate_state"}, alternatives=[UNBALANCE]
    )
    found = mark(_answer("single", "unbalance"), late)
    assert not found["first"] and found["three"] and found["surplus"] == 1
    both = mark(
        _answer("pair", "unbalance", "rate_state"), _diagnosis("missing_physics", UNBALANCE)
    )
    assert both["one"] and not both["both"]
    shape = {"coordinate": "theta_l", "formula": "sin"}
    out = mark(_answer("out", "unbalance"), _diagnosis("unexplained", shape=shape))
    assert out["says_unexplained"] and out["coordinate"] and out["alarm"]


def test_what_is_left_over_is_told_of_right_answers_and_of_quiet_nulls():
    left = {"upper": {"rms_Nm": 1.0, "predictable": -0.1}, "lower": {"rms_Nm": 1.0}}
    rows = []
    for kind, verdict, share in (("null", "consistent", 0.04), ("null", "unexplained", 0.9)):
        left["lower"]["predictable"] = share
        rows.append(mark(_answer(kind), _diagnosis(verdict, fit={"residual_torque": left})))
    rows.append(mark(_answer("null"), _diagnosis("consistent")))
    found = measure([{**row, "cpu_s": None, "wall_s": None} for row in rows])
    quiet = found["predictable of what is left, nothing missing and told so"]
    assert (quiet["n"], quiet["largest"]) == (1, 0.04)
    assert found["predictable of what is left, named first"]["n"] == 0


def test_no_diagnosis_is_wrong_everywhere():
    pair = ["rate_state", "unbalance"]
    for kind, effects in (("single", pair[:1]), ("null", []), ("pair", pair)):
        row = {**mark(_answer(kind, *effects), None), "cpu_s": None, "wall_s": None}
        found = measure([row])
        assert found["named first, 5 x and more"]["hits"] == 0
        assert found["false alarms on nulls"]["hits"] == (kind == "null")
        assert found["pairs: at least one"]["hits"] == 0


def test_interval_of_a_share_solves_wilsons_equation():
    low, high = wilson(39, 44)
    for p in (low, high):
        assert (39 / 44 - p) ** 2 == pytest.approx(1.959964**2 * p * (1 - p) / 44)
    assert wilson(0, 10)[0] == 0.0 and 0 < wilson(0, 10)[1] < 0.5


def test_a_calibrated_forecaster_errs_as_much_as_its_few_claims_let_it():
    """Above one time in twenty, whether it claims the same or not."""
    rng = np.random.default_rng(4)
    above = []
    for _ in range(300):
        claims = rng.choice([0.96, 0.96, 0.96, 0.75, 0.5, 0.3], 60)
        right = rng.random(60) < claims
        rows = [{"probability": p, "first": bool(r)} for p, r in zip(claims, right, strict=True)]
        found = calibration_error(rows)
        above.append(found["error"] > found["if_calibrated_95"])
    assert 0.02 < np.mean(above) < 0.09


def test_calibration_error_of_a_forecaster_that_is_always_too_sure():
    rows = [{"probability": 0.95, "first": i % 4 < 3} for i in range(80)]
    rows += [{"probability": None, "first": False}]
    found = calibration_error(rows)
    assert found["error"] == pytest.approx(0.2)
    assert found["if_calibrated"] < found["if_calibrated_95"] < 0.1


def test_score_needs_the_answers_that_were_sealed(tmp_path: Path):
    answers, reports = tmp_path / "answers", tmp_path / "reports"
    answers.mkdir()
    for number, kind in (("001", "single"), ("002", "null")):
        effects = ["unbalance"] if kind == "single" else []
        document = {"case": f"case-{number}", **_answer(kind, *effects)}
        (answers / f"{number}.json").write_text(json.dumps(document))
    published = seal.write_seal(answers, "by hand")
    (reports / "case-001").mkdir(parents=True)
    text = json.dumps(_diagnosis("missing_physics", UNBALANCE))
    (reports / "case-001" / "diagnosis.json").write_text(text)
    found = score(reports, answers, published)
    assert found["measures"]["named first, 5 x and more"]["hits"] == 1
    assert set(found["faults"]) == {"case-002"}
    with pytest.raises(InputError, match="published"):
        score(reports, answers, "0" * 64)
    changed = (answers / "002.json").read_text().replace("false", "true")
    (answers / "002.json").write_text(changed)
    with pytest.raises(InputError, match=r"002\.json was changed"):
        score(reports, answers, published)
    (answers / "002.json").unlink()
    with pytest.raises(InputError, match=r"002\.json was added or removed"):
        score(reports, answers, published)
