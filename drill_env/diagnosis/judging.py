"""Held-out recordings decide whether what was found stays, and whether it has a name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from drill_env.diagnosis.contest import trimmed
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.held_out import Judged, judge, rms
from drill_env.diagnosis.rounds import NEEDED, Found, clearly, is_named
from drill_env.diagnosis.slips import Slips
from drill_env.identification.samples import Samples

# So many times the needed gain is plain evidence; by this share of it held-out recordings may lose.
_PLAIN, _HARMLESS = 3.0, 0.05


def _gain(before: Sequence[Judged], after: Sequence[Judged]) -> float:
    return sum(j.value for j in before) - sum(j.value for j in after)


def _named_or_not(
    found: Found, before: Sequence[Judged], held: Sequence[Samples]
) -> tuple[Found, tuple[Judged, ...]]:
    """A free shape takes the place of a name only if held-out recordings prefer it as clearly."""
    after = tuple(judge(s, found.setting, found.final) for s in held)
    if found.nameless is None:
        return found, after
    other = tuple(judge(s, found.setting, found.nameless) for s in held)
    named = _gain(before, after)
    if held and found.final.terms and _gain(before, other) <= named + clearly(named):
        return replace(found, nameless=None), after
    return replace(found, final=found.nameless, contests={}), other


def judged(
    found: Found, base_setting: Setting, base: Fit, held: Sequence[Samples]
) -> tuple[Found, tuple[Judged, ...], tuple[Judged, ...]]:
    """Judge before and after; a term that does not help on held-out recordings is dropped."""
    before = tuple(judge(s, base_setting, base) for s in held)
    found, after = _named_or_not(found, before, held)
    while held and found.final.terms and not isinstance(found.final.terms[-1].source, Slips):
        fewer = trimmed(found)
        alone = tuple(judge(s, fewer.setting, fewer.final) for s in held)
        gain = _gain(alone, after)
        nearer = any(rms(after, "short", i) < 0.9 * rms(alone, "short", i) for i in range(2))
        # Other signals may leave at rest what the fitted ones show plainly.
        shown = fewer.final.bic - found.final.bic
        near = all(rms(after, "short", i) < 1.05 * rms(alone, "short", i) for i in range(2))
        # A free shape bends to what the fitted ones have: it may cost held-out ones no likelihood.
        near = near and is_named(found.final.terms[-1])
        harmless = gain > -_HARMLESS * shown or near
        if gain > 2.0 or nearer or (shown > _PLAIN * NEEDED and harmless):
            break
        found, after = fewer, alone
    return found, before, after
