"""A diagnosis that unseen windows decide, in plain sentences."""

from __future__ import annotations

from drill_env.diagnosis.probability import CONFUSED
from drill_env.diagnosis.result import DiagnosisResult
from drill_env.diagnosis.sentences import (
    PLACES,
    effect_line,
    located_lines,
    nearest_of,
    repetition_lines,
    verdict_sentence,
)


def sentences_by_prediction(result: DiagnosisResult) -> list[str]:
    """What was found, where, how sure, and what is left.

    Args:
        result: of the diagnosis.
    """
    lines = [verdict_sentence(result)]
    if result.located is not None and result.grades is None:
        lines += [*located_lines(result), *repetition_lines(result)]
    if result.located is not None and result.grades is not None:
        g = result.grades
        lines.append(
            f"The mismatch sits {PLACES.get(g.component, g.component)} (probability "
            f"{g.component_probability:.2f}) and depends on {g.depends_on} "
            f"({g.depends_on_probability:.2f})."
        )
        if g.family:
            lines.append(f"Its family: {g.family} ({g.family_probability:.2f}).")
        if g.law and g.share < 1.0:
            lines.append(
                f"{g.law} explains {g.share:.0%} of what the best free function of one "
                "coordinate explains."
            )
    lines += [effect_line(effect) for effect in result.effects]
    if result.shape is not None and "repeats" not in result.fit:
        what = "what these leave" if result.effects else "it"
        lines.append(
            f"No effect of the library explains {what} as well as a free function of "
            f"{result.shape.coordinate}; its curve is in the report."
        )
    lines += nearest_of(result.grades)
    share = result.fit.get("explained")
    if share is not None and not result.effects:
        lines.append(
            f"The best candidate removes only {share:.0%} of what the motion predicts of the "
            "error: it is a surrogate for the missing physics, and no name of it."
        )
    rivals = [a for a in result.alternatives if a.probability >= CONFUSED]
    if rivals:
        named = ", ".join(f"{a.id} ({a.probability:.2f})" for a in rivals[:3])
        lines.append(f"These recordings do not rule out {named}.")
    if "predictable" in result.fit:
        lines.append(
            f"No name or curve on offer predicts {'the rest' if result.effects else 'it'}, but "
            f"{result.fit['predictable']:.0%} of the error over 0.1 s is predicted from the motion "
            f"and its past without any law, most of it from {result.fit['predictable_from']}."
        )
    return lines + _failing(result) + _nearer(result) + result.faults


def _failing(result: DiagnosisResult) -> list[str]:
    told = result.fit.get("fails")
    if told is None:
        return []
    (name, first), *_ = told["stretches_s"].items()
    count = sum(map(len, told["stretches_s"].values()))
    return [
        f"In {count} stretches of {len(told['stretches_s'])} recordings the prediction over 0.1 s "
        f"errs one way by up to {told['largest']:.0f} times its usual error, and hardly anywhere "
        f"else: something acts there; first in {name} from {first[0][0]:.2f} to "
        f"{first[0][1]:.2f} s."
    ]


def _nearer(result: DiagnosisResult) -> list[str]:
    told = result.fit.get("prediction", {})
    lines = []
    for name in ("theta_u", "theta_l"):
        if name in told:
            before, after = told[name]["before_rms"][-1], told[name]["after_rms"][-1]
            change = f", before {before:.3g} rad" if result.effects or result.shape else ""
            lines.append(
                f"In recordings that were not fitted, the prediction of {name} over "
                f"{told['leads_s'][-1]:.2g} s errs by {after:.3g} rad{change} (root mean square)."
            )
    return lines
