"""Harnesses of rig files, `[[effects]]`, estimates, environments and command lines."""

from __future__ import annotations

import dataclasses
import json
import math
import pickle
from pathlib import Path
from typing import Any

from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from benchmarks.fuzz.inputs import HOSTILE, mutated, numbers, values
from benchmarks.fuzz.judge import Harness
from drill_env import InputError, Rig
from drill_env.effects import LIBRARY
from drill_env.effects.declared import declared
from drill_env.environment.config import EnvConfig
from drill_env.environment.env import DrillStringEnv
from drill_env.identification.estimate_file import FORMAT, VERSION, load_knowledge
from drill_env.identification.noise import NoiseModel
from drill_env.parameters import SYMBOLS, dump_rig, load_rig
from drill_env.recordings import parse_map, parse_signal

EFFECT = '\n[[effects]]\nid = "unbalance"\ntorque = 0.01\nphase = 0.0\n'
TABLE = """
[[effects]]
id = "table"
component = "lower"
depends_on = "theta_l"
sort = "friction"
knots = [0.0, 1.0, 2.0]
values = [0.1, 0.0, -0.1]
period = 6.0
"""
ALONE = Rig.one_inertia(km=1.0, Ju=1.0, Tsu=0.1, bu=0.2)
RIGS = tuple(
    text.encode() for text in (dump_rig(Rig()) + EFFECT, dump_rig(Rig()) + TABLE, dump_rig(ALONE))
)


def _declare(rig: Rig) -> None:
    assert all(math.isfinite(getattr(rig, name)) for name in SYMBOLS)
    declared(rig)


def read_rig(folder: Path, content: bytes) -> None:
    """A rig file, its effects declared."""
    path = folder / "rig.toml"
    path.write_bytes(content)
    _declare(load_rig(path))


RIG = Harness("rig", mutated(RIGS, text=True), read_rig)

NAMES = sorted({p.name for e in LIBRARY.values() for p in e.parameters})
KEYS = st.one_of(
    st.sampled_from("id component depends_on sort knots values encoder period".split()),
    st.sampled_from(NAMES), st.sampled_from(HOSTILE), st.text(max_size=3),
)  # fmt: skip
WORDS = ["table", "lower", "upper", "sensor", "error", "friction", "torque", "time", "theta_l"]


@st.composite
def effect(draw: st.DrawFn) -> Any:
    """An effect with some of its numbers and with others."""
    if draw(st.integers(0, 9)) == 0:
        return draw(values)
    known = draw(st.sampled_from(list(LIBRARY.values())))
    entry: dict[Any, Any] = {"id": known.id} | {p.name: p.grid[0] for p in known.parameters}
    if draw(st.integers(0, 3)) == 0:
        entry = {
            "id": "table", "component": "lower", "depends_on": "time", "sort": "torque",
            "knots": [0.0, 1.0], "values": [0.0, 1.0],
        }  # fmt: skip
    for _ in range(draw(st.integers(0, 3))):
        value = st.one_of(numbers, values, st.sampled_from(WORDS), st.lists(numbers, max_size=4))
        entry[draw(KEYS)] = draw(value)
    return entry


def declare_effects(folder: Path, entries: list[Any]) -> None:
    """Effects as Python passes them."""
    _declare(Rig(effects=tuple(entries)))


EFFECTS = Harness("effects", st.lists(effect(), min_size=1, max_size=3), declare_effects)


def estimate() -> bytes:
    """An estimate as `save_estimate` writes it, without the fit."""
    rig, free = Rig(), [name for name in SYMBOLS if name != "Ju"]
    recording = {"source": "a.csv", "seconds": 10.0, "rate": 100.0, "angles": ["theta_u"]}
    document = {
        "format": FORMAT, "version": VERSION, "rig": dataclasses.asdict(rig), "free": free,
        "information": [[float(i == j) for i in range(len(free))] for j in range(len(free))],
        "noise": [NoiseModel().named(velocities=False)], "recordings": [recording],
        "encoder_steps": {"theta_u": 0.0007, "theta_l": 0.0007},
    }  # fmt: skip
    return json.dumps(document).encode()


