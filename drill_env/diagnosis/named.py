"""What was found as named effects, with probabilities and intervals."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.faults import Fault
from drill_env.diagnosis.intervals import changes, numbers_of
from drill_env.diagnosis.law import LawFit
from drill_env.diagnosis.locate import label_of
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.offered import is_parameter
from drill_env.diagnosis.probability import of_gain, probability
from drill_env.diagnosis.result import NamedEffect, Number
from drill_env.diagnosis.rounds import Found, is_named
from drill_env.diagnosis.strikes import Once
from drill_env.diagnosis.terms import Named
from drill_env.effects import LIBRARY


def named_effects(
    found: Found, law: LawFit | None, faults: list[Fault], scale: float
) -> list[NamedEffect]:
    """Effects of the final fit, another friction law and faults of the recording.

    Args:
        found: the search.
        law: another friction law, where one was found.
        faults: of the recordings.
        scale: relative standard deviation of the scale of torque.
    """
    effects = []
    if law is not None:
        effects.append(_law_effect(found, law.gain, scale))
    lost = {effect.id: effect for effect in _lost_counts(found)}
    for term in found.final.terms:
        if term.id in lost:
            effects.append(lost.pop(term.id))
        if not isinstance(term.source, Named) or not is_named(term):
            continue
        effect = term.source.effect
        if term.id in found.one_law:
            place = [e.id for e in effects].index(found.one_law[term.id])
            rest = effects[place].rest | {effect.id: numbers_of(found.final, term, scale)}
            effects[place] = replace(effects[place], rest=rest)
            continue
        effects.append(
            NamedEffect(
                effect.id, effect.component, probability(found, term.id),
                numbers_of(found.final, term, scale),
                effect.formula, _meaning(found, term.source), list(effect.aliases),
            )
        )  # fmt: skip
    for fault in (f for f in faults if f.sure):
        numbers = {k: Number(*v) for k, v in fault.parameters.items()}
        effects.append(
            NamedEffect(
                fault.id, "sensor", of_gain(fault.score**2), numbers, fault.text, fault.text, []
            )
        )
    # What the rig's own model has comes before physics beyond it.
    return sorted(effects, key=lambda effect: not is_parameter(effect.id))


def _meaning(found: Found, source: Named) -> str:
    meaning = source.effect.meaning
    if not isinstance(source, Once):
        return meaning
    marks = [motion.recording for motion in found.final.motions]
    return (
        f"{meaning.removesuffix('.')}, in {label_of(found.setting, marks.index(source.recording))}."
    )


def _lost_counts(found: Found) -> list[NamedEffect]:
    """One effect for all steps of each encoder, from whichever round they come."""
    effects = []
    seconds = sum(float(m.t[-1] - m.t[0]) for m in found.final.motions)
    ids = dict.fromkeys(t.id for t in found.final.terms if isinstance(t.source, LostCounts))
    for name in ids:
        steps = np.concatenate([t.q for t in found.final.terms if t.id == name])
        real = np.abs(steps[np.abs(steps) > 0.3 * np.abs(steps).max()])
        size, spread = _whole(found, name, real)
        rate = len(real) / seconds
        doubt = 1.96 * math.sqrt(len(real)) / seconds
        numbers = {
            "size": Number(size, size - spread, size + spread, "rad"),
            "rate": Number(rate, max(rate - doubt, 0.0), rate + doubt, "1/s"),
        }
        effect = LIBRARY[name]
        effects.append(
            NamedEffect(
                name, "sensor", probability(found, name),
                numbers, "steps of `size`, on average `rate` a second, on the reading",
                f"The {name.rsplit('_', 1)[1]} encoder loses counts at single moments.",
                list(effect.aliases),
            )
        )  # fmt: skip
    return effects


def _whole(found: Found, name: str, steps: FloatArray) -> tuple[float, float]:
    """Size (rad) of steps, and half of its 95 % interval: encoders lose whole counts.

    Steps of hardly more than two counts are found where noise makes them larger: they look too
    large on average, by less than half a count.
    """
    size = float(np.median(steps))
    spread = 1.96 * float(np.std(steps)) / math.sqrt(len(steps))
    key = "theta_l" if name.endswith("lower") else "theta_u"
    counts = [s.recording.quanta.get(key, 0.0) for s in found.setting.samples]
    count = float(np.median(counts))
    if count <= 0.0 or spread > 0.5 * count:
        return size, spread
    whole = count * max(round(size / count), 1)
    return whole, max(spread, abs(size - whole))


def _law_effect(found: Found, gain: float, scale: float) -> NamedEffect:
    rig = found.final.rig
    changed = changes(found.setting, found.final, rig)
    numbers = {
        name: _at_scale(Number(c.after, c.low, c.high, unit), scale)
        for name, unit in (("Tsl", "Nm"), ("T1", "Nm"), ("T2", "Nm"), ("beta1", "s/rad"),
                           ("beta2", "s/rad"), ("bl", "Nm s/rad"))
        if (c := changed.get(name)) is not None
    }  # fmt: skip
    return NamedEffect(
        "friction_shape", "lower", of_gain(gain), numbers,
        "T_l = Tsl + T1 (1 - 2/(1+e^(beta1 w))) + T2 (1 - 2/(1+e^(beta2 w))) + bl w",
        "The brake's friction rises, falls and rises again with speed: the humped law of the "
        "paper, equation (7).",
        [],
    )  # fmt: skip


def _at_scale(number: Number, scale: float) -> Number:
    """A number whose interval holds the doubt about the scale of torque too."""
    if "Nm" not in number.unit:
        return number
    doubt = 1.96 * scale * number.value
    low = number.value - math.hypot(number.value - number.low, doubt)
    return Number(
        number.value, low, number.value + math.hypot(number.high - number.value, doubt), number.unit
    )
