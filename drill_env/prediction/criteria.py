"""The numbers by which predictions decide."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Criteria:
    """Settings of the search by prediction, each with its source.

    What half and twice of each does to the answers is in docs/proof.md.

    Attributes:
        leads: times ahead at which a window is judged, in shares of the horizon, after three
            sampling intervals. Short ones see sensors and delays, long ones physics; at one alone a
            wrong name can win.
        horizons: s, tried in turn until a candidate is listed. Long ones see weights and friction
            best; where much else is missing, errors of all models grow alike and short ones speak.
        windows: unseen ones that there must be; the horizon is shortened for them.
        degrees: of freedom of Student's t, for errors with outliers; Lange, Little and Taylor,
            JASA 84 (1989), take 4.
        z: paired difference over its standard error from which a name is listed: one chance in
            seven hundred for a single candidate, in twenty for forty.
        gain: nats on unseen windows below which two models predict alike; Sivula, Magnusson and
            Vehtari, arXiv:2008.10296 (2020), take 4.
        share: of what a free shape at the same place explains from which a name stands for it.
            Every law fails on enough data. So much of the squared error of unseen predictions,
            beyond noise, what was found must remove: else it is a surrogate.
        common: prior odds of a name that most machines have (Coulomb and viscous friction, an
            offset, a weight) to one that few have.
        reach: standard deviations by which a number of the rig may leave the given one. Further
            off, the rig file is wrong, and a rig that predicts by absurd numbers explains nothing.
        shift: standard deviation of the drive's delay behind the readings, in sampling intervals:
            recordings do not say when within an interval a row was taken.
        evidence: nats of all recordings together from which a whole rig lacks something: the 4 of
            `gain`, 8 for the three thousand candidates, points of grids and moments that are tried,
            and 3 for one false alarm in twenty.
        neighbour: share of the first effect's gain that a further one must bring to be more than a
            remainder of it.
    """

    leads: tuple[float, ...] = (0.1, 0.3, 0.95)
    horizons: tuple[float, ...] = (1.0, 0.5, 0.25)
    windows: int = 15
    degrees: float = 4.0
    z: float = 3.0
    gain: float = 4.0
    share: float = 0.8
    common: float = 10.0
    reach: float = 3.0
    shift: float = 1.0
    evidence: float = 15.0
    neighbour: float = 0.1