def read_estimate(folder: Path, content: bytes) -> None:
    """An estimate, with what the design of experiments asks of it."""
    path = folder / "estimate.json"
    path.write_bytes(content)
    assert math.isfinite(load_knowledge(path).noise.torque_u)


ESTIMATE = Harness("estimate", mutated((estimate(),), text=True), read_estimate)

OPTIONS = [item.name for item in dataclasses.fields(EnvConfig)]
NESTED = (
    "counts_per_rev rate_hz cutoff_hz noise_rad delay_s missed_per_count km ktheta Tsl friction "
    "effects track width"
).split()
pairs = st.lists(st.tuples(numbers, numbers), max_size=3)
given_values = st.one_of(
    values, numbers, pairs, st.tuples(st.tuples(numbers, numbers), st.tuples(numbers, numbers)),
    st.dictionaries(st.sampled_from(NESTED), st.one_of(numbers, values), max_size=3),
    st.sampled_from(["L0", "L3", "state", "random", "surface", "dopri5"]),
)  # fmt: skip


USUAL: dict[str, Any] = {
    "setpoint": 3.0, "schedule": [(1.0, 2.0)], "friction_step": ((1.0, 2.0), (0.5, 2.0)),
    "encoder": {"rate_hz": 200.0}, "reward": {"track": 2.0}, "history": 2, "rtol": 1e-6,
    "uncertainty": "L1", "start": "ring", "episode_seconds": 5.0, "setpoint_range": (1.0, 2.0),
}  # fmt: skip
USUAL_RESET = {
    "setpoint": 3.0, "schedule": [(0.0, 2.0), (1.0, 3.0)], "start": "state", "state": (0, 1, 1),
    "delay_s": 0.1, "friction_step": ((1.0, 2.0), (0.5, 2.0)),
}  # fmt: skip


@st.composite
def options(draw: st.DrawFn, usual: dict[str, Any], names: list[str]) -> dict[Any, Any]:
    """Some usual options and up to two of any value."""
    kept = draw(st.sets(st.sampled_from(sorted(usual))))
    found: dict[Any, Any] = {name: usual[name] for name in kept}
    for _ in range(draw(st.integers(0, 2))):
        name = draw(st.sampled_from([*names * 5, *HOSTILE]))
        nested = found.get(name)
        if isinstance(nested, dict):
            found[name] = nested | {draw(st.sampled_from(NESTED)): draw(given_values)}
        else:
            found[name] = draw(given_values)
    return found


def configure(folder: Path, given: dict[Any, Any]) -> None:
    """Options of `gym.make`."""
    EnvConfig.from_options(given)


CONFIG = Harness("environment", options(USUAL, OPTIONS), configure)

RESETS = ["setpoint", "schedule", "start", "state", "phase", "rig", "delay_s", "friction_step"]
_ENV: list[DrillStringEnv] = []


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


RESET = Harness("reset", options(USUAL_RESET, RESETS), reset, prepare=make)

ACTIONS = st.one_of(
    values, numbers, st.lists(numbers, max_size=2),
    npst.arrays(npst.scalar_dtypes(), npst.array_shapes(min_dims=0, max_dims=3, max_side=2)),
)  # fmt: skip


def act(folder: Path, given: Any) -> None:
    """An action; where it is refused, the environment is as before."""
    env = _ENV[0]
    before = pickle.dumps(env)
    try:
        observation, reward, *_ = env.step(given)
    except InputError:
        assert pickle.dumps(env) == before
        raise
    assert math.isfinite(reward) and all(map(math.isfinite, observation.tolist()))


ACTION = Harness("action", ACTIONS, act, prepare=make)

PIECES = st.one_of(
    st.sampled_from("t|u|=|:|ms|steps| --rate | --seed | --dwell |1|-".split("|")),
    st.sampled_from(HOSTILE), st.text(max_size=5),
)  # fmt: skip


def parse_lines(folder: Path, given: tuple[bool, str]) -> None:
    """A column map or a signal as typed."""
    if given[0]:
        parse_map([given[1]])
    else:
        parse_signal(given[1])


LINES = Harness(
    "lines", st.tuples(st.booleans(), st.lists(PIECES, max_size=8).map("".join)), parse_lines
)
