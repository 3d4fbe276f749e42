"""What held-out recordings say of the candidates that were fitted by the filter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.diagnosis.declare import extended_rig
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.held_out import followed, offset_of
from drill_env.diagnosis.rounds import Attempt, Round, is_named, place_of
from drill_env.diagnosis.slips import Slips
from drill_env.diagnosis.strikes import Once
from drill_env.diagnosis.terms import Named, with_terms
from drill_env.effects.along import Motion
from drill_env.identification.samples import Samples
from drill_env.integrator.windows import Windows
from drill_env.prediction.compare import Row, row_of
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.likelihood import FAR, log_density, scales
from drill_env.prediction.rule import Choice, Entrant, chosen

# Leads in sampling intervals and s; windows begin each half second, and those that begin within
# one length of a window are one.
_FIRST, _LAST, _LEADS = 4.0, 5.0, 7
_EACH = 0.5
# Attempts of a round that are judged.
_NAMES, _SHAPES = 5, 3


@dataclass(frozen=True, slots=True, eq=False)
class Unseen:
    """One round of the search by the prediction of held-out recordings.

    Attributes:
        choice: what the rule takes.
        entrants: what was judged.
        attempts: the fits of these, by their ids.
        leads: s, shape (k,).
    """

    choice: Choice
    entrants: tuple[Entrant, ...]
    attempts: dict[str, Attempt]
    leads: FloatArray

    @property
    def taken(self) -> Attempt | None:
        """The fit that the rule takes."""
        return None if self.choice.chosen is None else self.attempts[self.choice.chosen.id]


def unseen_of(
    setting: Setting, found: Round, held: Sequence[Samples], criteria: Criteria
) -> Unseen:
    """Judge the attempts of a round by windows of held-out recordings.

    A window begins in the motion that the candidate's own filter and smoother tell, its inner
    states among it, and runs on without correction and without the latent torques. The scale of
    the errors at each lead is that of the fitted recordings.

    Args:
        setting: of the search.
        found: one round.
        held: recordings that were not fitted.
        criteria: of the decision.
    """
    every = [*setting.samples, *held]
    interval = max(float(np.median(np.diff(s.t))) for s in every)
    last = min(_LAST, 0.1 * sum(float(s.t[-1]) for s in held))
    leads = np.geomspace(_FIRST * interval, max(last, 10.0 * interval), _LEADS)
    before, marks = _scores(setting, found.before, held, leads, criteria)
    entrants, attempts = [], {}
    names = [a for a in found.named if not isinstance(a.term.source, (Slips, Once))][:_NAMES]
    for attempt in (*names, *found.shapes[:_SHAPES]):
        after, _ = _scores(setting, attempt.fit, held, leads, criteria)
        numbers = len(attempt.term.q)
        row = row_of(attempt.term.id, numbers, after - before, marks)
        entrants.append(_entrant(attempt, row))
        attempts[attempt.term.id] = attempt
    return Unseen(chosen(entrants, criteria), tuple(entrants), attempts, leads)


def _entrant(attempt: Attempt, row: Row) -> Entrant:
    source, named = attempt.term.source, is_named(attempt.term)
    component, depends_on = place_of(attempt.term)
    common = isinstance(source, Named) and source.effect.common
    return Entrant(attempt.term.id, component, depends_on, named, common, True, row)


def _scores(
    setting: Setting, fit: Fit, held: Sequence[Samples], leads: FloatArray, criteria: Criteria
) -> tuple[FloatArray, list[int]]:
    """Log density of blocks of windows at each lead (b, k), and each block's recording."""
    fitted = zip(setting.samples, fit.motions, strict=True)
    known = [
        _errors(s, with_terms(s, fit.terms, fit.rig, motion), motion, fit, leads)
        for s, motion in fitted
    ]
    size = scales(np.concatenate(known), criteria.degrees)
    judged = []
    for s in held:
        motion, given, _ = followed(s, setting, fit)
        judged.append(_errors(s, given, motion, fit, leads))
    blocks, marks = [], []
    count = max(round(float(leads[-1]) / _EACH), 1)
    for mark, errors in enumerate(judged):
        density = log_density(errors, size, criteria.degrees)
        for first in range(0, max(len(density) - count, 0) + 1, count):
            blocks.append(density[first : first + count].mean(axis=0))
            marks.append(mark)
    return np.array(blocks), marks


def _errors(
    samples: Samples, given: Samples, motion: Motion, fit: Fit, leads: FloatArray
) -> FloatArray:
    """Predicted less read, rad, of windows that begin each half second; shape (w, k, 2).

    Args:
        samples: as they were read.
        given: the same without what the fit says is misread: the encoders' offset is theirs.
        motion: told by them.
        fit: what predicts.
        leads: s, shape (k,).
    """
    starts, rows = _rows(samples, leads)
    offset = offset_of(given, motion.states)[starts]
    windows = Windows(motion, starts, rows, as_read=False)
    try:
        predicted = windows.predicted(extended_rig(fit.rig, fit.terms))[..., :2]
    except (InputError, RuntimeError):
        return np.full((len(starts), len(leads), 2), FAR)
    predicted[..., 0] -= offset[:, np.newaxis]
    gap = predicted - samples.angles[rows][..., :2]
    gap = np.where(np.isnan(samples.angles[rows][..., :2]), 0.0, gap)
    return np.where(np.isfinite(gap), np.clip(gap, -FAR, FAR), FAR)


def _rows(samples: Samples, leads: FloatArray) -> tuple[IntArray, IntArray]:
    t = samples.t
    edges = [*samples.restarts.tolist(), len(t)]
    starts: list[int] = []
    for a, b in zip(edges, edges[1:], strict=False):
        begins = np.arange(float(t[a]), float(t[b - 1]) - leads[-1] * 1.01, _EACH)
        starts += np.searchsorted(t, begins).tolist()
    first = np.array(starts[1:] if len(starts) > 1 else starts, dtype=np.int64)
    rows = np.searchsorted(t, t[first][:, np.newaxis] + leads - 1e-9)
    return first, np.minimum(rows, len(t) - 1)
