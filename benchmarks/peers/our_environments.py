"""Our environments, driven in the ways that load the integrator differently."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np

import drill_env  # noqa: F401
from peers.steppers import Stepper

# One whole episode with its restart: 60 s at 50 ms, and the step that begins anew.
EPISODE = 1201
Actions = Callable[[int, Any], np.ndarray]


def held(envs: int) -> Actions:
    """Another constant voltage in each environment, 0 to 5 V."""
    volts = np.random.default_rng(0).uniform(0.0, 5.0, (envs, 1)).astype(np.float32)
    return lambda _, __: volts


def fresh(envs: int) -> Actions:
    """A new voltage at every step, uniform in +-5 V: many reversals and jumps."""
    rng = np.random.default_rng(0)
    volts = rng.uniform(-5.0, 5.0, (256, envs, 1)).astype(np.float32)
    return lambda i, _: volts[i % 256]


def feedback(envs: int) -> Actions:
    """PI on the upper disc; its own arithmetic is inside the clock."""
    integral = np.zeros(envs, dtype=np.float32)

    def act(_: int, observation: np.ndarray) -> np.ndarray:
        error = observation[:, 3] - observation[:, 1]
        np.clip(integral + 0.05 * error, -5.0, 5.0, out=integral)
        return np.clip(0.6 * observation[:, 3] + 0.5 * error + integral, -5.0, 5.0)[:, None]

    return act


def vector(envs: int, actions: Callable[[int], Actions], name: str, truth: bool) -> Stepper:
    env: Any = gym.make_vec(
        "DrillString-v0", num_envs=envs, vectorization_mode="vector_entry_point", truth=truth
    )
    last, done, act = env.reset(seed=0)[0], 0, actions(envs)

    def run(steps: int) -> None:
        nonlocal last, done
        for i in range(done, done + steps):
            last = env.step(act(i, last))[0]
        done += steps

    with_truth = "with truth in info" if truth else "no info"
    return Stepper(f"drill-env vector, {name}, {with_truth}", envs, EPISODE, run, env._core)


def scalar() -> Stepper:
    env = gym.make("DrillString-v0")
    env.reset(seed=0)
    core = env.unwrapped._core  # type: ignore[attr-defined]
    volts = np.random.default_rng(0).uniform(0.0, 5.0, (64, 1)).astype(np.float32)
    done = 0

    def run(steps: int) -> None:
        nonlocal done
        for i in range(done, done + steps):
            # A constant voltage is held over a whole episode here too.
            truncated = env.step(volts[(i // EPISODE) % 64])[3]
            if truncated:
                env.reset()
        done += steps

    return Stepper("drill-env through gym.make, held voltage", 1, 12 * EPISODE, run, core)


def adapter(envs: int) -> Stepper:
    from drill_env.environment.sb3 import DrillStringVecEnv

    env = DrillStringVecEnv(envs)
    env.seed(0)
    env.reset()
    volts = held(envs)(0, None)

    def run(steps: int) -> None:
        for _ in range(steps):
            env.step(volts)

    return Stepper("drill-env SB3 adapter, held voltage", envs, EPISODE, run, env.env._core)
