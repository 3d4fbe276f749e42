"""What is concealed in each case, drawn from its seed, and the recordings and the answer of it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from benchmarks.concealed.fields import PAPER, plant_record
from benchmarks.concealed.library import (
    LEAVE_OUT,
    LIBRARY,
    LISTED_ONLY_BY_LAW,
    NEIGHBOURS,
    STAND_INS,
    UNLISTED,
    Concealed,
)
from benchmarks.concealed.limits import stored
from benchmarks.concealed.other_laws import OTHER_LAWS
from benchmarks.concealed.recordings import (
    TORQUE_NOISE,
    Hidden,
    Made,
    Truth,
    draw_rig,
    make_recording,
)
from benchmarks.concealed.signals import draw_families, signal

KINDS = ("single", "null", "pair", "out", "shape", "differ")
FIRST_PROOF_SEED = 1_000_000
# Too small to be found, and in every case.
_SIDE_RATIO = 0.5
_SPREAD, _NASTY_SPREAD, _NASTY_SHARE = 0.04, 0.15, 0.4
_OUT_RATIOS = (5.0, 20.0)
_PAIR_RATIO = 5.0


@dataclass(frozen=True)
class Plan:
    """One case before it is drawn.

    Attributes:
        kind: one of `KINDS`.
        number: among the cases of its kind, from 0.
        effects: ids to conceal; None draws what the kind asks for.
        ratios: detection limits to conceal them at.
    """

    kind: str
    number: int
    effects: tuple[str, ...] = ()
    ratios: tuple[float, ...] = ()


@dataclass(frozen=True)
class Case:
    """One case: what lies behind it, what the tool may know and what the answer says."""

    truth: Truth
    seed: tuple[int, ...]
    public: Mapping[str, str]
    answer: Mapping[str, Any] = field(default_factory=dict)


def plan(kind: str, count: int, effects: Sequence[str], ratios: Sequence[float]) -> list[Plan]:
    """Cases of one kind: single effects go through the effects first and then the ratios.

    Laws that differ from the library's do so too, through all there are.
    """
    if kind not in ("single", "differ"):
        return [Plan(kind, i) for i in range(count)]
    effects = list(OTHER_LAWS) if kind == "differ" else effects
    return [
        Plan(kind, i, (effects[i % len(effects)],), (ratios[i // len(effects) % len(ratios)],))
        for i in range(count)
    ]


def draw(seed: int, planned: Plan) -> Case:
    """Everything behind a case."""
    whole = (seed, KINDS.index(planned.kind), planned.number)
    rng = np.random.default_rng(whole)
    # Two of five, whatever the number of cases.
    nasty = planned.kind == "null" and planned.number % 5 in (1, 3)
    wanted, ratios, public = _wanted(planned, rng)
    rig = draw_rig(rng, PAPER, _NASTY_SPREAD if nasty else _SPREAD)
    hidden, told = [], []
    for effect, ratio in zip(wanted, ratios, strict=True):
        found, entry = _conceal(effect, ratio, rng)
        hidden.append(found)
        told.append(entry)
    side, side_told = _side(wanted, rng)
    truth = Truth(
        rig, (*hidden, side), torque=tuple(t * (3.0 if nasty else 1.0) for t in TORQUE_NOISE),
        counts=2048 if nasty else 8192, bursts=2 if nasty else 0,
    )  # fmt: skip
    if planned.kind == "shape":
        told = [{"id": LISTED_ONLY_BY_LAW, "component": "lower", "depends_on": ["omega_l"],
                 "parameters": {}, "identifiable": True, "ratio": 20.0}]  # fmt: skip
    answer = {
        "kind": planned.kind, "seed": list(whole), "nasty": nasty, "effects": told,
        "unlisted": side_told, "rig": rig, "public": public, "counts": truth.counts,
        "torque_noise_Nm": list(truth.torque), "lost_row_bursts": truth.bursts,
    }  # fmt: skip
    return Case(truth, whole, public, answer)


def _wanted(
    planned: Plan, rng: np.random.Generator
) -> tuple[list[Concealed], list[float], dict[str, str]]:
    """Effects, their ratios and what the tool is told."""
    if planned.kind == "single":
        return [LIBRARY[n] for n in planned.effects], list(planned.ratios), {}
    if planned.kind == "differ":
        return [OTHER_LAWS[n] for n in planned.effects], list(planned.ratios), {}
    if planned.kind == "pair":
        return _pair(rng), [_PAIR_RATIO, _PAIR_RATIO], {}
    if planned.kind == "out":
        ratio = _OUT_RATIOS[planned.number % 2]
        if planned.number % 4 == 3:
            names = list(UNLISTED)
            return [UNLISTED[names[planned.number // 4 % len(names)]]], [20.0], {}
        name = LEAVE_OUT[(planned.number - planned.number // 4) % len(LEAVE_OUT)]
        return [LIBRARY[name]], [ratio], {"leave_out": " ".join((name, *STAND_INS.get(name, ())))}
    if planned.kind == "shape":
        return [], [], {"start_friction": ("coulomb", "stribeck")[planned.number % 2]}
    return [], [], {}


def _pair(rng: np.random.Generator) -> list[Concealed]:
    """Two effects that can be found and told apart, of two components three times in four."""
    names = [n for n in LIBRARY if stored()[n]["identifiable"]]
    apart = rng.random() < 0.75
    while True:
        pair = [LIBRARY[str(n)] for n in rng.choice(names, 2, replace=False)]
        if apart and pair[0].component == pair[1].component:
            continue
        if not any({e.id for e in pair} <= group for group in NEIGHBOURS) and _apart(*pair):
            return pair


def _apart(first: Concealed, second: Concealed) -> bool:
    """Whether no field of the plant or the sensors belongs to both."""
    fields = [e.settings(e.parameters(e.guess, e.middle())) for e in (first, second)]
    return not any(set(one) & set(other) for one, other in zip(*fields, strict=True))


def _conceal(
    effect: Concealed, ratio: float, rng: np.random.Generator
) -> tuple[Hidden, dict[str, Any]]:
    limit = stored()[effect.id]
    size = min(ratio * limit["size"], effect.largest)
    signed = -size if effect.sign and rng.random() < 0.5 else size
    parameters = effect.parameters(signed, effect.draw(rng))
    told = {
        "id": effect.id, "component": effect.component, "parameters": parameters,
        "depends_on": list(effect.depends_on), "asked_ratio": ratio,
        "ratio": size / limit["size"], "limit": limit["size"],
        "identifiable": limit["identifiable"],
    }  # fmt: skip
    if effect.siblings:
        told["siblings"] = list(effect.siblings)
    return Hidden(effect.id, parameters), told


def _side(wanted: Sequence[Concealed], rng: np.random.Generator) -> tuple[Hidden, dict[str, Any]]:
    """A small effect that is in no library."""
    names = [n for n in UNLISTED if n not in {e.id for e in wanted}]
    return _conceal(UNLISTED[str(rng.choice(names))], _SIDE_RATIO, rng)


def play_case(case: Case) -> tuple[dict[str, Made], dict[str, Any]]:
    """Recordings by file stem, and the whole answer."""
    rng = np.random.default_rng((*case.seed, 1))
    # Speeds are bounded by the bare rig: what is concealed must not show in the voltages.
    bare = plant_record(dict(case.truth.rig))
    fitted, held = draw_families(rng)
    made: dict[str, Made] = {}
    stems = [f"fit-{i + 1}" for i in range(4)] + [f"holdout-{i + 1}" for i in range(2)]
    for i, (stem, family) in enumerate(zip(stems, fitted + held, strict=True)):
        u = signal(family, rng, bare)
        made[stem] = make_recording(case.truth, u, (*case.seed, 2, i), oracle=i >= 4)
    oracle = {stem: dict(m.oracle) for stem, m in made.items() if m.oracle}
    # Small truths could be guessed and hashed: the salt is told only with the answer.
    salt = hashlib.sha256(repr((case.seed, dict(case.truth.rig))).encode()).hexdigest()
    return made, {
        **case.answer, "families": {"fit": fitted, "holdout": held},
        "oracle_five_second_rms": oracle, "salt": salt,
    }  # fmt: skip
