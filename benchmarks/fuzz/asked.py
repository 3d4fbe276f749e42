"""Harnesses of what Python code and a command line may ask for: options, actions, signals, maps."""

from __future__ import annotations

import copy
import dataclasses
import itertools
import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fuzz.dice import Dice
from benchmarks.fuzz.hostile import HOSTILE
from benchmarks.fuzz.judge import Harness
from drill_env import InputError
from drill_env.environment.config import EnvConfig
from drill_env.environment.env import DrillStringEnv
from drill_env.recordings import parse_map, parse_signal, signal_samples

OPTIONS = tuple(item.name for item in dataclasses.fields(EnvConfig))
NESTED = (
    "counts_per_rev rate_hz cutoff_hz noise_rad delay_s missed_per_count km ktheta Tsl friction "
    "effects track width"
).split()
CHOICES = ("L0", "L3", "state", "random", "surface", "dopri5")


def _option(dice: Dice) -> Any:
    """Of an environment or a restart: near what is asked for, or nowhere near."""
    sort = dice.whole(0, 6)
    if sort < 2:
        return dice.number()
    if sort == 2:
        return [(dice.number(), dice.number()) for _ in range(dice.whole(0, 3))]
    if sort == 3:
        return tuple((dice.number(), dice.number()) for _ in range(2))
    if sort == 4:
        return {dice.pick(NESTED): dice.value(1) for _ in range(dice.whole(0, 3))}
    return dice.pick(CHOICES) if sort == 5 else dice.value()


USUAL: dict[str, Any] = {
    "setpoint": 3.0, "schedule": [(1.0, 2.0)], "friction_step": ((1.0, 2.0), (0.5, 2.0)),
    "encoder": {"rate_hz": 200.0}, "reward": {"track": 2.0}, "history": 2, "rtol": 1e-6,
    "uncertainty": "L1", "start": "ring", "episode_seconds": 5.0, "setpoint_range": (1.0, 2.0),
}  # fmt: skip
USUAL_RESET = {
    "setpoint": 3.0, "schedule": [(0.0, 2.0), (1.0, 3.0)], "start": "state", "state": (0, 1, 1),
    "delay_s": 0.1, "friction_step": ((1.0, 2.0), (0.5, 2.0)),
}  # fmt: skip


def options(dice: Dice, usual: dict[str, Any], names: tuple[str, ...]) -> dict[Any, Any]:
    """Some usual options and up to two of any value."""
    found: dict[Any, Any] = {name: usual[name] for name in usual if dice.chance(0.4)}
    for _ in range(dice.whole(0, 2)):
        name = dice.pick(HOSTILE if dice.chance(0.1) else names)
        nested = found.get(name)
        if isinstance(nested, dict):
            found[name] = nested | {dice.pick(NESTED): _option(dice)}
        else:
            found[name] = _option(dice)
    return found


def configure(folder: Path, given: dict[Any, Any]) -> None:
    """Options of `gym.make`."""
    EnvConfig.from_options(given)


CONFIG = Harness("environment", lambda dice: options(dice, USUAL, OPTIONS), configure)

RESETS = ("setpoint", "schedule", "start", "state", "phase", "rig", "delay_s", "friction_step")
_ENV: list[DrillStringEnv] = []
_COUNT = itertools.count()


def make() -> None:
    """An environment whose compiled parts have all been run."""
    _ENV[:] = [DrillStringEnv(schedule=((1.0, 2.0), (2.0, 3.0)))]
    for start in ("limit_cycle", "ring"):
        reset(Path(), {"start": start})


def reset(folder: Path, given: dict[Any, Any]) -> None:
    """Options of `reset`, and a step after them."""
    observation, _ = _ENV[0].reset(seed=1, options=given)
    observation, reward, *_ = _ENV[0].step(_ENV[0].action_space.low)
    assert math.isfinite(reward) and all(map(math.isfinite, observation.tolist()))


RESET = Harness("reset", lambda dice: options(dice, USUAL_RESET, RESETS), reset, prepare=make)

KINDS = ("?", "b", "H", "i", "Q", "e", "f", "d", "g", "F", "D", "M8[s]", "m8[ns]", "U3", "S2", "O",
         "f8,i4")  # fmt: skip


def action(dice: Dice) -> Any:
    """A number, a list, an array of any kind and shape, or no action at all."""
    sort = dice.whole(0, 4)
    if sort == 0:
        return dice.value()
    if sort == 1:
        return dice.number()
    if sort == 2:
        return [dice.number() for _ in range(dice.whole(0, 2))]
    shape = tuple(dice.whole(0, 2) for _ in range(dice.whole(0, 3)))
    kind = np.dtype(dice.pick(KINDS) if sort == 3 else dice.pick("fd"))
    if kind.hasobject:
        return np.full(shape, dice.number(), dtype=object)
    if kind.kind == "U":
        return np.full(shape, dice.text(3), dtype=kind)
    size = int(np.prod(shape))
    return np.frombuffer(dice.rng.bytes(size * kind.itemsize), kind).reshape(shape)


def twins() -> None:
    """Two alike; what is refused is given to one alone."""
    make()
    _ENV.append(copy.deepcopy(_ENV[0]))


def act(folder: Path, given: Any) -> None:
    """An action; where one is refused, the environment goes on as its twin does.

    All that it holds is compared seldom: that takes ten times as long as a step.
    """
    env, twin = _ENV
    before = pickle.dumps(env) if next(_COUNT) % 50 == 0 else b""
    try:
        observation, reward, *_ = env.step(given)
    except InputError:
        assert not before or pickle.dumps(env) == before
        raise
    assert math.isfinite(reward) and all(map(math.isfinite, observation.tolist()))
    expected = twin.step(given)
    assert observation.tobytes() == expected[0].tobytes() and reward == expected[1], (
        "an action that was refused has changed it"
    )


ACTION = Harness("action", action, act, prepare=twins)

MOST_SAMPLES = 1e5
"""Of a signal that is made: more only takes longer."""
PIECES = "t|u|=|:|ms|steps| --rate | --seed | --dwell |1|-".split("|")


def line(dice: Dice) -> tuple[bool, str]:
    """Whether it is a column map or a signal, and its text."""
    pieces = [_piece(dice) for _ in range(dice.whole(0, 8))]
    return dice.chance(0.5), "".join(pieces)


def _piece(dice: Dice) -> str:
    sort = dice.whole(0, 3)
    return dice.text(5) if sort == 3 else dice.pick(HOSTILE if sort == 2 else PIECES)


def parse_lines(folder: Path, given: tuple[bool, str]) -> None:
    """A column map or a signal as typed; a signal of few samples is made too."""
    if given[0]:
        parse_map([given[1]])
        return
    signal = parse_signal(given[1])
    if max(signal.rate, 1.0 / (signal.dwell or 1.0)) * signal.seconds < MOST_SAMPLES:
        assert np.isfinite(signal_samples(signal)[1]).all()


LINES = Harness("lines", line, parse_lines)
