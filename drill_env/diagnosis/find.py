"""One search after another: what a rig lacks, until nothing more is believed in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from drill_env._watch import Report, over_by
from drill_env.diagnosis.attempts import refitted_alone, restated
from drill_env.diagnosis.base import cleaned_base
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.in_filter import within_filter
from drill_env.diagnosis.rivals import against_rivals, at_limits, refined, with_rival_shape
from drill_env.diagnosis.rounds import BELIEVED, NEEDED_BESIDE, Found, Round, nameless
from drill_env.diagnosis.search import search
from drill_env.effects import Effect
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig


def find(
    samples: Sequence[Samples], rig: Rig, free: Sequence[str], effects: Sequence[Effect],
    *, most: int = 2, doubt: float = 0.05, report: Report = lambda text: None,
) -> Found:  # fmt: skip
    """Fit the rig, then look for what it lacks.

    Args:
        samples: recordings.
        rig: where to start.
        free: names of its free parameters.
        effects: the library.
        most: effects that are looked for.
        doubt: relative standard deviation of the rig's parameters around the start.
        report: told what is being done.
    """
    setting, base = cleaned_base(samples, rig, free, doubt, report)
    return find_beside(setting, base, effects, most, report)


def find_beside(
    setting: Setting, base: Fit, effects: Sequence[Effect], most: int, report: Report,
    named: Callable[[], None] = lambda: None,
) -> Found:  # fmt: skip
    """Look for what a fitted rig lacks.

    Args:
        setting: recordings and free parameters.
        base: the rig alone, fitted.
        effects: the library.
        most: effects that are looked for.
        report: told what is being done.
        named: called once a name leads.
    """
    setting = replace(setting, over=over_by(report))
    here, base, rounds = _sought(setting, base, effects, most, report, named)
    terms = len(here.terms)
    if terms and not report("asking again what was found first"):
        here, rounds = against_rivals(setting, here, rounds)
        here = at_limits(setting, here, effects)
    if terms > len(here.terms) == 1:
        rounds = [restated(rounds[0], here)]
    here = within_filter(setting, here, report)
    return Found(setting, base, tuple(rounds), here)


def _sought(
    setting: Setting, base: Fit, effects: Sequence[Effect], most: int, report: Report,
    named: Callable[[], None],
) -> tuple[Fit, Fit, list[Round]]:  # fmt: skip
    """Look for one effect after another.

    Returns:
        The fit with all names, the rig alone, and the rounds of the search.
    """
    here, rounds = base, []
    # A step of an encoder that was overlooked is no other effect and takes no effect's place.
    while len(there := {term.id for term in here.terms}) < most and len(rounds) <= most:
        if rounds and report("looking for more"):
            break
        found = search(setting, here, effects, report, more=len(there) + 1 < most)
        if rounds:
            report("choosing")
            if not found.complete:
                # Beside a name another is a claim too many while not everything was tried.
                break
        if not rounds:
            found = refitted_alone(setting, found)
            here = base = found.before
        rounds.append(found)
        needed = NEEDED_BESIDE if here.terms else BELIEVED
        chosen = found.named[0] if found.named else None
        if chosen is None or chosen.criterion < needed:
            break
        first = not here.terms
        rounds[-1], here = refined(setting, found, effects, report)
        rounds[-1] = with_rival_shape(setting, rounds[-1], here)
        if first and nameless(rounds[-1]):
            # Beside what a free shape explains far better no second name is worth a search.
            break
        if first:
            named()
    return here, base, rounds
