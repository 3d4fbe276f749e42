"""Shipped agents, their features, and what is exported from them."""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import bootstrap, trim_mean

from drill_env import InputError, agents, baselines
from drill_env.agents import export
from drill_env.agents.policy import feature_setting, make_features
from drill_env.benchmark.measures import measure_runs, vibration_free
from drill_env.benchmark.plants import frozen_plants
from drill_env.benchmark.rollout import run_plants
from drill_env.benchmark.seeds import interquartile_mean, stratified_interval
from drill_env.benchmark.summary import settling_quantile
from drill_env.environment import DrillStringVectorEnv
from drill_env.environment.config import EnvConfig
from drill_env.parameters import UNCERTAINTY

SHIPPED = ("encoders-ppo", "surface-ppo")
CONFIG = EnvConfig(episode_seconds=40.0)
SETPOINTS = np.array([0.85, 2.0, 3.0, 5.0, 7.0])


def judged(controller, level, plants):
    runs = run_plants(controller, CONFIG, frozen_plants(level, plants), SETPOINTS, "limit_cycle")
    targets = np.tile(SETPOINTS, plants)
    return measure_runs(runs.omega_l, runs.voltage, targets, 0.05, 5.0, window_s=20.0)


@pytest.mark.parametrize("level", ["L0", "L2"])
@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_agent_ends_the_vibration(name, level):
    assert vibration_free(judged(agents.load(name), level, 8)).all()


