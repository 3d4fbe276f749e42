"""A resonance's frequency sought by the likelihood itself: descents end on the wrong peak."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.terms import Named, Term

_NUMBERS = ("frequency", "damping")
_REACH = 0.4
# Frequencies tried on either side: 5 % apart; at 10 % the rig followed past a little damped peak.
_TRIED = 8
_ROUNDS, _STEPS = 2, 10


def resonates(term: Term) -> bool:
    """Whether a term has a frequency and a damping and nothing else."""
    source = term.source
    return isinstance(source, Named) and (
        tuple(p.name for p in source.effect.parameters) == _NUMBERS
    )


def retuned(setting: Setting, fit: Fit) -> Fit:
    """The fit with the frequency of its last term where the likelihood is best.

    A peak may show only after the rig has followed, so the profile likelihood is walked along. One
    as wide as the walk, by its half-power band of twice the damping ratio (Den Hartog, Mechanical
    Vibrations, 1956, ch. 2), has been seen by the descent.

    Args:
        setting: recordings and free parameters.
        fit: whose last term resonates.
    """
    if 2.0 * fit.terms[-1].q[_NUMBERS.index("damping")] >= _REACH:
        return fit
    for _ in range(_ROUNDS):
        tried = (one for side in (-1.0, 1.0) for one in _along(setting, fit, side))
        start = min(tried, key=lambda f: f.value)
        best = descend_jointly(setting, start, limit=_STEPS, enough=1.0)
        if best.value >= fit.value:
            break
        fit = best
    return fit


def _along(setting: Setting, fit: Fit, side: float) -> Iterator[Fit]:
    """Fits at one frequency after another, each begun from the one before."""
    share = np.array([math.exp(side * _REACH / _TRIED), 1.0])
    for _ in range(_TRIED):
        last = replace(fit.terms[-1], q=share * fit.terms[-1].q)
        moved = evaluate(
            setting, fit.vector, (*fit.terms[:-1], last), fit.noise, fit.starts, fit.motions
        )
        fit = descend_jointly(setting, moved, limit=2, enough=1.0)
        yield fit
