"""Whether the motion predicts what a model leaves of an axis' readings, by whatever formula."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.diagnosis.learners import known_of, share_of
from drill_env.diagnosis.repetition import Repetition, Residual, repetition_of
from drill_env.diagnosis.residual_torque import PREDICTABLE
from drill_env.diagnosis.shapes import COORDINATES
from drill_env.prediction.cut import Cut, cut
from drill_env.prediction.fit import Fit

_OF_AN_AXIS = ("time", "voltage", "theta_u", "omega_u")
"""Coordinates of one inertia."""


def share_removed(before: Fit, after: Fit, cuts: Sequence[Cut]) -> float:
    """Share of the predictable error of short predictions that was removed.

    Over a tenth of a second an error is a torque. What is predicted of it in recordings that were
    not learnt from, something else than noise gave.

    Args:
        before: the rig alone, fitted.
        after: with what was found.
        cuts: all recordings.

    Returns:
        1 where hardly anything of it is predictable after, 0 where no less is.
    """
    share, square = _predictable(after, cuts)
    if share < PREDICTABLE:
        return 1.0
    whole = _predictable(before, cuts)[1]
    return 1.0 - square / whole if square < whole else 0.0


def left_predictable(fit: Fit, cuts: Sequence[Cut]) -> dict[str, Any]:
    """What is predictable of the error of short predictions where nothing was found.

    Args:
        fit: of the rig alone.
        cuts: all recordings.

    Returns:
        `predictable`, its share, and `predictable_from`, the coordinate that alone predicts most,
        with its past; nothing where hardly anything is.
    """
    shares = _shares_of([short_errors(fit, one) for one in cuts], fit, cuts)
    share = max(shares.values())
    if share < PREDICTABLE:
        return {}
    best = max(filter(None, shares), key=lambda name: shares[name])
    return {"predictable": share, "predictable_from": best}


def left_repeating(fit: Fit, fitted: Sequence[Cut], unseen: Sequence[Cut]) -> Repetition | None:
    """What repeats in time in the error of short predictions where nothing was found.

    Args:
        fit: of the rig alone.
        fitted: recordings.
        unseen: recordings.
    """
    groups = [[_as_torque(fit, one) for one in group] for group in (fitted, unseen)]
    return repetition_of(*groups, driven=True)


def _as_torque(fit: Fit, one: Cut) -> Residual:
    """The torque, Nm, that makes the error of each short window if it is held."""
    middle, errors = short_errors(fit, one)
    motion = one.windows.motion
    return Residual(
        motion.t[middle], 2.0 * fit.rig.Ju * errors / ahead_of(fit) ** 2, motion.u[middle]
    )


def ahead_of(fit: Fit) -> float:
    """How far ahead a short prediction goes, s."""
    criteria = fit.setting.criteria
    return criteria.leads[0] * criteria.horizons[0]


def _predictable(fit: Fit, cuts: Sequence[Cut]) -> tuple[float, float]:
    """Share of the errors' squares that is predicted, and how much that is, rad^2."""
    pairs = [short_errors(fit, one) for one in cuts]
    share = max(_shares_of(pairs, fit, cuts).values())
    return share, max(share, 0.0) * float(np.mean(np.concatenate([e for _, e in pairs]) ** 2))


def _shares_of(
    pairs: Sequence[tuple[IntArray, FloatArray]], fit: Fit, cuts: Sequence[Cut]
) -> dict[str, float]:
    """Share of the errors' squares that each coordinate predicts with its past, and all together.

    Windows are few: of what is a function of one coordinate the others hide a part.
    """
    rows, errors = [rows for rows, _ in pairs], [e for _, e in pairs]
    motions = [one.windows.motion for one in cuts]
    # Windows are sparse, so their motion is taken at their middles.
    names = list(COORDINATES) if fit.rig.inertias == 2 else list(_OF_AN_AXIS)
    sets = {**{name: [name] for name in names}, "": names}
    return {
        key: share_of([known_of(of, m).at(at) for m, at in zip(motions, rows, strict=True)], errors)
        for key, of in sets.items()
    }


def short_errors(fit: Fit, one: Cut) -> tuple[IntArray, FloatArray]:
    """Errors of short predictions.

    Args:
        fit: of the rig.
        one: recording.

    Returns:
        The row in the middle of each short window, and its error, rad; both of shape (w,).
    """
    rig, shift = fit.rig, float(fit.vector[-1])
    motion, pulled = one.windows.motion, one.lower is not None
    short = cut(one.samples, motion, rig, np.array([ahead_of(fit)]), pulled=pulled)
    short = short.begun(one.width, rig, shift)
    middle = (short.windows.starts + short.windows.rows[:, -1]) // 2
    return middle, short.errors(rig, shift)[:, -1, 0]
