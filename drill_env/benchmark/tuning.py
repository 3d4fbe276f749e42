"""Gains by a seeded search on training plants, none of which is a test plant.

`python -m benchmarks.tuning NAME`, in a checkout, searches anew and writes baselines/gains.json.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from drill_env._engine import SERIAL, Engine, run
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.benchmark.measures import measure_runs, vibration_free
from drill_env.benchmark.plants import LEVELS, training_plants
from drill_env.benchmark.rollout import PHASES, Scenario, run_plants
from drill_env.controllers import Controller
from drill_env.environment.config import EnvConfig
from drill_env.parameters import Level

SETPOINTS = np.array([0.5, 0.85, 1.5, 3.0, 5.0, 7.0, 8.0, 8.5])
PLANTS = 12
_SECONDS = 90.0
_WEIGHTS: dict[Level, float] = {"L0": 0.5, "L1": 0.7, "L2": 1.0, "L3": 1.5}
_STEP_WEIGHT, _SLOWNESS = 0.3, 0.15
_STARTS: dict[Scenario, float] = {"limit_cycle": 1.0, "friction_step": _STEP_WEIGHT}

Ranges = Mapping[str, tuple[float, float]]


def training_score(
    maker: Callable[[EnvConfig], Controller], plants: int = PLANTS, engine: Engine = SERIAL
) -> tuple[float, dict[str, float]]:
    """Mean vibration-free share, less 0.15 of the mean settling time in runs.

    Levels weigh 0.5, 0.7, 1 and 1.5, runs with a friction step 0.3 of those without.

    Returns:
        The score and the share of each start and level.
    """
    shares: dict[str, float] = {}
    slow: list[float] = []
    total = 0.0
    cells: list[tuple[Scenario, Level]] = [(start, level) for start in _STARTS for level in LEVELS]
    runs = run(
        functools.partial(_judged, maker, plants), cells, engine, name=lambda c: f"{c[0]} {c[1]}"
    )
    for (start, level), (share, settling) in zip(cells, runs, strict=True):
        shares[f"{start} {level}"] = round(share, 4)
        total += _STARTS[start] * _WEIGHTS[level] * share
        if start == "limit_cycle":
            slow.append(settling)
    whole = sum(_WEIGHTS.values()) * sum(_STARTS.values())
    return total / whole - _SLOWNESS * float(np.mean(slow)), shares


def _judged(
    maker: Callable[[EnvConfig], Controller], plants: int, cell: tuple[Scenario, Level]
) -> tuple[float, float]:
    """Vibration-free share, and mean settling time in runs, of one start and level."""
    start, level = cell
    config = EnvConfig(episode_seconds=_SECONDS)
    group = training_plants(level, PHASES if level == "L0" else plants)
    try:
        runs = run_plants(maker(config), config, group, SETPOINTS, start)
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        raise InputError(f"no design exists, or it diverges ({error}); try other gains") from error
    judged = measure_runs(
        runs.omega_l, runs.voltage, np.tile(SETPOINTS, len(group)), config.control_period,
        config.voltage_limit,
    )  # fmt: skip
    settling = float(judged.settling_s.fillna(_SECONDS).mean()) / _SECONDS
    return float(vibration_free(judged).mean()), settling


def search(
    build: Callable[..., Controller],
    ranges: Ranges,
    start: Mapping[str, float],
    trials: int,
    seed: int,
    tell: Callable[[str], None] = print,
    engine: Engine = SERIAL,
) -> dict[str, Any]:
    """Random search, then mutation of the best eight: all gains on a logarithmic scale.

    Args:
        build: makes the controller from a configuration and gains.
        ranges: lowest and highest value of each gain.
        start: gains of the first trial.
        trials: budget.
        seed: of the search.
        tell: hears of every better trial.
        engine: where the starts and levels of a trial run; trials follow each other.

    Returns:
        Gains, score and shares of the best trial, the budget, seed and time.
    """
    rng, began = np.random.default_rng(seed), time.perf_counter()
    names = list(ranges)
    low, high = (np.log([ranges[name][k] for name in names]) for k in (0, 1))
    tried: list[tuple[float, FloatArray]] = []
    best: dict[str, Any] = {"score": -np.inf}
    for trial in range(trials):
        if trial == 0:
            point = np.clip(np.log([start[name] for name in names]), low, high)
        elif trial < trials // 4:
            point = rng.uniform(low, high)
        else:
            tried.sort(key=lambda entry: -entry[0])
            parent = tried[min(int(rng.exponential(2.0)), 7, len(tried) - 1)][1]
            moved = rng.random(len(names)) < max(0.35, 1.0 / len(names))
            step = rng.normal(0.0, 0.12, len(names)) * (high - low)
            point = np.clip(parent + moved * step, low, high)
        # Four digits: gains that somebody may want to read.
        gains = {name: float(f"{np.exp(v):.4g}") for name, v in zip(names, point, strict=True)}
        try:
            score, shares = training_score(functools.partial(build, **gains), engine=engine)
        except InputError:
            score, shares = -1.0, {}
        tried.append((score, point))
        if score > best["score"]:
            best = {"gains": gains, "score": round(score, 5), "shares": shares}
            tell(f"{trial} {score:.4f} {gains} {shares}")
    seconds = round(time.perf_counter() - began, 1)
    return {**best, "trials": trials, "seed": seed, "seconds": seconds}
