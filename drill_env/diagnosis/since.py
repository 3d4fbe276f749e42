"""Since when physics is missing, where the recordings have dates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import date

from drill_env.diagnosis.diagnose import Diagnosis
from drill_env.diagnosis.evidence import log_density
from drill_env.diagnosis.slips import Slips
from drill_env.diagnosis.strikes import Once
from drill_env.prediction.criteria import Criteria


@dataclass(frozen=True, slots=True)
class Since:
    """When an effect began.

    Attributes:
        first: first date whose recordings have it.
        last_without: last date before whose recordings have it not, None where none says so.
    """

    first: date
    last_without: date | None


def since(found: Diagnosis, dates: Mapping[str, date | None]) -> Since | None:
    """Since when what was found is there.

    Each recording is predicted by the final fit with and without what was found, rig and noise the
    same. Found in a mixture, an effect is told smaller than it is, yet larger than nothing: where
    it acts it predicts better, elsewhere worse.

    Args:
        found: a diagnosis.
        dates: of recordings, by their source.

    Returns:
        None where it cannot be told: nothing was found, what was found happened once, there are
        not two dates, or recordings after its beginning speak against it.
    """
    fit, setting, criteria = found.found.final, found.found.setting, Criteria()
    if not fit.terms or any(isinstance(t.source, (Slips, Once)) for t in fit.terms):
        return None
    without = replace(fit, terms=())
    gains: dict[date, float] = {}
    for samples in (*setting.samples, *found.held):
        day = dates.get(samples.recording.source)
        if day is not None:
            pair = (log_density(samples, setting, f, criteria) for f in (fit, without))
            gains[day] = gains.get(day, 0.0) + next(pair) - next(pair)
    return onset(gains, criteria.evidence)


def onset(gains: Mapping[date, float], needed: float) -> Since | None:
    """When the days that speak for an effect begin.

    Args:
        gains: log density with the effect less that without it, nats, by date.
        needed: nats of a day from which it says that the effect is there, or that it is not.

    Returns:
        None where there are not two days, none says that it is there, or a later one denies it.
    """
    days = sorted(gains)
    there = [day for day in days if gains[day] >= needed]
    absent = [day for day in days if gains[day] <= -needed]
    if len(days) < 2 or not there or (absent and absent[-1] > there[0]):
        return None
    return Since(there[0], absent[-1] if absent else None)
