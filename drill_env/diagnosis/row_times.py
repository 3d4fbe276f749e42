"""Reading errors that are no more than when within a sampling interval a row was taken.

Recordings do not say that (`Criteria.shift`): a reading that is early or late by less than an
interval is its clock's, and no physics.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drill_env.diagnosis.rounds import BELIEVED, Attempt
from drill_env.diagnosis.terms import Shape
from drill_env.identification.samples import Samples

# Coordinates of a disc's error that its time makes: its speed, and what accelerates it.
_BY_SPEED = (("error_u", "omega_u"), ("error_l", "omega_l"))
_BY_DRIVE = ("error_u", "voltage")


def of_row_times(attempt: Attempt, samples: Sequence[Samples]) -> bool:
    """Whether a free shape of a reading is what a shift within a sampling interval makes of it.

    A shift d adds d times the speed and, as the drive acts from one row to the next, up to
    d^2 / 2 times the acceleration that it gives: a straight line. The shape is that if its line is
    no steeper, and the rest, which gains its share of the squares, is not asked for by itself.

    Args:
        attempt: with the shape.
        samples: of the recordings.
    """
    source, rig = attempt.term.source, attempt.fit.rig
    if not isinstance(source, Shape) or source.sort != "error":
        return False
    interval = max(s.recording.interval for s in samples)
    of = (source.id.split("_of_")[0], source.depends_on)
    if of in _BY_SPEED:
        most = interval
    elif of == _BY_DRIVE:
        most = 0.5 * interval**2 * rig.km / rig.Ju
    else:
        return False
    knots, values = np.array(source.knots), source.bounded(attempt.term.q)
    slope = np.polyfit(knots, values, 1)[0]
    rest = values - values.mean() - slope * (knots - knots.mean())
    asked = attempt.gain * float(np.var(rest)) > BELIEVED * float(np.var(values))
    return bool(abs(slope) <= most) and not asked
