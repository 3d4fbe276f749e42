"""A diagnosis in plain sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from drill_env._watch import ASKED
from drill_env.diagnosis.probability import CONFUSED
from drill_env.diagnosis.residual_torque import PREDICTABLE
from drill_env.diagnosis.result import DiagnosisResult, Grade, NamedEffect, Number, digits_of
from drill_env.prediction.rule import LIKELY

PLACES = {
    "actuator": "between the voltage and the motor's torque",
    "upper": "at the upper disc and its drive",
    "string": "in the string",
    "lower": "at the lower disc and its brake",
    "sensor": "in the readings, not in the motion",
}
"""Where a component is, in words."""


def sentences(
    result: DiagnosisResult, rejected: Sequence[str] = (), reason: str = "", *, looked: bool = True
) -> list[str]:
    """What was found, where, how sure, what it is confused with and what to do next.

    Args:
        result: of the diagnosis.
        rejected: names that were rejected.
        reason: why.
        looked: whether effects were looked for at all.
    """
    nothing = "No effect was looked for: this is the rig alone."
    lines = [verdict_sentence(result) if looked else nothing]
    if result.located is not None:
        lines += located_lines(result)
    lines += [effect_line(effect) for effect in result.effects]
    # A cosine that repeats has a sentence of its own.
    if result.shape is not None and "repeats" not in result.fit:
        what, shape = "what these leave over" if result.effects else "it", result.shape
        lines.append(
            f"No effect of the library explains {what}; its shape over {shape.coordinate} is "
            f"{shape.formula} (this formula explains {shape.r2:.0%} of the shape)."
        )
    told = {"explained", "follows"} & set(result.fit)
    if result.verdict == "unexplained" and not told and result.shape is None:
        lines.append(
            "Held-out recordings do not bear out the names and shapes that the fitted ones ask for."
        )
    lines += [*repetition_lines(result), *_residual(result)]
    if result.verdict in ("missing_physics", "unexplained"):
        lines += _confusion(result, rejected, reason)
    lines += _gain(result)
    if result.next_experiment is not None:
        e = result.next_experiment
        lines.append(
            f"The recording that would settle {' against '.join(e.separates)}: {e.signal} "
            f"({e.command})."
        )
    lines += [f for f in result.faults if all(f != e.meaning for e in result.effects)]
    return lines


def verdict_sentence(result: DiagnosisResult) -> str:
    """The verdict, as finely as the grades of the first finding bear it."""
    if "follows" in result.fit:
        return (
            "The recordings do not follow the rig: over 5 s no unseen reading is predicted better "
            "than by discs that stand still. Check columns, units, signs and clocks, and that "
            "voltage and angles are of one run."
        )
    if result.verdict == "consistent":
        return "Nothing is missing: the rig with fitted parameters explains the recordings."
    if result.verdict == "parameters":
        return "Nothing is missing, but parameters of the rig differ from those given."
    if result.verdict == "unexplained":
        beside = f", beside {_names(result)}" if result.effects else ""
        return f"Something is missing that the library has no name for{beside}."
    g = result.grades
    # The finest grade that is likelier than not.
    if g is not None and g.family and g.law_probability < LIKELY <= g.family_probability:
        return (
            f"Physics is missing from the model: {g.family}, most probably {_names(result)}; which "
            "law it has these recordings do not tell."
        )
    return f"Physics is missing from the model: {_names(result)}."


def _names(result: DiagnosisResult) -> str:
    return " and ".join(dict.fromkeys(effect.id for effect in result.effects))


def located_lines(result: DiagnosisResult) -> list[str]:
    """Where the mismatch sits, how large it is and when."""
    where = result.located
    assert where is not None
    lines = [
        f"The mismatch sits {PLACES.get(where.component, where.component)} and depends on "
        f"{where.depends_on}."
    ]
    if result.shape is not None and where.frequency_hz is not None:
        lines.append(f"It repeats at {where.frequency_hz:.4g} Hz.")
    if result.shape is not None and where.angle_order is not None:
        lines.append(f"It repeats with {where.angle_order:.4g} cycles a turn.")
    torque, angle = where.excess_torque_rms_Nm, where.excess_angle_rms_rad
    if max(torque.values()) > 0.0:
        lines.append(
            f"Its torque is {torque['upper']:.3g} Nm at the upper and {torque['lower']:.3g} Nm at "
            "the lower disc (root mean square)."
        )
    elif max(angle.values()) > 0.0:
        lines.append(
            f"It misreads the upper encoder by {angle['upper']:.3g} rad and the lower one by "
            f"{angle['lower']:.3g} rad (root mean square)."
        )
    if where.intervals_s:
        first = where.intervals_s[0]
        lines.append(
            f"It is strongest in {where.recording} at {len(where.intervals_s)} stretches, first "
            f"from {first[0]:.2f} to {first[1]:.2f} s."
        )
    return lines


def effect_line(effect: NamedEffect) -> str:
    """An effect with its numbers and its probability."""
    aliases = f"; no recording tells it from {', '.join(effect.alias_class)}" * bool(
        effect.alias_class
    )
    rest = "".join(
        f" Its law differs from the library's: {name} ({_numbers(numbers)}) over the same "
        "coordinate describes the rest, and both together are one law."
        for name, numbers in effect.rest.items()
    )
    return (
        f"{effect.meaning} {effect.id}: {_numbers(effect.parameters)}; probability "
        f"{effect.probability:.2f}{aliases}.{rest}"
    )


def _numbers(parameters: Mapping[str, Number]) -> str:
    return ", ".join(
        f"{name} = {n.value:.{d}g} ({n.low:.{d}g} to {n.high:.{d}g}) {n.unit}".removesuffix(" 1")
        for name, n in parameters.items()
        for d in (digits_of(n.value, n.low, n.high),)
    )


def _residual(result: DiagnosisResult) -> list[str]:
    left = result.fit.get("residual_torque") or {}
    return [
        f"Of the residual torque at the {disc} disc ({part['rms_Nm']:.2g} Nm root mean "
        f"square), the motion predicts {part['predictable']:.0%} in recordings not learnt from."
        for disc, part in left.items()
        if part["predictable"] > PREDICTABLE
    ]


def repetition_lines(result: DiagnosisResult) -> list[str]:
    """What repeats in time, if anything does."""
    told = result.fit.get("repeats")
    if told is None:
        return []
    unit = "of the drive" if told["driven"] else "Nm"
    return [
        f"A cosine of time of {told['amplitude']:.3g} {unit} explains {told['share']:.0%} of the "
        f"residual at the {told['disc']} disc in recordings in which its frequency was not sought. "
        "Its phase is free in each, as of something outside that goes on between recordings."
    ]


def _confusion(result: DiagnosisResult, rejected: Sequence[str], reason: str) -> list[str]:
    lines = [
        f"{a.id} was rejected as its name: {reason}."
        for a in result.alternatives
        if a.id in rejected
    ]
    if "follows" in result.fit:
        return lines
    rivals = [
        a for a in result.alternatives if a.id not in rejected and not _own_curve(result, a.id)
    ]
    rivals.sort(key=lambda a: -a.probability)
    if rivals and rivals[0].probability >= CONFUSED:
        lines.append(
            f"It is most easily confused with {rivals[0].id}, whose probability is "
            f"{rivals[0].probability:.2g} (criterion {rivals[0].delta_bic:.0f} worse)."
        )
    elif rivals:
        lines.append(
            f"It is not easily confused: the next candidate, {rivals[0].id}, is worse by "
            f"{rivals[0].delta_bic:.0f} in the criterion."
        )
    return lines


def _own_curve(result: DiagnosisResult, name: str) -> bool:
    """Whether a candidate is the free function over the coordinate of the name that was found."""
    where = result.located
    if where is None or not result.effects:
        return False
    return name.startswith(f"{where.component}_") and name.endswith(f"_of_{where.depends_on}")


def _gain(result: DiagnosisResult) -> list[str]:
    held = result.fit.get("five_second_prediction")
    if not held:
        return ["No recording was held out: give --holdout to judge the finding on unseen data."]
    lines = []
    for name, errors in held.items():
        before, after, floor = (errors[k] for k in ("before_rms", "after_rms", "floor_rms"))
        if None in (before, after, floor):
            continue
        unit = "rad/s" if name.startswith("omega") else "rad"
        lines.append(
            f"On held-out recordings the 5 s prediction of {name} errs by {after:.3g} {unit}, "
            f"before {before:.3g} {unit}; noise alone gives {floor:.3g} {unit}."
        )
    return lines


def nearest_of(grade: Grade | None) -> list[str]:
    """Which effects of the library come nearest to a free shape, at its place.

    Args:
        grade: of the first finding, if there is one.
    """
    if grade is None or not grade.nearest:
        return []
    told = ", ".join(f"{name} {share:.0%}" for name, share in list(grade.nearest.items())[:2])
    return [
        f"Effects of the library at this place explain a part of it: {told}. It may be such "
        "physics with another law."
    ]


def ended_early(by: str) -> str:
    """That a search was ended, and how to let it go on.

    Args:
        by: of `Watch.ended`.
    """
    cause = "when it was asked to" if by == ASKED else f"after {by}"
    return (
        f"The search ended early, {cause}: not everything was tried. Let it go on with --thorough, "
        "or options.seconds."
    )
