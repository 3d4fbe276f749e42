"""First look at every candidate: what it would gain to first order at a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.parameters import Rig
from drill_env.prediction.candidate import Candidate
from drill_env.prediction.fit import Fit, errors_of_each, slopes
from drill_env.prediction.likelihood import weights

# Of a usual size, by which an error is differenced.
_TRIAL = 0.3
# Scaled errors beyond this tell of a prediction that went astray.
_MOST = 50.0


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """A candidate at its most promising numbers.

    Attributes:
        candidate: which one.
        gain: nats that it would bring to first order.
        numbers: to start a fit from.
    """

    candidate: Candidate
    gain: float
    numbers: FloatArray


def screened(here: Fit, candidates: Sequence[Candidate]) -> list[Look]:
    """Candidates by what they gain beyond what the rig's own numbers can.

    Args:
        here: a fit without them.
        candidates: to look at.
    """
    size, degrees = here.size, here.setting.criteria.degrees
    root = np.sqrt(weights(here.errors, size, degrees))
    own = (slopes(here) / size[..., np.newaxis] * root[..., np.newaxis]).reshape(root.size, -1)
    spread = here.setting.spread
    known = np.vstack([np.nan_to_num(own), np.diag(1.0 / spread)])
    wanted = np.append(
        -(here.errors / size * root).ravel(), (here.setting.centre - here.vector) / spread
    )
    basis = np.linalg.qr(known)[0]
    left = wanted - basis @ (basis.T @ wanted)
    best: dict[str, Look] = {}
    for candidate, point, linear, moved in _moved(here, candidates):
        columns = [
            np.append(
                (np.clip((m - here.errors) / size, -_MOST, _MOST) * root).ravel(),
                np.zeros(len(spread)),
            )
            for m in moved
        ]
        column = np.stack(columns, axis=1)
        column -= basis @ (basis.T @ column)
        look = _look(candidate, point, linear, column, left)
        if candidate.id not in best or look.gain > best[candidate.id].gain:
            best[candidate.id] = look
    return sorted(best.values(), key=lambda look: -look.gain)


def _look(
    candidate: Candidate, point: FloatArray, linear: list[int], column: FloatArray,
    left: FloatArray,
) -> Look:  # fmt: skip
    share = np.linalg.lstsq(column, left, rcond=1e-8)[0]
    numbers = point.copy()
    if linear:
        numbers[linear] = np.clip(_TRIAL * share, candidate.low[linear], candidate.high[linear])
        share = numbers[linear] / _TRIAL
    else:
        share = np.clip(share, 0.0, 1.0)
    gain = 0.5 * float(left @ left - np.sum((left - column @ share) ** 2))
    return Look(candidate, gain, numbers)


def _moved(
    here: Fit, candidates: Sequence[Candidate]
) -> list[tuple[Candidate, FloatArray, list[int], list[FloatArray]]]:
    """Errors with each candidate at each point of its grid, one for each linear number."""
    jobs: list[tuple[Candidate, FloatArray, list[int], int]] = []
    rigs: list[Rig | None] = []
    for candidate in candidates:
        for point, linear in candidate.starts():
            count = max(len(linear), 1)
            jobs.append((candidate, point, linear, count))
            for i in range(count):
                trial = point.copy()
                if linear:
                    trial[linear[i]] = _TRIAL
                rigs.append(_with(here, candidate, trial))
    found = errors_of_each(here.setting, rigs, float(here.vector[-1]))
    out, place = [], 0
    for candidate, point, linear, count in jobs:
        moved = [m for m in found[place : place + count] if m is not None]
        place += count
        if len(moved) == count:
            out.append((candidate, point, linear, moved))
    return out


def _with(here: Fit, candidate: Candidate, numbers: FloatArray) -> Rig | None:
    try:
        rig = here.rig
        return rig.replace(effects=(*rig.effects, candidate.entry(numbers)))
    except InputError:
        return None
