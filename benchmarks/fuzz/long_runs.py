"""Long runs of environments: nothing grows, and time does not shift."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.fuzz.memory import memory
from drill_env import Rig
from drill_env.environment import DrillStringVectorEnv

MANY = 10
MOST_GROWN, MOST_CHANGED = 2**20, 1e-9
"""Bytes: the allocator's pages, where one number kept a step would be eight times the steps. rad/s:
what a shift of time by two nanoseconds does to a swing of 0.1 rad/s at one hertz."""
_RESTART = 100
"""Steps between two restarts by hand."""


def noisy() -> dict[str, Any]:
    """Options with noise, drawn plants and effects that remember."""
    effects = ({"id": "friction_lag", "time_constant": 0.05}, {"id": "input_delay", "delay": 0.07})
    return {"rig": Rig(effects=effects), "uncertainty": "L2", "encoder": {"noise_rad": 1e-3}}


def crowd_run(steps: int, rigs: int, seed: int) -> int:
    """Steps of many rigs at once, which restart by themselves and by hand.

    Args:
        steps: calls; each carries all rigs over a control period.
        rigs: how many.
        seed: of noise, plants, actions and of who restarts.

    Returns:
        Bytes by which the process grew after the first tenth.
    """
    env = DrillStringVectorEnv(rigs, episode_seconds=10.0, **noisy())
    env.reset(seed=seed)
    rng, size = np.random.default_rng(seed), 0
    for step in range(steps):
        observation, reward, *_ = env.step(rng.uniform(-5.0, 5.0, (rigs, 1)))
        if step % _RESTART == 0:
            assert np.isfinite(observation).all() and np.isfinite(reward).all()
            env.reset(options={"reset_mask": rng.random(rigs) < 0.3})
        if step < steps // 10:
            size = memory()
    return memory() - size


SWINGS = {"id": "lower_disturbance", "torque": 0.02, "phase": 0.3, "frequency": 1.0}


def long_run(steps: int, seed: int) -> tuple[int, float]:
    """Many steps of a vector environment with noise, memories and restarts, and one without end.

    The second is a rig that a torque of one hertz swings steadily: its motion after whole seconds
    is the same as long as time is.

    Args:
        steps: calls; each carries `MANY` rigs over a control period.
        seed: of noise, plants and actions.

    Returns:
        Bytes by which the process grew after the first tenth, and the largest change of the
        steady motion, rad/s.
    """
    short = DrillStringVectorEnv(MANY, episode_seconds=20.0, **noisy())
    steady = Rig(friction="coulomb", Tsl=0.05, T1=0.0, T2=0.0, bl=0.1, effects=(SWINGS,))
    endless = DrillStringVectorEnv(1, rig=steady, episode_seconds=1e7, setpoint=5.0, rtol=1e-8)
    for env in (short, endless):
        env.reset(seed=seed)
    rng, size, worst = np.random.default_rng(seed), 0, 0.0
    reference = np.zeros(20)
    for step in range(steps):
        short.step(rng.uniform(-5.0, 5.0, (MANY, 1)))
        speed = endless.step(np.full((1, 1), 4.0))[4]["omega_l"][0]
        if step < steps // 10:
            # The last second before the first tenth is over.
            reference[step % 20] = speed
            size = memory()
        else:
            worst = max(worst, abs(speed - reference[step % 20]))
    return memory() - size, worst
