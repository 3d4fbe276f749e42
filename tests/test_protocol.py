"""The protocol: frozen plants, pairing, intervals, resuming and its files."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pandas as pd
import pytest

from drill_env import Engine, InputError, Rig, agents, baselines
from drill_env.benchmark import measure
from drill_env.benchmark import plants as plants_module
from drill_env.benchmark.contestants import contestant
from drill_env.benchmark.measures import measure_runs
from drill_env.benchmark.plants import LEVELS, frozen_plants, training_plants
from drill_env.benchmark.protocol import Cell, Protocol, run_cell, run_protocol
from drill_env.benchmark.rollout import run_plants
from drill_env.benchmark.summary import (
    bootstrap_interval,
    ranking,
    read_cells,
    settling_quantile,
    summary_rows,
)
from drill_env.benchmark.tuning import search
from drill_env.cli._protocol_mode import _identity
from drill_env.cli.compare_command import TrainedMaker
from drill_env.cli.main import app
from drill_env.environment.config import EnvConfig
from drill_env.parameters import uncertainty

SHORT = {"setpoints": (1.0, 4.0), "seconds": 12.0, "window_s": 4.0}
KEYS = {
    "controller", "tier", "level", "start", "vibration_free_share", "low", "high", "t50_s", "t90_s",
    "plants", "setpoints",
}  # fmt: skip


def made(*names):
    return [contestant(name, baselines.CONTROLLERS[name], EnvConfig()) for name in names]


def test_frozen_plants_are_what_their_seed_gives_and_lie_in_their_sets(monkeypatch):
    for level in LEVELS:
        plants, spread = frozen_plants(level), uncertainty(level)
        assert np.array_equal(plants.factors, plants_module._draw(level, 200, 2004))
        low, high = (spread.draw(np.full(8, end)) for end in (0.0, 1.0))
        assert (plants.factors >= low - 1e-6).all() and (plants.factors <= high + 1e-6).all()
        assert np.array_equal(frozen_plants(level, 230).factors[:200], plants.factors)
        if level != "L0":
            trained = training_plants(level, 400).factors[:, :7]
            assert not (plants.factors[:, None, :7] == trained[None]).all(axis=2).any()
            assert np.ptp(plants.factors, axis=0) == pytest.approx(high - low, rel=0.1)
    plants_module._frozen.cache_clear()
    monkeypatch.setattr(plants_module, "PLANTS_SHA256", "0" * 64)
    with pytest.raises(InputError, match="were changed"):
        frozen_plants("L1")
    monkeypatch.undo()
    plants_module._frozen.cache_clear()


def test_many_runs_are_judged_as_one():
    rng = np.random.default_rng(0)
    omega, volts = 2.0 + rng.standard_normal((80, 5)), rng.uniform(-5, 5, (80, 5))
    omega[40:, 1], omega[:, 2], omega[9, 3] = 2.01, -1.0, np.nan
    table = measure_runs(omega, volts, np.full(5, 2.0), 0.05, 5.0, 1.5)
    for i in range(5):
        one = measure(omega[:, i], volts[:, i], 2.0, 0.05, 5.0, 1.5)
        for name in table.columns:
            assert table[name][i] == pytest.approx(getattr(one, name), nan_ok=True)


def test_bootstrap_interval_is_that_of_the_plants_not_of_the_runs():
    rng = np.random.default_rng(3)
    shares = rng.random(150)
    low, high = bootstrap_interval(shares)
    half = 1.96 * shares.std() / np.sqrt(150)
    assert (high - low) / 2 == pytest.approx(half, rel=0.06)
    assert bootstrap_interval(np.ones(20)) == (1.0, 1.0)


def test_settling_quantiles_count_runs_that_never_settle():
    times = pd.Series([3.0, 1.0, np.nan, 2.0])
    assert settling_quantile(times, 0.5) == 2.0
    assert settling_quantile(times, 0.75) == 3.0
    assert settling_quantile(times, 0.9) == np.inf


def test_every_contestant_meets_the_same_plants_at_every_phase():
    config = EnvConfig(episode_seconds=0.1)
    first = {}
    for name in ("open-loop", "active-damping"):
        runs = run_plants(
            baselines.make(name, config), config, frozen_plants("L2", 16), np.array([2.0, 5.0]),
            "limit_cycle",
        )  # fmt: skip
        first[name] = runs.twist[0]
    # A tenth of a second in, the string hardly knows the voltage yet.
    assert first["open-loop"] == pytest.approx(first["active-damping"], abs=0.05)
    nominal = run_plants(
        baselines.make("open-loop", config), config, frozen_plants("L0", 16), np.array([2.0, 5.0]),
        "limit_cycle",
    )  # fmt: skip
    for j in range(2):
        values = nominal.omega_l[0, j::2]
        assert len(np.unique(values.round(9))) == 8
        assert values[:8] == pytest.approx(values[8:], abs=1e-12)


@pytest.mark.parametrize("start", ["rest", "limit_cycle", "ring", "friction_step"])
def test_copies_at_the_nominal_level_are_what_running_them_gives(start):
    protocol = Protocol(plants=10, **SHORT)
    table, traces = run_cell(Cell(made("active-damping")[0], "L0", start), protocol)
    config = EnvConfig(episode_seconds=12.0)
    runs = run_plants(
        baselines.make("active-damping", config), config, frozen_plants("L0", 10),
        np.array(protocol.setpoints), start,
    )  # fmt: skip
    assert table["mean"].to_numpy() == pytest.approx(runs.omega_l[-80:].mean(axis=0), abs=1e-12)
    assert table.plant.tolist() == np.repeat(np.arange(10), 2).tolist()
    assert traces.shape[:2] == (2, 4)
    assert traces[1, 2] == pytest.approx(runs.omega_l[::8, 1])


def test_a_friction_step_comes_halfway():
    config = EnvConfig(episode_seconds=12.0)
    group, targets = frozen_plants("L0", 1), np.array([4.0])
    still, stepped = (
        run_plants(baselines.make("open-loop", config), config, group, targets, start).omega_l
        for start in ("limit_cycle", "friction_step")
    )
    assert np.array_equal(still[:120], stepped[:120])
    assert np.abs(still[140:] - stepped[140:]).max() > 0.1


def test_resumed_parallel_and_serial_runs_are_the_same(tmp_path):
    protocol = Protocol(plants=3, levels=("L0", "L2"), starts=("limit_cycle", "ring"), **SHORT)
    serial = run_protocol(made("pi", "lqi"), protocol, tmp_path / "a")
    times = {path: path.stat().st_mtime_ns for path in serial.values()}
    lost = list(serial.values())[3]
    kept = pd.read_parquet(lost)
    lost.unlink()
    seen = []
    again = run_protocol(
        made("pi", "lqi"), protocol, tmp_path / "a",
        progress=lambda done, total: seen.append((done, total)),
    )  # fmt: skip
    assert seen == [(7, 8), (8, 8)] and pd.read_parquet(lost).equals(kept)
    assert {p: p.stat().st_mtime_ns for p in again.values() if p != lost} == {
        p: t for p, t in times.items() if p != lost
    }
    parallel = run_protocol(made("lqi", "pi"), protocol, tmp_path / "b", engine=Engine(jobs=2))
    for cell, path in parallel.items():
        same = next(p for c, p in serial.items() if c == cell)
        assert pd.read_parquet(path).equals(pd.read_parquet(same))
    other = Protocol(plants=3, levels=("L0",), starts=("ring",), seed=1, **SHORT)
    assert not set(run_protocol(made("pi"), other, tmp_path / "a").values()) & set(times)


def test_summary_and_ranking_of_runs_made_up_by_hand(tmp_path):
    protocol = Protocol(plants=2, levels=("L1",), starts=("rest", "limit_cycle"), **SHORT)
    contestants = made("pi", "active-damping", "adaptive-ekf-told")
    free = {"pi": [True, False, False, False], "active-damping": [True] * 4}
    files = {}
    for item in contestants:
        for start in protocol.starts:
            cell = Cell(item, "L1", start)
            table, _ = run_cell(cell, protocol)
            table["free"] = free.get(item.name, [True] * 4)
            table["settling_s"] = [1.0, 2.0, 3.0, np.nan]
            files[cell] = tmp_path / f"{item.name}-{start}.parquet"
            table.to_parquet(files[cell])
    whole, points = read_cells(files)
    rows = summary_rows(whole, protocol)
    assert [row["controller"] for row in rows] == [item.name for item in contestants]
    assert set(rows[0]) == KEYS and {row["start"] for row in rows} == {"limit_cycle"}
    assert rows[0]["vibration_free_share"] == 0.25 and rows[0]["tier"] == "S"
    assert (rows[0]["low"], rows[0]["high"]) == (0.0, 0.5)
    assert (rows[1]["t50_s"], rows[1]["t90_s"]) == (2.0, np.inf)
    assert (rows[0]["plants"], rows[0]["setpoints"]) == (2, 2)
    order = ranking(whole, protocol)
    assert order.controller.tolist() == ["active-damping", "pi"] and order["rank"].tolist() == [
        1,
        1,
    ]
    assert len(points) == 2 * len(whole)


def test_search_finds_a_better_gain_and_is_repeatable(monkeypatch):
    import drill_env.benchmark.tuning as tuning

    monkeypatch.setattr(
        tuning, "training_score", lambda maker, engine: (-abs(np.log(maker(None))), {})
    )
    runs = [
        search(lambda config, gain: gain, {"gain": (0.01, 100.0)}, {"gain": 30.0}, 60, 5, str)
        for _ in range(2)
    ]
    assert runs[0]["gains"] == runs[1]["gains"]
    assert abs(np.log(runs[0]["gains"]["gain"])) < 0.3


QUICK = ["--plants", "2", "--setpoints", "1,4", "--seconds", "12", "--window", "4", "--jobs", "1"]


def test_command_writes_tables_summary_and_page(tmp_path, capsys):
    out = tmp_path / "p"
    names = ["--controllers", "pi,lqi,adaptive-ekf", "--agent", "encoders-ppo"]
    options = ["compare", "--levels", "L0,L2", "--out", str(out), *names, *QUICK]
    app(options, standalone_mode=False)
    rows = json.loads((out / "summary.json").read_text())
    assert [(row["controller"], row["level"]) for row in rows] == [
        (name, level)
        for name in ("pi", "lqi", "adaptive-ekf", "encoders-ppo")
        for level in ("L0", "L2")
    ]
    assert all(set(row) == KEYS for row in rows)
    assert [row["vibration_free_share"] for row in rows if row["controller"] == "encoders-ppo"] == [
        1.0,
        1.0,
    ]
    assert rows[-1]["tier"] == "E" and rows[-1]["t50_s"] < 4.0
    assert len(pd.read_csv(out / "cells.csv")) == 4 * 2 * 4
    facts = pd.read_csv(out / "linear_facts.csv")
    assert facts.controller.unique().tolist() == ["pi", "lqi"]
    page = (out / "index.html").read_text()
    for text in ("adaptive-ekf", "encoders-ppo", "Tier S"):
        assert text in page
    assert 'src="http' not in page
    capsys.readouterr()
    app([*options, "--json"], standalone_mode=False)
    assert json.loads(capsys.readouterr().out)["summary"] == rows


def test_results_of_another_policy_are_not_reused(tmp_path):
    shipped = agents.find("encoders-ppo")
    folder = shutil.copytree(shipped, tmp_path / "encoders-ppo")
    same = _identity(TrainedMaker(folder))
    assert same == _identity(TrainedMaker(shipped))
    shutil.copy(agents.find("surface-ppo") / "policy.npz", folder)
    assert _identity(TrainedMaker(folder)) != same


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (["--levels", "L9"], "L9"),
        (["--levels", "L0", "--plants", "0"], "plants is 0"),
        (["--levels", "L0", "--starts", "moon"], "moon"),
        (["--levels", "L0", "--jobs", "0"], "jobs is 0"),
        (["--extended"], "--levels"),
    ],
)
def test_bad_options_of_the_protocol_are_named(options, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=text):
        app(["compare", "--out", "p", *options], standalone_mode=False)
    assert not (tmp_path / "p").exists()


def test_out_of_reach_is_told_by_the_plant_not_the_controller():
    protocol = Protocol(
        EnvConfig(rig=Rig()), setpoints=(4.0, 9.6), plants=2, seconds=2.0, window_s=1.0
    )
    table, _ = run_cell(Cell(made("open-loop")[0], "L0", "rest"), protocol)
    assert table.reachable.tolist() == [True, False, True, False]
