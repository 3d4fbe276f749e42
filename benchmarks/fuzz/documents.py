"""Harnesses of rig files, `[[effects]]` and estimates."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

from benchmarks.fuzz.dice import Dice
from benchmarks.fuzz.inputs import mutated
from benchmarks.fuzz.judge import Harness
from drill_env import Rig
from drill_env.effects import LIBRARY
from drill_env.effects.declared import declared
from drill_env.identification.estimate_file import FORMAT, VERSION, load_knowledge
from drill_env.identification.noise import NoiseModel
from drill_env.parameters import SYMBOLS, dump_rig, load_rig

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


_DRAWN: dict[Any, Any] = {
    "id": "table", "component": "lower", "depends_on": "time", "sort": "torque",
    "knots": [0.0, 1.0], "values": [0.0, 1.0],
}  # fmt: skip


def compiled() -> None:
    """Compile what effects are declared with: on a busy machine that takes longer than an input."""
    _ = [effect.kernel.address for effect in LIBRARY.values()]
    _declare(Rig(effects=(_DRAWN,)))


RIG = Harness("rig", lambda dice: mutated(dice, RIGS, text=True), read_rig, prepare=compiled)

KEYS = (
    *"id component depends_on sort knots values encoder period".split(),
    *sorted({p.name for e in LIBRARY.values() for p in e.parameters}),
)
WORDS = ("table", "lower", "upper", "sensor", "error", "friction", "torque", "time", "theta_l")
KNOWN = tuple(LIBRARY.values())


def effects(dice: Dice) -> list[Any]:
    """One to three, with some of their numbers and with others."""
    return [_effect(dice) for _ in range(dice.whole(1, 3))]


def _effect(dice: Dice) -> Any:
    if dice.chance(0.1):
        return dice.value()
    known = dice.pick(KNOWN)
    entry: dict[Any, Any] = {"id": known.id} | {p.name: p.grid[0] for p in known.parameters}
    if dice.chance(0.25):
        entry = dict(_DRAWN)
    own = tuple(entry)
    for _ in range(dice.whole(0, 3)):
        key = dice.pick(own if dice.chance(0.5) else KEYS)
        entry[dice.text(3) if dice.chance(0.1) else key] = _size(dice)
    return entry


def _size(dice: Dice) -> Any:
    sort = dice.whole(0, 4)
    if sort < 2:
        return dice.number()
    if sort == 2:
        return dice.value()
    return dice.pick(WORDS) if sort == 3 else [dice.number() for _ in range(dice.whole(0, 4))]


def declare_effects(folder: Path, entries: list[Any]) -> None:
    """Effects as Python passes them."""
    _declare(Rig(effects=tuple(entries)))


EFFECTS = Harness("effects", effects, declare_effects, prepare=compiled)


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


ESTIMATES = (estimate(),)
ESTIMATE = Harness("estimate", lambda dice: mutated(dice, ESTIMATES, text=True), read_estimate)