def test_the_agent_with_both_encoders_settles_in_six_tenths_of_the_time_of_lqi():
    both = (agents.load("encoders-ppo"), baselines.make("lqi", CONFIG))
    agent, lqi = (settling_quantile(judged(c, "L1", 8).settling_s, 0.5) for c in both)
    assert agent <= 0.6 * lqi


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_agent_tells_how_it_was_made_and_needs_no_torch(name):
    folder = agents.find(name)
    setting = json.loads((folder / "agent.json").read_text())
    assert setting["command"].startswith("python train.py") and setting["seed"] >= 1
    curve = np.loadtxt(folder / "curve.csv", delimiter=",", skiprows=1)
    assert curve[-1, 0] <= setting["trained_steps"] and curve[-1, 1] > curve[0, 1]
    assert sum(path.stat().st_size for path in folder.iterdir()) < 200_000
    code = (
        f"import sys; from drill_env import agents; agents.load({name!r})\n"
        "assert not {'torch', 'stable_baselines3', 'onnx'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=Path(__file__).parent.parent)


def test_actions_do_not_hang_on_the_other_rigs():
    options = {"history": 6, "uncertainty": "L3", "start": "limit_cycle", "truth": False}
    env, agent, seen = DrillStringVectorEnv(6, **options), agents.load("encoders-ppo"), []
    observation, _ = env.reset(seed=3)
    agent.reset(6)
    for _ in range(40):
        seen.append(observation.astype(float))
        volts = agent.act(seen[-1])
        observation, *_ = env.step(volts[:, None])
    agent.reset(2)
    alone = [agent.act(rows[[4, 1]]) for rows in seen]
    assert alone[-1] == pytest.approx(volts[[4, 1]], abs=1e-12)


def test_recalled_memory_continues_the_run():
    agent = agents.load("encoders-ppo")
    rows = observations(agent, 60)
    agent.reset(1)
    whole = [agent.act(row[None])[0] for row in rows[:40]]
    kept = agent.memory()
    whole += [agent.act(row[None])[0] for row in rows[40:]]
    other = agents.load("encoders-ppo")
    other.recall(kept)
    assert [other.act(row[None])[0] for row in rows[40:]] == whole[40:]


@pytest.mark.parametrize("view", ["both", "surface"])
def test_training_and_use_give_the_same_voltages(view):
    """The task's features and voltages are those of an agent in the plain environment."""
    pytest.importorskip("stable_baselines3")
    from drill_env.agents.training_env import TaskEnv, rigs

    agent = agents.load("encoders-ppo" if view == "both" else "surface-ppo")
    features = make_features(feature_setting(view, agent.history))
    venv = rigs(view, agent.history, "mixed", 12)
    task = TaskEnv(venv, features, 2.0, seed=5)
    seen, core = task.reset(), venv.env._core
    agent.reset(12)
    for step in range(90):
        if step in (40, 80):
            agent.reset(12)
        volts = agent.act(core.rows.observation.astype(float))
        output = np.clip(agent.network(seen[:, : features.size].astype(float)), -4.0, 4.0)
        seen, _, done, infos = task.step(output[:, None])
        assert done.all() == ((step + 1) % 40 == 0)
        if not done.any():
            assert core.row["voltage"] == pytest.approx(volts, abs=2e-5)
    assert all(info == {} for info in infos)


def test_training_plants_lie_within_l3_and_not_all_in_one_level():
    pytest.importorskip("stable_baselines3")
    from drill_env.agents.training_env import LevelMixture

    rng = np.random.default_rng(0)
    drawn = np.array([LevelMixture().draw(rng.random(8)) for _ in range(3000)])
    ends = np.array([UNCERTAINTY["L3"].draw(np.full(8, u)) for u in (0.0, 1.0)])
    assert (drawn >= ends[0] - 1e-12).all() and (drawn <= ends[1] + 1e-12).all()
    nominal = UNCERTAINTY["L0"].draw(np.zeros(8))
    assert 0.13 < (drawn == nominal).all(axis=1).mean() < 0.2
    assert (drawn[:, 7] > 0.1).mean() > 0.2


def observations(agent, count):
    """What a rig with jumping set points might show, its own past in the later columns."""
    rng = np.random.default_rng(2)
    now = np.column_stack([
        rng.uniform(-5.0, 8.0, count), rng.uniform(-2.0, 9.0, (count, 2)),
        np.repeat(rng.uniform(0.3, 13.0, count // 10), 10), rng.uniform(-5.0, 5.0, count),
    ])  # fmt: skip
    frames = now[:, [0, 1, 2, 4]]
    past = [frames[np.maximum(np.arange(count) - k, 0)] for k in range(1, agent.history + 1)]
    return np.hstack([now, *past])


def answers(agent, rows):
    agent.reset(1)
    memories, volts = [], []
    for row in rows:
        memories.append(agent.memory()[0])
        volts.append(agent.act(row[None])[0])
    return np.array(memories), np.array(volts)


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler called cc")
def test_exported_c_gives_the_same_voltages(tmp_path):
    agent = agents.load("encoders-ppo")
    rows = observations(agent, 300)
    export.to_c(agent, tmp_path / "my-agent.h")
    (tmp_path / "run.c").write_text(
        '#include "my-agent.h"\n'
        "void run(int n, const double *x, double *out) {\n"
        "    my_agent_state s; int i; my_agent_reset(&s);\n"
        "    for (i = 0; i < n; i++, x += 5)\n"
        "        out[i] = my_agent_volts(&s, x[0], x[1], x[2], x[3], x[4]);\n}\n"
    )
    flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-fPIC"]
    files = [tmp_path / "run.c", "-o", tmp_path / "run.so", "-lm"]
    subprocess.run(["cc", *flags, *files], check=True)
    out, seen = np.zeros(len(rows)), np.ascontiguousarray(rows[:, :5])
    double = ctypes.POINTER(ctypes.c_double)
    call = ctypes.CDLL(str(tmp_path / "run.so")).run
    call(len(rows), seen.ctypes.data_as(double), out.ctypes.data_as(double))
    assert out == pytest.approx(answers(agent, rows)[1], abs=1e-6)
    assert out.std() > 0.5


def test_exported_onnx_gives_the_same_voltages(tmp_path):
    pytest.importorskip("onnx")
    from onnx.reference import ReferenceEvaluator

    agent = agents.load("encoders-ppo")
    rows = observations(agent, 300)
    memories, volts = answers(agent, rows)
    export.to_onnx(agent, tmp_path / "agent.onnx")
    graph = ReferenceEvaluator(str(tmp_path / "agent.onnx"))
    out, after = graph.run(None, {"observation": rows, "memory": memories})
    assert out[:, 0] == pytest.approx(volts, abs=1e-6)
    assert after[:-1] == pytest.approx(memories[1:], abs=1e-6)


def test_export_from_the_command_line(tmp_path):
    command = [sys.executable, "-m", "drill_env.agents.export", "encoders-ppo"]
    done = subprocess.run([*command, tmp_path / "a.h"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.h").read_text() == export.c_source(agents.load("encoders-ppo"), "a")
    done = subprocess.run([*command, "a.txt"], capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.startswith("error: output a.txt: give a name")


def test_what_cannot_be_exported_says_so(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="Kalman filter, which is not exported"):
        export.to_c(agents.load("surface-ppo"), tmp_path / "a.h")
    monkeypatch.setitem(sys.modules, "onnx", None)
    with pytest.raises(InputError, match=r"pip install 'drill-env\[export\]'"):
        export.to_onnx(agents.load("encoders-ppo"), tmp_path / "a.onnx")
    assert not list(tmp_path.iterdir())


def test_an_unknown_agent_is_one_error_with_the_known_ones():
    assert agents.names() == list(SHIPPED)
    with pytest.raises(InputError, match="agent nobody: neither .* encoders-ppo, surface-ppo"):
        agents.load("nobody")


@pytest.mark.parametrize("text", ["{", "{}", '{"view": "both", "history": "x"}', "[1]"])
def test_a_damaged_setting_is_one_error(text, tmp_path):
    shutil.copy(agents.find("encoders-ppo") / "policy.npz", tmp_path)
    (tmp_path / "agent.json").write_text(text)
    with pytest.raises(InputError, match=r"agent\.json is (damaged|not JSON) .* train it again"):
        agents.load(tmp_path)


def test_a_policy_of_another_agent_is_refused(tmp_path):
    first, second = (agents.find(name) for name in SHIPPED)
    shutil.copy(first / "agent.json", tmp_path)
    with pytest.raises(InputError, match=r"no policy\.npz"):
        agents.load(tmp_path)
    shutil.copy(second / "policy.npz", tmp_path)
    with pytest.raises(InputError, match=r"does not belong to this policy\.npz"):
        agents.load(tmp_path)


def test_interval_over_seeds_is_that_of_another_implementation():
    scores = np.random.default_rng(4).normal(size=(12, 1))
    other = bootstrap(
        (scores[:, 0],), lambda x, axis: trim_mean(x, 0.25, axis=axis), method="percentile",
        n_resamples=10_000, rng=np.random.default_rng(5),
    ).confidence_interval  # fmt: skip
    low, high = stratified_interval(scores)
    assert (low, high) == pytest.approx((other.low, other.high), abs=0.05 * (high - low))
    assert low < interquartile_mean(scores) < high
    # Tasks that differ, seeds that do not: no reason for an interval.
    alike = np.tile([0.2, 0.9], (5, 1))
    assert stratified_interval(alike) == pytest.approx((0.55, 0.55))
    with pytest.raises(InputError, match="two or more"):
        stratified_interval(alike[:1])
