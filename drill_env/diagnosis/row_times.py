"""Reading errors that are no more than when within a sampling interval a row was taken.

Recordings do not say that (`Criteria.shift`): a reading that is early or late by less than an
interval is its clock's, and no physics.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drill_env.diagnosis.terms import Shape, Term
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig
from drill_env.prediction.criteria import Criteria

# Coordinates of a disc's error that its time makes: its speed, and what accelerates it.
_BY_SPEED = (("error_u", "omega_u"), ("error_l", "omega_l"))
_BY_DRIVE = ("error_u", "voltage")


def of_row_times(
    term: Term, rig: Rig, samples: Sequence[Samples], criteria: Criteria | None = None
) -> bool:
    """Whether a free shape of a reading is what a shift within a sampling interval makes of it.

    A shift d adds d times the speed and, as the drive acts from one row to the next, up to
    d^2 / 2 times the acceleration that it gives. The shape stands for that if a straight line of
    no larger slope explains the share of it that a name must explain of a curve.

    Args:
        term: of a fit.
        rig: of the fit.
        samples: of the recordings.
        criteria: of the decision.
    """
    share = (criteria or Criteria()).share
    source = term.source
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
    knots, values = np.array(source.knots), source.bounded(term.q)
    slope = np.polyfit(knots, values, 1)[0]
    rest = values - values.mean() - slope * (knots - knots.mean())
    return bool(abs(slope) <= most and np.var(rest) <= (1.0 - share) * np.var(values))
