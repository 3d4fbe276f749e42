"""Holes in recordings, options that take things away, and what may be said of rivals."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import jsonschema
import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

from benchmarks.concealed.recordings import Truth, make_recording
from benchmarks.rig_maker import quasi_random
from drill_env import InputError, Rig
from drill_env._documents import plain
from drill_env.cli.main import app
from drill_env.diagnosis.attempts import restated
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.declare import extended_rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.held_out import judge
from drill_env.diagnosis.locate import label_of, locate
from drill_env.diagnosis.next_experiment import _confused
from drill_env.diagnosis.noise_floor import errors_by_noise, noise_floor
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.options import OUTSIDE, DiagnosisOptions
from drill_env.diagnosis.probability import rivals
from drill_env.diagnosis.result import digits_of
from drill_env.diagnosis.rounds import Attempt, Found, Round
from drill_env.diagnosis.schema import schema
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.identification.initial_state import state_at
from drill_env.identification.samples import prepare
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording
from tests.made_recordings import played

STEP = 2.0 * math.pi / 8192
BARE = DiagnosisOptions(leave_out=(*LIBRARY, *OUTSIDE), most=0)
PLAIN = Truth({name: getattr(Rig(), name) for name in SYMBOLS}, ())


def recorded(seed: int, seconds: float = 15.0, truth: Truth = PLAIN, volts: float = 5.0):
    u = quasi_random(np.random.default_rng([seed]), seconds, 200.0, volts)
    made = make_recording(truth, u, (seed,))
    return Recording(
        made.t, made.u, made.angles[:, 0], made.angles[:, 1],
        quanta={"theta_u": STEP, "theta_l": STEP}, source=f"made-{seed}.csv",
    )  # fmt: skip


def rows(recording: Recording, kept: Any) -> Recording:
    channels = {n: v[kept] for n, v in recording.channels().items()}
    return replace(recording, **channels)


def attempts(*criteria: tuple[str, float]) -> tuple[Attempt, ...]:
    return tuple(
        Attempt(None, Term(Named(LIBRARY[name]), np.zeros(0)), value, value)  # type: ignore[arg-type]
        for name, value in criteria
    )


def found_of(first: Round, *final: str, refuted: tuple[str, ...] = ()) -> Found:
    def fit(names: tuple[str, ...]) -> Any:
        return SimpleNamespace(terms=tuple(Term(Named(LIBRARY[n]), np.zeros(0)) for n in names))

    gone = fit(refuted) if refuted else None
    return Found(None, None, (first,), fit(final), refuted=gone)  # type: ignore[arg-type]


@pytest.mark.parametrize("row", [0, 3, 600])
def test_a_missing_reading_at_a_start_moves_it_by_less_than_its_doubt(row: int):
    whole = recorded(1)
    theta = whole.channel("theta_l").copy()
    theta[row] = math.nan
    there = state_at(replace(whole, theta_l=theta), Rig(), row)
    assert there == pytest.approx(state_at(whole, Rig(), row), abs=0.1)


def test_missing_readings_and_a_last_row_after_a_gap_are_no_obstacle():
    fit, held = recorded(1), recorded(2)
    late = rows(fit, np.r_[: len(fit) - 5, len(fit) - 1])
    assert prepare(late, Rig()).restarts.tolist() == [0, len(late) - 1]
    theta = held.channel("theta_u").copy()
    theta[[0, 3]] = math.nan
    result = diagnose([late], Rig(), [replace(held, theta_u=theta)], options=BARE).result
    assert result.verdict == "consistent"
    floor, before = (result.fit["holdout"]["log_likelihood"][k] for k in ("floor", "before"))
    assert before == pytest.approx(floor, rel=0.05)


def test_the_interval_is_that_of_the_rows_that_are_there():
    whole = recorded(1)
    assert rows(whole, np.r_[:500, 2000:3000]).interval == pytest.approx(0.005)
    assert rows(whole, np.arange(0, 3000, 2)).interval == pytest.approx(0.01)
    # Milliseconds without decimals: 7, 8, 7, 8.
    rounded = np.floor(7.5 * np.arange(400)) * 1e-3
    assert Recording(rounded, rounded).interval == pytest.approx(0.0075, rel=1e-3)


def test_lost_counts_that_are_left_out_are_not_named():
    run = recorded(3)
    theta = run.channel("theta_l").copy()
    theta[1500:] += 6 * STEP
    lost = replace(run, theta_l=theta)
    bare = DiagnosisOptions(leave_out=BARE.leave_out, most=1)
    result = diagnose([lost], Rig(), options=bare).result
    assert result.effects == []
    others = tuple(n for n in BARE.leave_out if n != "missed_counts_lower")
    named = diagnose([lost], Rig(), options=replace(bare, leave_out=others)).result
    assert [effect.id for effect in named.effects] == ["missed_counts_lower"]


def test_what_was_found_is_no_rival_and_what_was_given_up_asks_for_no_recording():
    first = Round(
        SimpleNamespace(terms=()), (),  # type: ignore[arg-type]
        attempts(("unbalance", 900.0), ("brake_runout", 897.0), ("whirl_drag", 895.0)), (),
        {"unbalance": 0.6, "brake_runout": 0.3, "whirl_drag": 0.1},
    )  # fmt: skip
    found = found_of(first, "unbalance", "brake_runout")
    told = rivals(found, "unbalance", {"unbalance", "brake_runout"})
    assert [name for name, *_ in told] == ["whirl_drag"]
    pair = _confused(found_of(first, "unbalance", "brake_runout"))
    assert pair is not None and [a.term.id for a in pair] == ["unbalance", "whirl_drag"]
    pair = _confused(found_of(first, "brake_runout", refuted=("unbalance",)))
    assert pair is not None and [a.term.id for a in pair] == ["brake_runout", "whirl_drag"]
    alone = replace(first, named=first.named[:1])
    assert _confused(found_of(alone, "unbalance")) is None
    sure = replace(first, weights={"unbalance": 1.0})
    assert _confused(found_of(sure, "unbalance")) is None


def test_what_replaced_the_first_name_is_ranked_by_what_it_gains_alone():
    before: Any = SimpleNamespace(value=1000.0, bic=1000.0, terms=())
    first = Round(before, (), attempts(("unbalance", 900.0), ("whirl_drag", 5.0)), ())
    later: Any = SimpleNamespace(
        terms=(Term(Named(LIBRARY["whirl_drag"]), np.zeros(0)),), value=70.0, bic=80.0
    )
    named = restated(first, later).named
    assert [(a.term.id, a.criterion) for a in named] == [
        ("whirl_drag", 920.0),
        ("unbalance", 900.0),
    ]


def test_the_mismatch_is_strongest_where_its_torque_is_largest():
    slow, fast = (replace(recorded(seed, volts=v), source=f"{v:g}/run.csv")
                  for seed, v in ((4, 1.5), (5, 5.0)))  # fmt: skip
    setting, base = base_fit([prepare(r, Rig()) for r in (slow, fast)], Rig(), ["km"])
    drag = Term(Named(LIBRARY["quadratic_drag"]), np.array([1e-4]))
    where = locate(setting, base, drag)
    assert where.recording == label_of(setting, 1) == "5/run.csv"
    assert where.intervals_s


def test_the_document_of_recorded_velocities_follows_its_schema():
    run = recorded(6)
    states, _ = played(Rig(), run.t, run.channel("u"), np.zeros(4))
    noise = np.random.default_rng(0).normal(0.0, 0.02, (len(run), 2))
    speeds = replace(
        run, theta_u=None, theta_l=None, quanta={},
        omega_u=states[:, 1] + noise[:, 0], omega_l=states[:, 2] + noise[:, 1],
    )  # fmt: skip
    result = diagnose([speeds], Rig(), [speeds], options=BARE).result
    jsonschema.Draft202012Validator(schema()).validate(plain(result.as_dict()))
    assert set(result.fit["five_second_prediction"]) == {"omega_u", "omega_l"}
    with pytest.raises(InputError, match="same channels"):
        diagnose([run], Rig(), [speeds, run], options=BARE)


def test_noise_of_torque_passes_a_drive_that_is_at_its_limit():
    """The floor of a saturated rig is that of the same rig at the limit's voltage."""
    level = Term(Named(LIBRARY["amplifier_saturation"]), np.array([2.0]))
    t = np.arange(0.0, 15.0, 0.005)
    floors = []
    for volts, terms in ((4.0, (level,)), (2.0, ())):
        states, angles = played(extended_rig(Rig(), terms), t, np.full(len(t), volts), np.zeros(4))
        read = np.round(angles / STEP) * STEP
        run = Recording(t, np.full(len(t), volts), read[:, 0], read[:, 1],
                        quanta={"theta_u": STEP, "theta_l": STEP})  # fmt: skip
        setting, base = base_fit([prepare(run, Rig())], Rig(), ["km"])
        fit = replace(base, terms=terms, noise=replace(base.noise, torque_u=0.05, torque_l=1e-3))
        judged = judge(setting.samples[0], setting, fit)
        drawn = errors_by_noise(setting.samples, fit, [judged])
        floors.append(noise_floor(drawn, fit.noise, judged.channels)["short"]["theta_u"])
    assert floors[0] == pytest.approx(floors[1], rel=0.1)


