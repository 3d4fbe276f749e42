"""Design of experiments against finite differences, the other simulator and its own promise."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from benchmarks.rig_maker import make, quasi_random
from drill_env import InputError, Rig
from drill_env.cli.main import app
from drill_env.identification.estimate import Estimate, FitOptions, identify
from drill_env.identification.estimate_file import load_knowledge, save_estimate
from drill_env.identification.experiment import Plan, design, expected_information
from drill_env.identification.knowledge import (
    Knowledge,
    knowledge_of,
    residual_shape,
    weak_knowledge,
)
from drill_env.identification.noise import NoiseModel
from drill_env.identification.signal_menu import menu
from drill_env.integrator import sampled_voltage, simulate
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording
from drill_env.recordings.signals import Signal, parse_signal, signal_samples

STEP = 2.0 * math.pi / 8192
QUIET = NoiseModel(torque_u=1e-6, torque_l=1e-8)
EXACT = {"theta_u": 0.0, "theta_l": 0.0}
FREE = ("km", "Jl", "ktheta", "Tsl", "beta1")

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")


def record(signal_u: np.ndarray, seed: int) -> Recording:
    """What another simulator makes of a voltage, with both noises of the practice sets."""
    truth = {name: getattr(Rig(), name) for name in SYMBOLS}
    made = make(truth, signal_u, seed=seed, torque_u=0.02, torque_l=2e-4)
    quanta = {"theta_u": STEP, "theta_l": STEP}
    return Recording(made.t, made.u, made.theta_u, made.theta_l, quanta=quanta, source="made")


@cache
def fitted() -> tuple[Recording, Estimate]:
    first = record(quasi_random(np.random.default_rng(1), 15.0, 200.0, 4.0), 1)
    return first, identify([first], Rig(), fixed={"Ju": Rig().Ju})


@cache
def planned() -> Plan:
    signals = menu(["quasi-random", "chirp", "ramp"], seconds=15.0, variants=2)
    return design(knowledge_of(fitted()[1]), signals)


def free_run_information(knowledge: Knowledge, signal: Signal) -> np.ndarray:
    """The free run's, by finite differences of the angles, the uncertain start eliminated."""
    t, u = signal_samples(signal)

    def angles(vector: np.ndarray, start: np.ndarray) -> np.ndarray:
        rig = knowledge.coordinates.rig(vector)
        gap, theta_l, offset = start
        initial = np.array([gap + offset, 0.0, 0.0, theta_l])
        run = simulate(rig, sampled_voltage(t, u), signal.seconds, t_eval=t, initial=initial)
        return np.concatenate([run.theta_u - offset, run.theta_l])

    centre = knowledge.coordinates.vector(knowledge.rig)
    count, h = len(centre), 1e-5
    columns = []
    for i in range(count + 3):
        move = h * np.eye(count + 3)[i]
        ahead = angles(centre + move[:count], move[count:])
        columns.append((ahead - angles(centre - move[:count], -move[count:])) / (2 * h))
    slopes = np.array(columns) / knowledge.noise.encoder_u
    whole = slopes @ slopes.T
    whole[count:, count:] += np.diag([0.05**-2, 0.05**-2, 0.1**-2])
    cross = np.linalg.solve(whole[count:, count:], whole[count:, :count])
    return whole[:count, :count] - whole[:count, count:] @ cross


def test_expected_information_is_that_of_finite_differences():
    signal = Signal("harmonic", seconds=10.0, offset=1.0, amplitude=4.0, frequency=0.2)
    knowledge = Knowledge(Rig(), FREE, np.zeros((5, 5)), QUIET, EXACT)
    truth = free_run_information(knowledge, signal)
    scale = np.sqrt(np.outer(np.diag(truth), np.diag(truth)))
    found = expected_information(signal, knowledge)
    assert np.abs((found - truth) / scale).max() < 0.01
    assert np.allclose(np.diag(np.linalg.inv(found)), np.diag(np.linalg.inv(truth)), rtol=0.02)


