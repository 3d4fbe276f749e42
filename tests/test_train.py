"""train.py from start to finish, on a run of a few seconds."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from drill_env import InputError
from drill_env.agents import load
from drill_env.benchmark import compare
from drill_env.environment.config import EnvConfig

pytest.importorskip("stable_baselines3")

ROOT = Path(__file__).resolve().parent.parent
TINY = ["--num-envs", "64", "--episode-seconds", "2", "--batch-size", "1280", "--n-epochs", "2"]
UPDATE = 64 * 40
WIDTH = 5 + 4 * 6


def command(*args):
    return [sys.executable, str(ROOT / "train.py"), *map(str, args), *TINY]


def train(*args, cwd):
    return subprocess.run(
        command(*args), cwd=cwd, capture_output=True, text=True, timeout=300, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """Two trainings with one seed, and what the last one printed."""
    folder = tmp_path_factory.mktemp("train")
    for name in "ab":
        flags = ["--skip-table"] if name == "a" else []
        done = train("--total-steps", 4 * UPDATE, "--out", name, *flags, cwd=folder)
        assert done.returncode == 0, done.stderr
    return folder, done.stdout


def steps_of(folder):
    with (folder / "curve.csv").open() as stream:
        return [int(row["steps"]) for row in csv.DictReader(stream)]


def timesteps(archive):
    from stable_baselines3 import PPO

    return PPO.load(archive, device="cpu").num_timesteps


@pytest.mark.slow
def test_a_run_leaves_agent_checkpoint_curve_and_table(trained):
    folder, table = trained
    found = {p.name for p in (folder / "b").iterdir()}
    assert found == {"agent.json", "policy.npz", "checkpoint.zip", "curve.csv", "compare.csv"}
    assert json.loads((folder / "b" / "agent.json").read_text())["trained_steps"] == 4 * UPDATE
    assert "active-damping" in table and "ppo" in table


@pytest.mark.slow
def test_same_seed_same_policy(trained):
    folder, _ = trained
    observation = np.random.default_rng(0).uniform(0.5, 8.0, (50, WIDTH))
    agents = [load(folder / name) for name in "ab"]
    for agent in agents:
        agent.reset(50)
    first, again = (agent.act(observation) for agent in agents)
    assert np.array_equal(first, again)
    assert first.std() > 0.0


@pytest.mark.slow
def test_the_agent_answers_as_the_trained_model_and_never_sees_the_plant(trained):
    from stable_baselines3 import PPO

    folder, _ = trained
    agent, rng = load(folder / "a"), np.random.default_rng(3)
    model = PPO.load(folder / "a" / "checkpoint.zip", device="cpu")
    features = rng.normal(size=(40, agent.features.size))
    for plants in (np.zeros((40, 8)), rng.normal(size=(40, 8))):
        seen = np.hstack([features, plants]).astype(np.float32)
        wanted, _ = model.predict(seen, deterministic=True)
        assert agent.network(features) == pytest.approx(wanted[:, 0], abs=1e-4)


@pytest.mark.slow
def test_the_agent_joins_the_comparison(trained):
    folder, _ = trained
    agent = load(folder / "a")
    assert (agent.view, agent.history) == ("both", 6)
    agent.reset(20)
    observation = np.random.default_rng(1).uniform(0.5, 8.0, (20, WIDTH))
    assert np.abs(agent.act(1e3 * observation)).max() <= 5.0
    with pytest.raises(InputError, match=f"reads {WIDTH} numbers"):
        agent.act(observation[:, :2])
    done = subprocess.run(
        [
            sys.executable, "-m", "drill_env.cli.main", "compare", "--json", "--agent", "a",
            "--agent", "b", "--controllers", "pi", "--setpoints", "3", "--seconds", "10",
            "--window", "5", "--out", "c",
        ],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = {(r["controller"], r["start"]): r["mean"] for r in json.loads(done.stdout)["runs"]}
    assert rows["a", "rest"] == rows["b", "rest"] != rows["pi", "rest"]


@pytest.mark.slow
def test_resume_goes_on_and_the_steps_add_up(trained):
    folder, _ = trained
    done = train("--total-steps", 6 * UPDATE, "--out", "b", "--resume", "--skip-table", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert timesteps(folder / "b" / "checkpoint.zip") == 6 * UPDATE
    assert json.loads((folder / "b" / "agent.json").read_text())["trained_steps"] == 6 * UPDATE
    curve = steps_of(folder / "b")
    assert curve == sorted(set(curve))
    other = train("--total-steps", 8 * UPDATE, "--out", "b", "--resume", "--history", 2, cwd=folder)
    assert other.returncode == 2 and "--history" in other.stderr


@pytest.mark.slow
def test_a_surface_agent_with_history_joins_the_comparison(tmp_path):
    done = train(
        "--view", "surface", "--history", 3, "--total-steps", UPDATE, "--out", "s",
        "--skip-table", cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    agent = load(tmp_path / "s")
    assert (agent.view, agent.history) == ("surface", 3)
    runs = compare({"s": lambda _: agent}, EnvConfig(), setpoints=(2.0,), seconds=5.0, window_s=2.0)
    assert list(runs["view"]) == ["surface", "surface"]


@pytest.mark.slow
def test_an_interrupted_run_leaves_a_checkpoint_to_go_on_from(trained, tmp_path):
    """After another training has compiled what it needs, which may take minutes."""
    args = ["--total-steps", 10**8, "--out", "i", "--checkpoint-steps", 2 * UPDATE]
    process = subprocess.Popen(
        command(*args), cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        # A shell that starts the tests in its background lets them ignore this signal.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip
    until = time.monotonic() + 120
    while not (tmp_path / "i" / "checkpoint.zip").exists() and time.monotonic() < until:
        time.sleep(0.1)
    assert (tmp_path / "i" / "checkpoint.zip").exists()
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "--resume" in err and "Traceback" not in err
    steps = timesteps(tmp_path / "i" / "checkpoint.zip")
    assert 2 * UPDATE <= steps < 10**8
    assert not list((tmp_path / "i").glob(".*"))
    done = train("--total-steps", steps + 1, "--out", "i", "--resume", "--skip-table", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert steps < timesteps(tmp_path / "i" / "checkpoint.zip") <= steps + 1 + UPDATE


def test_an_interrupt_in_the_midst_of_a_clean_up_is_not_lost(tmp_path):
    """Python drops what is raised in ``__del__``; the first interrupt asks, the second stops."""
    from rich.console import Console

    from drill_env.agents.progress import TrainingProgress

    class CleansUp:
        def __del__(self):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)

    watch = TrainingProgress(1, tmp_path, 1, Console(quiet=True))
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with watch.interruptible():
            CleansUp()
            assert watch.interrupted
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, former)


BAD = {
    "no steps": (["--total-steps", 0], "--total-steps is 0: give 1 or more"),
    "batch": (["--batch-size", 10**6], "--batch-size is 1000000: give 2 to"),
    "file": (["--out", "file.txt"], "file.txt is no writable folder"),
    "nothing to resume": (["--out", "none", "--resume"], "start without --resume"),
    "view": (["--view", "downhole"], "give one of both, surface"),
    "uncertainty": (["--uncertainty", "L9"], "L9"),
    "episode": (["--episode-seconds", 0], "--episode-seconds is 0.0: give 0.05"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_arguments_are_one_error_and_exit_status_2(name, tmp_path):
    args, text = BAD[name]
    (tmp_path / "file.txt").write_text("x")
    done = subprocess.run(
        [sys.executable, str(ROOT / "train.py"), *map(str, args)],
        cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert done.returncode == 2 and done.stdout == ""
    assert len(done.stderr.splitlines()) == 1 and text in done.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["file.txt"]