def test_with_the_motors_constant_fixed_the_inertia_is_free():
    free = free_parameters(Rig(), {"km": 3.66}, "km")
    assert "Ju" in free and "km" not in free


def test_numbers_show_two_digits_of_their_interval():
    assert digits_of(1.00007, 0.99988, 1.00027) == 6
    assert digits_of(0.08, 0.07, 0.09) == 4
    assert digits_of(0.0, 0.0, 0.0) == digits_of(1.0, -math.inf, math.inf) == 4


@pytest.mark.parametrize("options", [{"seed": -1}, {"doubt": math.inf}, {"most": -1}])
def test_options_out_of_range_are_named(options: dict[str, Any]):
    with pytest.raises(InputError, match=next(iter(options))):
        DiagnosisOptions(**options)


def test_recordings_that_tell_nothing_are_refused():
    run = recorded(1)
    with pytest.raises(InputError, match=r"made-1.csv: 0.5 s are too short"):
        diagnose([rows(run, np.arange(100))], Rig(), options=BARE)
    still = replace(run, theta_u=0.0 * run.t, theta_l=0.0 * run.t)
    with pytest.raises(InputError, match="no reading ever changes"):
        diagnose([still], Rig(), options=BARE)


def told(*words: str) -> Result:
    return CliRunner().invoke(app, ["diagnose", *words])


def test_files_after_holdout_are_held_out_and_no_file_is_taken_twice(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    taken: dict[str, list[str]] = {}

    def stand_in(fit: Any, start: Any, holdout: Any, **more: Any) -> None:
        taken.update(fit=[r.source for r in fit], holdout=[r.source for r in holdout])
        raise InputError("seen enough")

    monkeypatch.setattr("drill_env.diagnosis.diagnose.diagnose", stand_in)
    for name in "abc":
        run = recorded(ord(name), 6.0)
        table = {n: run.channel(n) for n in ("t", "u", "theta_u", "theta_l")}
        pd.DataFrame(table).to_csv(f"{name}.csv", index=False)
    assert str(told("a.csv", "--holdout", "b.csv", "c.csv").exception) == "seen enough"
    assert taken == {"fit": ["a.csv"], "holdout": ["b.csv", "c.csv"]}
    for words in (("a.csv", "--holdout", "a.csv"), ("a.csv", "./a.csv"), ("a.csv", ".")):
        error = told(*words).exception
        assert isinstance(error, InputError) and ("twice" in str(error) or "folder" in str(error))
    assert not (tmp_path / "report").exists()
