"""Stretches of an axis' recordings in which its model fails, far beyond what its noise can do.

Student's t, by which models are compared, makes nothing of errors that are far from all others: a
model may be wrong whenever something acts, and be taken for right as it mostly does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from drill_env._types import BoolArray, FloatArray, IntArray
from drill_env.diagnosis.window_residual import ahead_of, short_errors
from drill_env.prediction.cut import Cut
from drill_env.prediction.fit import Fit
from drill_env.prediction.likelihood import scales

# Chance that a model whose errors have Student's t fails anywhere: one false alarm in twenty.
_CHANCE = 0.05


@dataclass(frozen=True, slots=True)
class Stretches:
    """Where a model fails.

    Attributes:
        intervals: first and last times, s, of each stretch, by recording.
        largest: error there in usual ones.
    """

    intervals: dict[str, list[tuple[float, float]]]
    largest: float


def failing_stretches(fit: Fit, fitted: Sequence[Cut], unseen: Sequence[Cut]) -> Stretches | None:
    """Stretches that hold nearly all of the squared error of short predictions.

    In each the model errs the same way and by more than Student's t gives in so many windows, for
    longer than a reading or a clock that jumps: these touch the windows whose start they tell.
    There must be some in fitted and in unseen recordings, or it happened once.

    Args:
        fit: with what was found.
        fitted: recordings.
        unseen: recordings.
    """
    criteria, ahead = fit.setting.criteria, ahead_of(fit)
    read = [(one, *short_errors(fit, one)) for one in (*fitted, *unseen)]
    moved = [_moved(one, middle, ahead) for one, middle, _ in read]
    every = np.concatenate([errors[m] for (*_, errors), m in zip(read, moved, strict=True)])
    if not len(every):
        return None
    size = _scale(every, criteria.degrees)
    bound = float(stats.t.isf(0.5 * _CHANCE / len(every), criteria.degrees))
    found, failed, largest = {}, 0.0, 0.0
    for one, middle, errors in read:
        far = np.abs(errors) > bound * size
        t = one.windows.motion.t[middle]
        runs = _lasting(np.sign(errors) * far, t, ahead, 2.0 * one.width + ahead)
        for a, b in runs:
            failed += float(errors[a:b] @ errors[a:b])
            largest = max(largest, float(np.abs(errors[a:b]).max()) / size)
        found[one.samples.recording.source] = [
            (float(t[a]) - 0.5 * ahead, float(t[b - 1]) + 0.5 * ahead) for a, b in runs
        ]
    sides = [any(found[c.samples.recording.source] for c in group) for group in (fitted, unseen)]
    if not all(sides) or failed < criteria.share * sum(float(e @ e) for *_, e in read):
        return None
    return Stretches({name: told for name, told in found.items() if told}, largest)


def _scale(errors: FloatArray, degrees: float) -> float:
    return float(scales(errors[:, np.newaxis, np.newaxis], degrees)[0, 0])


def _moved(one: Cut, middle: IntArray, ahead: float) -> BoolArray:
    """Windows in which a counting encoder counted: a rest is predicted without any error."""
    t, angle = one.windows.motion.t, one.samples.angles[:, 0]
    ends = [np.searchsorted(t, t[middle] + side * ahead) for side in (-0.5, 0.5)]
    first, last = (angle[np.minimum(rows, len(t) - 1)] for rows in ends)
    return np.asarray(first != last)


def _lasting(
    signs: FloatArray, t: FloatArray, step: float, longest: float
) -> list[tuple[int, int]]:
    """Runs of one sign, without a gap, that take longer than a time."""
    apart = (np.diff(signs) != 0.0) | (np.diff(t) > 1.5 * step)
    edges = [0, *(np.flatnonzero(apart) + 1).tolist(), len(signs)]
    runs = zip(edges, edges[1:], strict=False)
    return [(a, b) for a, b in runs if signs[a] and (b - a) * step > longest]
