"""Random options of environments: rigs with effects, sensors, starts, disturbances, plants."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np

from benchmarks.fuzz.draws import MOST_VOLTS, draw_effects, draw_rig, logarithmic
from drill_env import Rig
from drill_env._types import Method
from drill_env.effects import LIBRARY
from drill_env.environment.config import ActionUnit, Start, View
from drill_env.parameters import UNCERTAINTY, Uncertainty

STARTS = tuple(start for start in get_args(Start) if start != "state")
PERIODS = 12
"""Length of an episode at most: each configuration restarts several times."""


def draw_options(rng: np.random.Generator) -> dict[str, Any]:
    """Options of `gym.make`; the paper's rig half of the time, with effects half of the time."""
    rig = draw_rig(rng) if rng.random() < 0.5 else Rig()
    if rng.random() < 0.5:
        rig = rig.replace(effects=draw_effects(rng, rig, False, list(LIBRARY)))
    period = float(rng.choice([0.01, 0.02, 0.05, 0.1, 0.2]))
    fastest = 0.8 * MOST_VOLTS * rig.km / rig.bu
    low = min(0.05 * fastest, 5.0)
    return {
        "rig": rig,
        "observation": str(rng.choice(get_args(View))),
        "history": int(rng.integers(0, 4)),
        "action": str(rng.choice(get_args(ActionUnit))),
        "voltage_limit": float(rng.uniform(0.5, 15.0)),
        "control_period": period,
        "episode_seconds": period * int(rng.integers(1, PERIODS + 1)),
        "setpoint": None if rng.random() < 0.5 else float(rng.uniform(low, 2.0 * low)),
        "setpoint_range": (low, min(fastest, 60.0)),
        "start": str(rng.choice(STARTS)),
        "encoder": _draw_encoder(rng, period),
        "uncertainty": _draw_uncertainty(rng),
        "reward": {"width": float(rng.uniform(0.01, 1.0)), "effort": float(rng.uniform(0, 1))},
        "method": str(rng.choice(get_args(Method))),
        "rtol": logarithmic(rng, 1e-8, 1e-3),
        **_draw_disturbances(rng, period, low),
    }


def _draw_encoder(rng: np.random.Generator, period: float) -> dict[str, Any]:
    rate = int(rng.integers(1, 12)) / period
    return {
        "counts_per_rev": int(rng.choice([0, 200, 8192])), "rate_hz": rate,
        "cutoff_hz": float(rng.uniform(0.05, 0.45)) * rate,
        "noise_rad": float(rng.choice([0.0, 1e-3])), "delay_s": float(rng.choice([0.0, 0.033])),
        "missed_per_count": float(rng.choice([0.0, 1e-3])),
    }  # fmt: skip


def _draw_uncertainty(rng: np.random.Generator) -> Any:
    if rng.random() < 0.7:
        return str(rng.choice(list(UNCERTAINTY)))
    shares = rng.uniform(0.0, 0.3, 5).tolist()
    return Uncertainty((0.9, 1.1), *shares, delay_s=float(rng.uniform(0.0, 0.05)))


def _draw_disturbances(rng: np.random.Generator, period: float, low: float) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if rng.random() < 0.5:
        found["friction_step"] = ((0.0, PERIODS * period), (0.5, 2.0))
    if rng.random() < 0.5:
        times = np.sort(rng.uniform(0.0, PERIODS * period, int(rng.integers(1, 4))))
        found["schedule"] = [(float(t), float(rng.uniform(low, 3.0 * low))) for t in times]
    return found
