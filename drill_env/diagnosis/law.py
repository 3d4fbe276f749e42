"""Whether the recordings ask for the humped friction law in place of a simpler one."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass

from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.held_out import remaining
from drill_env.diagnosis.joint import polished
from drill_env.diagnosis.remainder import PREDICTABLE, Latent, remainder_of
from drill_env.diagnosis.rounds import NEEDED, Found
from drill_env.diagnosis.search import base_fit, find
from drill_env.effects import Effect
from drill_env.identification.coordinates import active_names
from drill_env.identification.samples import Samples
from drill_env.parameters import SYMBOLS, Rig

_LOWER = ("Tsl", "T1", "T2", "beta1", "beta2", "bl")


@dataclass(frozen=True, slots=True, eq=False)
class LawFit:
    """A search with the humped law.

    Attributes:
        setting: of the fit before.
        before: the rig with its own law, fitted.
        found: the search with the humped law.
        gain: of the information criterion over the search with its own law.
    """

    setting: Setting
    before: Fit
    found: Found
    gain: float


def law_fit(
    samples: Sequence[Samples], rig: Rig, plain: Found, effects: Sequence[Effect], most: int,
    report: Callable[[str], None], doubt: float = 0.05, fixed: Container[str] = (),
) -> LawFit | None:  # fmt: skip
    """The search with the humped law, or None where the rig's own law does as well.

    Args:
        samples: recordings.
        rig: the given one, with a simpler law.
        plain: the search with it.
        effects: the library.
        most: effects that are looked for.
        report: told what is being done.
        doubt: relative standard deviation of the rig's parameters around the start.
        fixed: parameters that are held as given.
    """
    paper, freed = Rig.paper(), [name for name in _LOWER if name not in fixed]
    humped = rig.replace(friction="humped", **{name: getattr(paper, name) for name in freed})
    kept = {*plain.setting.coordinates.free, *freed}
    free = [n for n in SYMBOLS if n in active_names(humped) & kept]
    # The two laws have not the same parameters, which the criterion of one rig leaves out.
    more = len(free) - len(plain.setting.coordinates.free)
    price = more * math.log(max(plain.final.count, 2))
    if not _asked_for(humped, free, plain, doubt, price):
        return None
    found = find(samples, humped, free, effects, most=most, doubt=doubt, report=report)
    gain = plain.final.bic - found.final.bic - price
    return LawFit(plain.setting, plain.base, found, gain) if gain >= NEEDED else None


def _asked_for(humped: Rig, free: Sequence[str], plain: Found, doubt: float, price: float) -> bool:
    """Whether the law does better beside what was found, or that leaves something predictable.

    A search of its own takes several times as long as this.
    """
    fit, before = plain.final, plain.setting
    left = remainder_of([Latent(*remaining(s, before, fit)) for s in before.samples])
    if max(left.shares) > PREDICTABLE:
        return True
    setting, alone = base_fit(before.samples, humped, free, doubt)
    if fit.terms:
        here = evaluate(setting, alone.vector, fit.terms, fit.noise, fit.starts, fit.motions)
        alone = polished(setting, here)
    return fit.bic - alone.bic > price
