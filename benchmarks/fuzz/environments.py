"""Environments under fire: `python -m benchmarks.fuzz.environments --n 500 --seed 1`.

Random configurations: the scalar, the vector environment and the adapter give the same bits, and
so do copies taken in mid-episode. Then processes, and long runs. What is no action at all is the
harness `action` of `python -m benchmarks.fuzz`.
"""

from __future__ import annotations

import copy
import functools
import json
import pickle
import traceback
from collections.abc import Callable, Iterator
from typing import Annotated, Any

import gymnasium as gym
import numpy as np
import typer
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from numpy.typing import NDArray
from rich.progress import track

from benchmarks.fuzz.configurations import draw_options
from benchmarks.fuzz.forked import forked
from benchmarks.fuzz.long_runs import MANY, MOST_CHANGED, MOST_GROWN, crowd_run, long_run
from drill_env.effects import LIBRARY
from drill_env.environment import DrillStringEnv, DrillStringVectorEnv

NAME = "drill_env:DrillString-v0"
RIGS, STEPS = 3, 30
DEAD = 120.0
"""Seconds after which a configuration is given up; the first of a process may compile."""
TRUTH = ("twist", "omega_u", "omega_l", "theta_l", "friction_torque_l", "stuck_l", "setpoint")
MODES = (AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP)


def make(options: dict[str, Any]) -> gym.Env[Any, Any]:
    """A scalar environment; by name, as a process of its own makes it."""
    return gym.make(NAME, **options)


def makers(options: dict[str, Any]) -> list[Callable[[], gym.Env[Any, Any]]]:
    return [functools.partial(make, options)] * RIGS


def draw_actions(rng: np.random.Generator, options: dict[str, Any], steps: int) -> NDArray[Any]:
    """Held and switching voltages, some beyond the limit."""
    limit = 1.0 if options.get("action") == "normalized" else options.get("voltage_limit", 5.0)
    drawn = limit * rng.uniform(-1.3, 1.3, (steps, RIGS, 1))
    held = np.repeat(drawn[::5], 5, axis=0)[:steps]
    return np.where(rng.random((1, RIGS, 1)) < 0.5, held, drawn).astype(np.float32)


def vector_steps(env: Any, actions: NDArray[Any], first: list[Any]) -> Iterator[list[Any]]:
    """Everything that a vector environment of Gymnasium gives, step by step."""
    yield first
    for action in actions:
        observation, reward, terminated, truncated, info = env.step(action)
        found = [observation, np.asarray(reward, dtype=float), terminated, truncated]
        found += [np.where(info[f"_{key}"], info[key], 0.0) for key in TRUTH]
        if "final_obs" in info:
            found += [row for row in info["final_obs"] if row is not None]
        yield found


def adapter_steps(env: Any, actions: NDArray[Any], first: list[Any]) -> Iterator[list[Any]]:
    """Likewise of a `VecEnv` of Stable-Baselines3."""
    yield first
    for action in actions:
        observation, reward, done, infos = env.step(action)
        ends = [i["terminal_observation"] for i in infos if "terminal_observation" in i]
        # Stable-Baselines3 itself gives rewards of its workers in double precision.
        yield [observation, np.float32(reward), done, *ends]


def same(first: Iterator[list[Any]], second: Iterator[list[Any]]) -> None:
    """Every array of every step has the same bits."""
    for step, (a, b) in enumerate(zip(first, second, strict=True)):
        assert len(a) == len(b), f"step {step}: {len(a)} and {len(b)} results"
        for x, y in zip(a, b, strict=True):
            x, y = np.asarray(x), np.asarray(y)
            assert np.isfinite(x).all(), f"step {step} is not finite"
            assert x.dtype == y.dtype and x.tobytes() == y.tobytes(), f"step {step} differs"


def started(env: Any, seed: int) -> list[Any]:
    return [env.reset(seed=seed)[0]]


def seeded(env: Any, seed: int) -> list[Any]:
    """The first observations of a `VecEnv`."""
    env.seed(seed)
    return [env.reset()]


def compare(options: dict[str, Any], seed: int, mode: AutoresetMode) -> None:
    """Scalar, vector and adapter, then copies of each in mid-episode."""
    from stable_baselines3.common.vec_env import DummyVecEnv

    from drill_env.environment.sb3 import DrillStringVecEnv

    actions = draw_actions(np.random.default_rng(seed), options, STEPS)
    ours = DrillStringVectorEnv(RIGS, autoreset_mode=mode, **options)
    theirs = SyncVectorEnv(makers(options), autoreset_mode=mode)
    pair = [vector_steps(env, actions, started(env, seed)) for env in (ours, theirs)]
    same(*pair)
    pair = [DrillStringVecEnv(RIGS, **options), DummyVecEnv(makers(options))]
    same(*[adapter_steps(env, actions, seeded(env, seed)) for env in pair])
    for env in (ours, theirs.envs[0].unwrapped, pair[0].env):
        go_on_alike(env, actions)


