"""A resonance's frequency sought by the likelihood itself: descents end on the wrong peak."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from drill_env.diagnosis.extended import evaluate, value_at
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.terms import Named, Term

_NUMBERS = ("frequency", "damping")
_REACH = 0.4
# A little damped peak is narrow and shows late, a much damped one leads there from afar.
_SHARP, _BROAD = (0.004, 121), (0.05, 21)
_ROUNDS, _STEPS = 2, 10


def resonates(term: Term) -> bool:
    """Whether a term has a frequency and a damping and nothing else."""
    source = term.source
    return isinstance(source, Named) and (
        tuple(p.name for p in source.effect.parameters) == _NUMBERS
    )


def retuned(setting: Setting, fit: Fit) -> Fit:
    """The fit with the frequency of its last term where the likelihood is best.

    All else stays while frequencies are tried, sharp and broad, and follows from the best of each.

    Args:
        setting: recordings and free parameters.
        fit: whose last term resonates.
    """
    for _ in range(_ROUNDS):
        fits = [
            descend_jointly(setting, start, limit=_STEPS, enough=1.0)
            for start in _starts(setting, fit)
        ]
        best = min(fits, key=lambda f: f.value)
        if best.value >= fit.value:
            break
        fit = best
    return fit


def _starts(setting: Setting, fit: Fit) -> Iterator[Fit]:
    last = fit.terms[-1]
    for damping, count in (_SHARP, _BROAD):
        tried = [
            replace(last, q=np.array([last.q[0] * share, damping]))
            for share in np.exp(np.linspace(-_REACH, _REACH, count)).tolist()
        ]
        at = (fit.noise, fit.starts, fit.motions)
        values = [value_at(setting, fit.vector, (*fit.terms[:-1], t), *at) for t in tried]
        best = tried[int(np.argmin(values))]
        yield evaluate(setting, fit.vector, (*fit.terms[:-1], best), *at)