def test_longer_signals_narrow_every_interval_and_none_widens():
    weak = replace(weak_knowledge(Rig()), quanta=EXACT)
    short, long = (
        Signal("harmonic", seconds=seconds, offset=0.5, amplitude=4.0, frequency=0.15)
        for seconds in (8.0, 16.0)
    )
    found = {p.signal: p.deviations for p in design(weak, [short, long]).proposals}
    assert (found[long] < found[short]).all() and (found[short] < weak.deviations).all()
    plan = planned()
    assert all((p.deviations <= plan.deviations).all() for p in plan.proposals)


def test_the_best_signal_is_that_of_the_criterion():
    plan = planned()
    signals = [p.signal for p in plan.proposals]
    gains = [p.gain for p in plan.proposals]
    assert gains == sorted(gains, reverse=True) and gains[-1] > 0
    for name in ("Jl", "T2"):
        one = design(plan.knowledge, signals, criterion=name)
        i = one.knowledge.free.index(name)
        assert one.best.deviations[i] == min(p.deviations[i] for p in plan.proposals)
        assert one.shrink(one.best)[name] >= plan.shrink(plan.best)[name]


def test_a_recording_of_the_proposed_signal_keeps_the_promise():
    """Where the present interval is narrow enough for the design to hold; and a random
    signal promises less."""
    first, before = fitted()
    plan = planned()
    signal = plan.best.signal
    after = identify(
        [first, record(signal_samples(signal)[1], 2)], before.rig, fixed={"Ju": Rig().Ju}
    )
    realised = np.sqrt(np.diag(after.covariance) / np.diag(before.covariance))
    promised = plan.best.deviations / plan.deviations
    told = np.array([name not in plan.rough for name in before.free])
    assert told.sum() >= 8
    assert np.abs(realised / promised - 1.0)[told].max() < 0.25
    misses = np.array([getattr(after.rig, n) - getattr(Rig(), n) for n in after.free])
    assert np.abs(misses / np.sqrt(np.diag(after.covariance))).max() < 4.0


def test_what_is_not_told_is_named():
    """A constant voltage in one direction shows no asymmetry, and only sums of friction."""
    signal = Signal("constant", seconds=20.0, offset=3.0, amplitude=0.0)
    bare = weak_knowledge(Rig())
    told = replace(bare, information=expected_information(signal, bare), sources=("constant",))
    words = residual_shape(told)
    for name in ("dTsu", "dbu"):
        assert any(line.startswith(f"{name} is hardly told") for line in words)
    assert any("trade off" in line and "bu" in line and "dbu" in line for line in words)
    rich = replace(bare, information=1e8 * bare.information, sources=("much",))
    assert residual_shape(rich) == []


def test_an_interval_that_is_nothing_does_not_shrink():
    plan = planned()
    none = np.zeros_like(plan.deviations)
    best = replace(plan.best, deviations=none)
    flat = replace(plan, deviations=none, proposals=(best, *plan.proposals[1:]))
    assert set(flat.shrink(best).values()) == {0.0}
    assert {p["expected_shrink"] for p in flat.as_dict()["parameters"].values()} == {0.0}


def test_an_estimate_survives_its_file(tmp_path):
    _, estimate = fitted()
    save_estimate(estimate, tmp_path / "e.json")
    known, read = knowledge_of(estimate), load_knowledge(tmp_path / "e.json")
    assert (read.rig, read.free, read.noise) == (known.rig, known.free, known.noise)
    assert (dict(read.quanta), read.sources) == ({"theta_u": STEP, "theta_l": STEP}, ("made",))
    np.testing.assert_array_equal(read.information, known.information)
    document = json.loads((tmp_path / "e.json").read_text())
    np.testing.assert_allclose(document["covariance"], known.covariance, rtol=1e-7)
    np.testing.assert_allclose(document["covariance"], estimate.covariance, rtol=1e-7)


def test_the_menu_is_seeded_and_within_the_limit():
    signals = menu(limit=3.3, seconds=20.0, seed=4)
    assert signals == menu(limit=3.3, seconds=20.0, seed=4) != menu(limit=3.3, seconds=20.0)
    for signal in signals:
        assert parse_signal(signal.text) == signal
        assert np.abs(signal_samples(signal)[1]).max() <= 3.3


