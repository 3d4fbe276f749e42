"""Counts that an encoder lost at single moments: steps of its reading."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.linearised import Known, Linearised
from drill_env.diagnosis.terms import Shape, Term
from drill_env.effects.along import Motion
from drill_env.identification.samples import Samples
from drill_env.identification.smoothing import slopes_of, smoothed
from drill_env.parameters import Rig

_CERTAIN = 6.0
_MOST = 24
_APART = 40
_PROBES = 6
_LEAST = 2.0
# So few steps must each be as near to a whole count.
_FEW, _WHOLE = 2, 0.3
_ENCODERS = ("upper", "lower")


@dataclass(frozen=True, slots=True)
class LostCounts(Shape):
    """Steps of one encoder at single rows of single recordings, as a source of terms."""

    def steps(self, q: FloatArray) -> FloatArray:
        """Any will do: it is linear."""
        return np.ones_like(q)


@dataclass(frozen=True, slots=True)
class _Where:
    """A step: the fingerprint of its recording, and its row."""

    recording: int
    row: int


def slips(linearised: Linearised, encoder: int) -> tuple[Term, float] | None:
    """Steps that an encoder's readings seem to take, and the gain they promise.

    Args:
        linearised: a fit with its innovations.
        encoder: 0 for theta_u, 1 for theta_l.
    """
    noise = linearised.fit.noise
    places: list[_Where] = []
    sizes: list[float] = []
    gain = 0.0
    for known in linearised.known:
        told = smoothed(known.samples, noise, known.path).misread
        # A lower angle that was made of the upper one steps along with it.
        both = known.samples.relative and encoder == 0
        misread = told[:, :2].sum(axis=1) if both else told[:, encoder]
        n = len(misread)
        # A step from a row on misreads all rows after it.
        score = np.cumsum(misread[::-1])[::-1]
        information = _information(linearised, known, encoder, n)
        z = score / np.sqrt(information) / np.sqrt(linearised.dispersion)
        z[:_APART] = 0.0
        left = np.abs(z)
        found: list[int] = []
        while len(found) < _MOST:
            row = int(np.argmax(left))
            if left[row] < _CERTAIN:
                break
            found.append(row)
            left[max(row - _APART, 0) : row + _APART] = 0.0
        if not found:
            continue
        q, won = _sizes(linearised, known, encoder, found, n)
        # Less than two counts is what rounding, ringing and friction do too.
        least = _LEAST * _count(known, encoder)
        found = [row for row, size in zip(found, q, strict=True) if abs(size) > least]
        if not found:
            continue
        q, won = _sizes(linearised, known, encoder, found, n)
        places += [_Where(known.motion.recording, row) for row in found]
        sizes += q
        gain += won
    if not places:
        return None
    source = LostCounts(
        f"missed_counts_{_ENCODERS[encoder]}", "sensor", f"omega_{'ul'[encoder]}", "error",
        tuple(float(i) for i in range(len(places))), _basis(tuple(places), encoder),
    )  # fmt: skip
    return Term(source, np.array(sizes)), gain / linearised.dispersion


def broken_counts(term: Term, samples: Sequence[Samples]) -> bool:
    """Whether a few steps are no whole counts, which is all that an encoder can lose.

    Where there are many, their number tells enough: noise may move one of them by half a count.

    Args:
        term: of a fit.
        samples: of its recordings.
    """
    if not isinstance(term.source, LostCounts) or len(term.q) > _FEW:
        return False
    key = "theta_l" if term.id.endswith("lower") else "theta_u"
    count = float(np.median([s.recording.quanta.get(key, 0.0) for s in samples]))
    steps = np.abs(term.q) / count if count > 0.0 else np.zeros(0)
    return bool(np.any(np.abs(steps - np.round(steps)) > _WHOLE))


def _count(known: Known, encoder: int) -> float:
    key = "theta_l" if encoder else "theta_u"
    return known.samples.recording.quanta.get(key, 0.0)


def _columns(rows: list[int], encoder: int, n: int) -> FloatArray:
    errors = np.zeros((n, 2, len(rows)))
    for i, row in enumerate(rows):
        errors[row:, encoder, i] = 1.0
    return errors


def _information(linearised: Linearised, known: Known, encoder: int, n: int) -> float:
    rows = np.linspace(0.2 * n, 0.8 * n, _PROBES).astype(int).tolist()
    columns = slopes_of(
        known.samples, linearised.fit.noise, known.path, np.zeros((n, 2, len(rows))),
        _columns(rows, encoder, n),
    )  # fmt: skip
    return float(np.median((columns**2).sum(axis=(0, 1)))) + 1e-300


def _sizes(
    linearised: Linearised, known: Known, encoder: int, rows: list[int], n: int
) -> tuple[list[float], float]:
    columns = slopes_of(
        known.samples, linearised.fit.noise, known.path, np.zeros((n, 2, len(rows))),
        _columns(rows, encoder, n),
    )[known.used]  # fmt: skip
    q = np.linalg.lstsq(columns, known.white, rcond=1e-10)[0]
    return q.tolist(), float(q @ (columns.T @ known.white))


def _basis(
    places: tuple[_Where, ...], encoder: int
) -> Callable[[Rig, Motion], tuple[FloatArray | None, FloatArray | None]]:
    def basis(rig: Rig, motion: Motion) -> tuple[FloatArray | None, FloatArray | None]:
        errors = np.zeros((len(motion.t), 2, len(places)))
        for i, place in enumerate(places):
            if place.recording == motion.recording:
                errors[place.row :, encoder, i] = 1.0
        return None, errors

    return basis