def go_on_alike(env: Any, actions: NDArray[Any]) -> None:
    """A deep copy and a pickled one go on as `env` does, through restarts."""
    copies = [copy.deepcopy(env), pickle.loads(pickle.dumps(env))]
    runs = [_episodes(each, actions) for each in (env, *copies)]
    assert runs[0] == runs[1], "a deep copy goes on otherwise"
    assert runs[0] == runs[2], "a pickled copy goes on otherwise"


def _episodes(env: Any, actions: NDArray[Any]) -> list[bytes]:
    found = []
    alone = isinstance(env, DrillStringEnv)
    for action in actions:
        observation, reward, _, truncated, _ = env.step(action[0] if alone else action)
        found.append(observation.tobytes() + np.asarray(reward).tobytes())
        if alone and truncated:
            found.append(env.reset()[0].tobytes())
    return found


def gymnasium_workers(options: dict[str, Any], seed: int, context: str) -> None:
    """Worker processes of Gymnasium give the bits of this process."""
    actions = draw_actions(np.random.default_rng(seed), options, STEPS)
    pair = [SyncVectorEnv(makers(options)), AsyncVectorEnv(makers(options), context=context)]
    same(*[vector_steps(env, actions, started(env, seed)) for env in pair])
    pair[1].close()


def sb3_workers(options: dict[str, Any], seed: int, context: str) -> None:
    """Likewise those of Stable-Baselines3."""
    from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

    actions = draw_actions(np.random.default_rng(seed), options, STEPS)
    pair = [DummyVecEnv(makers(options)), SubprocVecEnv(makers(options), context)]
    same(*[adapter_steps(env, actions, seeded(env, seed)) for env in pair])
    pair[1].close()


def verdict(seed: int, number: int) -> dict[str, Any]:
    """What is wrong with one random configuration: `fault` is empty if nothing."""
    rng = np.random.default_rng([seed, number])
    options = draw_options(rng)
    try:
        compare(options, int(rng.integers(2**31)), MODES[number % 2])
    except Exception as error:
        detail = {"number": number, "options": options, "detail": traceback.format_exc()}
        return {"fault": f"{type(error).__name__}: {error}", **detail}
    return {"fault": ""}


def main(
    n: Annotated[int, typer.Option(help="configurations")] = 500,
    seed: Annotated[int, typer.Option(help="of the draws")] = 1,
    steps: Annotated[int, typer.Option(help=f"of the long run, each of {MANY} rigs")] = 100_000,
    crowd: Annotated[int, typer.Option(help="steps of the run of many rigs")] = 40_000,
    rigs: Annotated[int, typer.Option(help="of that run")] = 256,
    first: Annotated[int, typer.Option(help="number of the first configuration")] = 0,
) -> None:
    """Compare bits, then run for long."""
    # What all need is loaded once, here.
    _ = [effect.kernel.address for effect in LIBRARY.values()], verdict(0, 0), verdict(0, 1)
    faults = 0
    for number in track(range(first, first + n), description="configurations"):
        found = forked(functools.partial(verdict, seed, number), DEAD)
        if found["fault"]:
            faults += 1
            print(json.dumps({"number": number, **found}, default=str), flush=True)
    print(f"{n} configurations, {faults} with a fault", flush=True)
    for number in range(first, first + min(n, 3)):
        options = draw_options(np.random.default_rng([seed, number]))
        for context in ("fork", "spawn", "forkserver"):
            gymnasium_workers(options, seed, context)
            sb3_workers(options, seed, context)
    print("processes give the same bits", flush=True)
    more = crowd_run(crowd, rigs, seed)
    print(f"{crowd} steps of {rigs} rigs: grown by {more} bytes", flush=True)
    grown, changed = long_run(steps, seed)
    print(f"{steps} steps of {MANY} rigs: grown by {grown} bytes, changed by {changed:.1e} rad/s")
    bad = faults or max(grown, more) > MOST_GROWN or changed > MOST_CHANGED
    raise typer.Exit(1 if bad else 0)


if __name__ == "__main__":
    typer.run(main)