def drill(*words: str):
    return CliRunner().invoke(app, ["design-experiment", *words])


def test_command_proposes_a_signal_from_an_estimate(tmp_path):
    save_estimate(fitted()[1], tmp_path / "e.json")
    out = tmp_path / "next.csv"
    words = ["--estimate", str(tmp_path / "e.json"), "--menu", "ramp,chirp", "--seconds", "10"]
    done = drill(*words, "--variants", "2", "--limit", "4", "--out", str(out), "--json")
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    table = pd.read_csv(out)
    t, u = signal_samples(parse_signal(found["signal"]))
    np.testing.assert_allclose(table["u"], u, atol=1e-12)
    assert len(table) == 2000 and table["u"].abs().max() <= 4.0
    assert all(0 <= p["expected_shrink"] <= 1 for p in found["parameters"].values())
    assert "Ju" not in found["parameters"] and len(found["candidates"]) == 4
    shown = drill(*words, "--variants", "1")
    assert "play: drill-env signal" in shown.stdout and "shrinks" not in shown.stderr


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--estimate", "none.json"], "none.json"),
        (["--estimate", "list.json"], "not an estimate"),
        (["--estimate", "old.json"], "version"),
        (["--estimate", "bare.json"], "lacks 'rig'"),
        (["--estimate", "bare.json", "--recordings", "a.csv"], "--recordings"),
        (["--menu", "square"], "square"),
        (["--menu", ","], "menu is empty"),
        (["--criterion", "Ju"], "criterion"),
        (["--criterion", "XYZ"], "criterion"),
        (["--fix", "XYZ"], "XYZ"),
        (["--seconds", "-1"], "seconds"),
        (["--variants", "0"], "variants"),
        (["--out", "next.txt"], ".parquet"),
        (["--out", "missing/next.csv"], "missing"),
        (["norig.toml"], "norig.toml"),
    ],
)
def test_bad_input_is_one_error_and_nothing_is_written(words, named, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "list.json").write_text("[]")
    (tmp_path / "old.json").write_text('{"format": "drill-env estimate", "version": 0}')
    (tmp_path / "bare.json").write_text('{"format": "drill-env estimate", "version": 1}')
    before = sorted(tmp_path.iterdir())
    done = drill(*words)
    assert isinstance(done.exception, InputError) and named in str(done.exception)
    assert done.stdout == "" and sorted(tmp_path.iterdir()) == before


def test_a_broken_estimate_is_refused(tmp_path):
    save_estimate(fitted()[1], tmp_path / "e.json")
    document = json.loads((tmp_path / "e.json").read_text())
    for change in (
        {"information": [[1.0]]}, {"free": ["XYZ"]}, {"encoder_steps": {"phi": 0.1}},
        {"noise": []}, {"rig": {**document["rig"], "km": -1.0}}, {"rig": 3},
    ):  # fmt: skip
        (tmp_path / "bad.json").write_text(json.dumps(document | change))
        with pytest.raises(InputError, match=r"bad\.json"):
            load_knowledge(tmp_path / "bad.json")


def test_recordings_are_fitted_first(tmp_path):
    first, _ = fitted()
    columns = {"t": first.t, "u": first.u, "theta_u": first.theta_u, "theta_l": first.theta_l}
    pd.DataFrame(columns).to_csv(tmp_path / "first.csv", index=False)
    done = drill(
        "--recordings", str(tmp_path / "first.csv"), "--menu", "chirp", "--variants", "1",
        "--seconds", "10", "--json",
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)["parameters"]
    known = knowledge_of(fitted()[1])
    half = 1.96 * known.deviations[known.free.index("km")]
    assert found["km"]["half_width"] == pytest.approx(half, rel=0.1)


def test_options_of_a_fit_are_plain_numbers_in_the_file(tmp_path):
    _, estimate = fitted()
    loose = replace(estimate, options=FitOptions(robust=math.inf))
    save_estimate(loose, tmp_path / "e.json")
    assert json.loads((tmp_path / "e.json").read_text())["options"]["robust"] is None
