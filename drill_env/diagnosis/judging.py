"""Held-out recordings decide whether what was found stays, and whether it has a name."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from drill_env.diagnosis.attempts import restated
from drill_env.diagnosis.contest import trimmed
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.held_out import Judged, judge, rms
from drill_env.diagnosis.joint import polished
from drill_env.diagnosis.rounds import NEEDED, Found, clearly, is_named
from drill_env.diagnosis.slips import Slips
from drill_env.diagnosis.terms import Named
from drill_env.identification.samples import Samples

# So many times the needed gain is plain evidence; by this share of it held-out recordings may lose.
_PLAIN, _HARMLESS = 3.0, 0.05
# Gain above which held-out recordings ask for a term, and how many shapes are asked in turn.
_HELPS, _SHAPES = 2.0, 2
# Names of the first round that are tried in turn.
_NAMES = 4
# Share of the errors of 5 s predictions below which these speak for a name.
_NEARER = 0.97
# Errors of 5 s predictions that are less than this many times as large are hardly worse.
_WORSE = 1.05
# And less than this many times, nearer throughout, or one so much that likelihood is not asked.
_BETTER, _FAR_BETTER = 0.9, 0.8
# So many times as large, all of them, names are none: a right but faint one had 1.1.
_FAR_WORSE = 1.25


def _gain(before: Sequence[Judged], after: Sequence[Judged]) -> float:
    return sum(j.value for j in before) - sum(j.value for j in after)


def _named_or_not(
    found: Found, before: Sequence[Judged], held: Sequence[Samples]
) -> tuple[Found, tuple[Judged, ...]]:
    """A free shape takes the place of a name only if held-out recordings prefer it too.

    Either as clearly as the fitted ones, or plainly and with all 5 s predictions nearer, or by
    predictions of which none is further and one is nearer by a fifth: where other recordings go
    further than the fitted ones, a shape's ends cost likelihood.
    """
    after = tuple(judge(s, found.setting, found.final) for s in held)
    if found.nameless is None:
        return found, after
    named = _gain(before, after)
    # A name that is refuted by what it leaves over gives way to any shape that holds.
    wanted = named + clearly(named) if found.refuted is None else _HELPS
    harmful: list[str] = []
    for shaped in _shaped(found):
        other = tuple(judge(s, found.setting, shaped) for s in held)
        gain = _gain(before, other)
        better = gain > named + NEEDED and _as_near(after, other, _BETTER)
        better = better or _far_nearer(after, other)
        if not held or not found.final.terms or gain > wanted or better:
            return replace(found, final=shaped, contests={}), other
        if gain < 0.0:
            harmful.append(shaped.terms[-1].id)
    return replace(found, nameless=None, refuted=None, harmful=tuple(harmful)), after


def _shaped(found: Found) -> Iterator[Fit]:
    """The fit with a free shape, and with those of the first round that beat all names too."""
    assert found.nameless is not None
    yield found.nameless
    named = found.base.bic - found.final.bic
    tried = {term.id for term in found.nameless.terms}
    for attempt in found.rounds[0].shapes[:_SHAPES]:
        if attempt.term.id not in tried and attempt.criterion > named:
            yield polished(found.setting, attempt.fit)


def _spoken_against(found: Found, before: Sequence[Judged], after: Sequence[Judged]) -> bool:
    """Whether held-out recordings are plainly less likely with the names that were found.

    Or all that is read is predicted far worse over 5 s than without them.
    """
    terms = found.final.terms
    if not terms or not all(map(is_named, terms)):
        return False
    if far_further(before, after):
        return True
    if any(isinstance(t.source, Slips) for t in terms):
        return False
    nearer = any(rms(after, "short", i) < _NEARER * rms(before, "short", i) for i in range(2))
    return not nearer and _less_likely(found, before, after)


def _less_likely(found: Found, before: Sequence[Judged], after: Sequence[Judged]) -> bool:
    """Whether names make held-out recordings plainly less likely."""
    shown = found.base.bic - found.final.bic
    return _gain(before, after) < -max(NEEDED, _HARMLESS * shown)


def _next_name(
    found: Found, before: Sequence[Judged], after: tuple[Judged, ...], held: Sequence[Samples]
) -> tuple[Found, tuple[Judged, ...]]:
    """Another name of the first round in place of one that held-out recordings speak against.

    They must be likelier with it than without, and the 5 s predictions as near as with the first.
    It may have been carried on for too few rounds; else the first one counts as given up.
    """
    terms = found.final.terms
    if len(terms) != 1 or not isinstance(terms[0].source, Named):
        return found, after
    if not _less_likely(found, before, after):
        return found, after
    for attempt in found.rounds[0].named[:_NAMES]:
        if attempt.term.id == terms[0].id or attempt.criterion < _PLAIN * NEEDED:
            continue
        fit = polished(found.setting, attempt.fit)
        other = tuple(judge(s, found.setting, fit) for s in held)
        if _gain(before, other) > _HELPS and _as_near(after, other):
            refuted = None if fit.bic < found.final.bic else found.final
            rounds = (restated(found.rounds[0], fit), *found.rounds[1:])
            return replace(found, final=fit, rounds=rounds, contests={}, refuted=refuted), other
    return found, after


def _given_up(found: Found, held: Sequence[Samples]) -> tuple[Found, tuple[Judged, ...]]:
    """The search without its names.

    Where the fitted recordings hardly asked for the names, nothing is missing.
    """
    # With another friction law, the rig alone is not the one of before.
    alone = tuple(judge(s, found.setting, found.base) for s in held)
    if found.base.bic - found.final.bic <= _PLAIN * NEEDED:
        return replace(found, final=found.base, contests={}, nameless=None), alone
    return without_names(found, held, alone)


def without_names(
    found: Found, held: Sequence[Samples], alone: tuple[Judged, ...]
) -> tuple[Found, tuple[Judged, ...]]:
    """The search with its names refuted: a free shape that holds on held-out recordings, or none.

    Args:
        found: the search.
        held: held-out recordings.
        alone: these under the rig alone.
    """
    bare = replace(found, final=found.base, contests={}, nameless=None, refuted=found.final)
    for attempt in found.rounds[0].shapes[:_SHAPES]:
        if attempt.criterion <= NEEDED:
            break
        fit = polished(found.setting, attempt.fit)
        shaped = replace(bare, final=fit)
        after = tuple(judge(s, found.setting, fit) for s in held)
        if _gain(alone, after) > _HELPS and not far_further(alone, after):
            return shaped, after
    return bare, alone


def _stays(found: Found, fewer: Found, alone: Sequence[Judged], after: Sequence[Judged]) -> bool:
    """Whether the last term helps on held-out recordings, or shows plainly and does no harm."""
    gain, nearest = _gain(alone, after), min(_shares(alone, after), default=math.inf)
    # Other signals may leave at rest what the fitted ones show plainly.
    shown = fewer.final.bic - found.final.bic
    # What costs more than it shows is not harmless; a free shape, which bends to what the
    # fitted ones have, may cost no likelihood at all.
    near = _as_near(alone, after) and is_named(found.final.terms[-1]) and gain > -shown
    harmless = gain > -_HARMLESS * shown or near
    return gain > _HELPS or nearest < _BETTER or (shown > _PLAIN * NEEDED and harmless)


def _makes_up(
    found: Found, before: Sequence[Judged], alone: Sequence[Judged], after: Sequence[Judged]
) -> bool:
    """Whether a further term but makes up for what the others cost held-out recordings.

    Where these are plainly less likely than with nothing, their noise is larger than the fitted
    one, and likelihood favours whatever bends to it: then 5 s predictions must come nearer.
    """
    if len(found.final.terms) < 2 or not is_named(found.final.terms[-1]):
        return False
    nearest = min(_shares(alone, after), default=0.0)
    return nearest >= _NEARER and _less_likely(found, before, after)


def _as_near(alone: Sequence[Judged], after: Sequence[Judged], times: float = _WORSE) -> bool:
    """Whether the errors of 5 s predictions of all that is read are below so many times those.

    Where nothing was held out, nothing was predicted.
    """
    shares = _shares(alone, after)
    return bool(shares) and max(shares) < times


def far_further(alone: Sequence[Judged], after: Sequence[Judged]) -> bool:
    """Whether the 5 s predictions of all that is read are far further off."""
    shares = _shares(alone, after)
    return bool(shares) and min(shares) > _FAR_WORSE


def _far_nearer(alone: Sequence[Judged], after: Sequence[Judged]) -> bool:
    """Whether of the 5 s predictions of all that is read none is further and one is far nearer.

    What is within the noise already comes no nearer.
    """
    return _as_near(alone, after, 1.0) and min(_shares(alone, after)) < _FAR_BETTER


def _shares(alone: Sequence[Judged], after: Sequence[Judged]) -> list[float]:
    """Errors of 5 s predictions of what is read, over those of before."""
    if not after:
        return []
    pairs = [(rms(after, "short", i), rms(alone, "short", i)) for i in range(2)]
    read = [(a, b) for a, b in pairs if math.isfinite(b)]
    return [a / b if b > 0.0 and math.isfinite(a) else math.inf for a, b in read]


def judged(
    found: Found, base_setting: Setting, base: Fit, held: Sequence[Samples]
) -> tuple[Found, tuple[Judged, ...], tuple[Judged, ...]]:
    """Judge before and after; a term that does not help on held-out recordings is dropped."""
    before = tuple(judge(s, base_setting, base) for s in held)
    found, after = _named_or_not(found, before, held)
    found, after = _next_name(found, before, after, held)
    # Which counts will be lost in other recordings, lost counts do not tell.
    while held and found.final.terms and not isinstance(found.final.terms[-1].source, Slips):
        fewer = trimmed(found)
        alone = tuple(judge(s, fewer.setting, fewer.final) for s in held)
        if _stays(found, fewer, alone, after) and not _makes_up(found, before, alone, after):
            break
        if len(found.final.terms) == 1 and _spoken_against(found, before, after):
            break
        found, after = fewer, alone
    if held and _spoken_against(found, before, after):
        found, after = _given_up(found, held)
    return found, before, after
