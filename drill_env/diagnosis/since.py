"""Since when physics is missing, where the recordings have dates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date

from threadpoolctl import threadpool_limits

from drill_env.diagnosis.block_densities import block_densities
from drill_env.diagnosis.clock import cleaned
from drill_env.diagnosis.diagnose import Diagnosis
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.strikes import Once
from drill_env.identification.readings import made_of_twist
from drill_env.identification.samples import prepare
from drill_env.prediction.criteria import Criteria
from drill_env.recordings import Recording


@dataclass(frozen=True, slots=True)
class Since:
    """When an effect began.

    Attributes:
        first: first date whose recordings have it.
        last_without: last date before whose recordings have it not, None where none says so.
    """

    first: date
    last_without: date | None


def since(
    found: Diagnosis, dates: Mapping[str, date | None], older: Sequence[Recording] = ()
) -> Since | None:
    """Since when what was found is there.

    Each recording is predicted by the final fit with and without what was found, rig and noise the
    same: where it acts, the fit with it predicts better, elsewhere worse. A fit to recordings of
    which some have it and others have not would tell it too small, or find no name for it.

    Args:
        found: the diagnosis of the newest recordings.
        dates: of recordings, by their source.
        older: recordings that were not part of it.

    Returns:
        None where it cannot be told: nothing was found, what was found happened once, there are
        not two dates, or recordings after its beginning contradict it.
    """
    fit, setting, criteria = found.found.final, found.found.setting, Criteria()
    if not fit.terms or any(isinstance(t.source, (LostCounts, Once)) for t in fit.terms):
        return None
    without = replace(fit, terms=())
    release = setting.samples[0].release
    relative = made_of_twist([s.recording for s in setting.samples])
    with threadpool_limits(1):
        asked = [prepare(r, found.start, relative=relative) for r in older]
        asked = cleaned([replace(s, release=release) for s in asked], setting.jitter)
        gains: dict[date, float] = {}
        for samples in (*asked, *setting.samples, *found.held):
            day = dates.get(samples.recording.source)
            if day is not None:
                there, gone = (
                    block_densities(samples, setting, f, criteria.degrees).sum()
                    for f in (fit, without)
                )
                gains[day] = gains.get(day, 0.0) + float(there - gone)
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
