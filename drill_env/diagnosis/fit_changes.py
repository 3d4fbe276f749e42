"""From one fit to another: a term more or less, other motions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.extended import evaluate, lost_value, motion_of
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.terms import Term, corrected
from drill_env.effects.along import Motion
from drill_env.identification.prediction_error import path_of, value_of
from drill_env.identification.samples import Samples


def with_new_motions(setting: Setting, here: Fit) -> Fit:
    """The point with its motions told by the filter with the terms."""
    jobs = list(zip(setting.samples, here.starts, here.motions, strict=True))

    def again(job: tuple[Samples, FloatArray, Motion]) -> Motion:
        given = with_terms(job[0], here.terms, here.rig, job[2])
        path = path_of(given, here.rig, here.noise, job[1], setting.robust)
        return motion_of(given, here.noise, path)

    motions = each(again, jobs)
    return evaluate(setting, here.vector, here.terms, here.noise, here.starts, motions)


def moved_starts(setting: Setting, here: Fit, term: Term) -> list[FloatArray]:
    """The starts when the first readings were misread as a term says."""
    starts = []
    for samples, start, motion in zip(setting.samples, here.starts, here.motions, strict=True):
        # What is read in a row is decided by what was before it.
        end = int(samples.restarts[-1]) + 2
        error = np.zeros((len(motion.t), 2))
        error[:end] = term.source.response(term.q, here.rig, motion.until(end))[1]
        error = samples.misread(error)[samples.restarts]
        moved = start.copy()
        moved[:, 0] -= error[:, 0] - error[:, 1]
        moved[:, 3] -= error[:, 1]
        starts.append(moved)
    return starts


def added(setting: Setting, here: Fit, term: Term) -> Fit:
    """The point with one more term."""
    here = replace(here, motions=tuple(corrected(term, m) for m in here.motions))
    starts = moved_starts(setting, here, term)
    return evaluate(setting, here.vector, (*here.terms, term), here.noise, starts, here.motions)


def own_values(setting: Setting, here: Fit) -> list[float]:
    """Minus twice the log likelihood of each recording at a fit."""
    jobs = list(zip(setting.samples, here.starts, here.motions, strict=True))

    def one(job: tuple[Samples, FloatArray, Motion]) -> float:
        given = with_terms(job[0], here.terms, here.rig, job[2])
        return value_of(given, here.rig, here.noise, job[1], setting.robust)

    return each(one, jobs)


def gain_of(setting: Setting, here: Fit, term: Term, own: Sequence[float] | None = None) -> float:
    """Fall of minus twice the log likelihood when a term joins and all else stays.

    Args:
        setting: recordings.
        here: where the term joins.
        term: what joins.
        own: of `own_values`, where many terms are tried.
    """
    own = own or own_values(setting, here)
    here = replace(here, motions=tuple(corrected(term, m) for m in here.motions))
    starts = moved_starts(setting, here, term)

    def change(job: tuple[Samples, float, FloatArray, Motion]) -> float:
        samples, old, new, motion = job
        after = with_terms(samples, (*here.terms, term), here.rig, motion)
        value = value_of(after, here.rig, here.noise, new, setting.robust)
        count = int(np.isfinite(after.angles).sum())
        return old - value - lost_value(samples, after, value, count)

    jobs = list(zip(setting.samples, own, starts, here.motions, strict=True))
    total = sum(each(change, jobs))
    return total if math.isfinite(total) else -math.inf


def without(setting: Setting, here: Fit, place: int) -> Fit:
    """The point with one term fewer."""
    terms = tuple(t for i, t in enumerate(here.terms) if i != place)
    return evaluate(setting, here.vector, terms, here.noise, here.starts, here.motions)
