"""Intervals of what was found: the numbers of effects, and of the rig."""

from __future__ import annotations

import math

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.result import Change, Number
from drill_env.diagnosis.terms import Named, Shape, Term
from drill_env.identification.coordinates import inverse
from drill_env.parameters import Rig

Z_95 = 1.959964
# Logarithm beyond which a ratio tells nothing any more.
_MOST_LOG = 50.0


def numbers_of(fit: Fit, term: Term, scale: float = 0.0) -> dict[str, Number]:
    """The numbers of a named term with their 95 % intervals.

    Args:
        fit: with the term.
        term: of it.
        scale: relative standard deviation of the scale of torque, which angles do not tell.
    """
    if isinstance(term.source, Shape):
        return {}
    out = {}
    told = zip(term.q.tolist(), _deviations(fit, term), _ends(fit, term), strict=True)
    for p, (value, s, ends) in zip(term.source.effect.parameters, told, strict=True):
        s = math.hypot(s, scale * value) if "Nm" in p.unit else s
        s = math.hypot(s, p.form * value) if p.role != "phase" else s
        below, above = (max(Z_95 * s, end) for end in ends.tolist())
        low, high = value - below, value + above
        if low <= 0.0 <= p.low < value:
            # What is never negative is normal in its logarithm rather than in itself.
            low = value / math.exp(min(below / value, _MOST_LOG))
            high = value * math.exp(min(above / value, _MOST_LOG))
        out[p.name] = Number(value, low, high, p.unit)
    return out


def _ends(fit: Fit, term: Term) -> FloatArray:
    """How far profiles reach below and above a term's numbers; 0 where there are none."""
    if fit.ends is None:
        return np.zeros((len(term.q), 2))
    place = sum(len(t.q) for t in fit.terms[: [t is term for t in fit.terms].index(True)])
    return fit.ends[place : place + len(term.q)]


def _deviations(fit: Fit, term: Term) -> FloatArray:
    """Standard deviations of a term's numbers in a fit."""
    place = len(fit.vector)
    for other in fit.terms:
        if other is term:
            break
        place += len(other.q)
    variances = np.diag(inverse(fit.information))[place : place + len(term.q)]
    return np.sqrt(np.maximum(variances, 0.0))


def sized(fit: Fit, term: Term) -> bool:
    """Whether every size of a named term is above 0 by its standard deviation.

    Where none is, the likelihood without the term still may tell that there is one: far from a
    peak that no number determines it is not what the deviation says.

    Args:
        fit: with the term.
        term: of it.
    """
    if not isinstance(term.source, Named):
        return True
    pairs = zip(term.source.effect.parameters, term.q, _deviations(fit, term), strict=True)
    sizes = [(abs(value), s) for p, value, s in pairs if p.role == "amplitude"]
    return all(value > Z_95 * s for value, s in sizes)


def changes(
    setting: Setting, fit: Fit, start: Rig, draws: int = 400, seed: int = 0
) -> dict[str, Change]:
    """What was fitted of the rig before and after, with its 95 % intervals."""
    free = len(fit.vector)
    covariance = inverse(fit.information)[:free, :free]
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    rng = np.random.default_rng(seed)
    moved = fit.vector + rng.standard_normal((draws, free)) @ root.T
    cloud = setting.coordinates.many_values(moved)
    low, high = np.quantile(cloud, [0.025, 0.975], axis=0)
    names, known = setting.coordinates.names, setting.coordinates.given
    before = {name: float(getattr(start, name)) for name in setting.coordinates.free}
    before |= {one.label: one.value for one in known}
    after = setting.coordinates.many_values(fit.vector[None])[0]
    told = zip(names, after.tolist(), low.tolist(), high.tolist(), strict=True)
    return {name: Change(before[name], value, a, b) for name, value, a, b in told}


def significant(changed: dict[str, Change], share: float = 0.02) -> list[str]:
    """Parameters whose interval leaves out the value before, by more than a share of it."""
    out = []
    for name, change in changed.items():
        outside = not change.low <= change.before <= change.high
        if outside and abs(change.after - change.before) > share * max(abs(change.before), 1e-9):
            out.append(name)
    return out
