"""Whether the residual torque of a fit can be predicted from the motion, by whatever formula."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from drill_env._types import FloatArray, IntArray
from drill_env.diagnosis.shapes import COORDINATES
from drill_env.effects.along import Motion
from drill_env.recordings.signals import lagged

# Of 25 nulls the largest share was 0.04; of 59 right answers all but three had 0.12 and less.
PREDICTABLE = 0.2
"""Share of the residual torque which the motion predicts, above which something is missing."""

# Rows that are learnt from; smoothed torques change little from one row to the next.
_ROWS = 6000
_FEWEST = 300
# Recordings from which on each is predicted from the others; fewer are cut into so many parts.
_PARTS = 3
_HARMONICS = (1, 2)
# First-order lags (s) of what may be remembered, and whether of its size.
_LAGS: tuple[tuple[str, bool, float], ...] = (
    ("voltage", False, 0.1), ("voltage", False, 1.0), ("voltage", True, 5.0),
    ("omega_l", False, 0.3), ("omega_l", False, 3.0), ("omega_l", True, 10.0),
    ("omega_u", False, 0.3), ("twist", False, 0.3),
)  # fmt: skip
AXIS_LAGS = (*_LAGS, ("omega_u", False, 3.0), ("omega_u", True, 10.0))
"""On an axis the upper disc is what the lower one is on a whole rig, and remembered as long."""

# Widths of play, in shares of the voltage's range, by which a drive may remember where it turned:
# even in the logarithm, not derived; trees interpolate between them.
_WIDTHS = (0.03, 0.1, 0.3)


@dataclass(frozen=True, slots=True, eq=False)
class Latent:
    """Residual torques of one recording.

    Attributes:
        motion: what all samples say of the motion.
        torques: smoothed latent torques on the upper and lower disc, Nm, shape (n, 2).
    """

    motion: Motion
    torques: FloatArray


@dataclass(frozen=True, slots=True)
class ResidualTorque:
    """How much of the residual torque of a fit the motion predicts.

    Attributes:
        shares: of the latent torques' squares on the upper and lower disc, predicted in recordings
            that were not learnt from; noise has none, and less than none by chance.
        sizes: root mean squares of the torques, Nm.
    """

    shares: tuple[float, float]
    sizes: tuple[float, float]

    @property
    def squares(self) -> tuple[float, float]:
        """What is predictable of the mean squares, Nm^2."""
        pairs = zip(self.shares, self.sizes, strict=True)
        first, second = (max(share, 0.0) * size**2 for share, size in pairs)
        return first, second


def residual_torque_of(latents: Sequence[Latent]) -> ResidualTorque:
    """How well the latent torques of each recording are predicted from the others'.

    Gradient-boosted trees learn them as a function of time, voltage, angles, twist, speeds, lagged
    values of these and what play leaves of them. No acceleration is among them: the torque itself
    accelerates the disc.

    Args:
        latents: of all recordings.
    """
    known = [motion_features(one.motion) for one in latents]
    torques = [one.torques for one in latents]
    rows = np.concatenate(torques)
    first, second = (share_of(known, [t[:, disc] for t in torques]) for disc in range(2))
    sizes = np.sqrt(np.mean(rows**2, axis=0)).tolist()
    return ResidualTorque((first, second), (sizes[0], sizes[1]))


def share_by(name: str, latents: Sequence[Latent], values: Sequence[FloatArray]) -> float:
    """The share of some torques that one coordinate alone predicts.

    Args:
        name: of the coordinate.
        latents: of all recordings.
        values: torques, Nm, of shape (n,) each.
    """
    return share_of([features_of(name, one.motion) for one in latents], values)


def share_of(known: Sequence[FloatArray], values: Sequence[FloatArray]) -> float:
    """Share of the squares of values that are predicted in recordings that were not learnt from.

    Args:
        known: of shape (n, m) each.
        values: of shape (n,) each.
    """
    # A second for its import is spent by those who diagnose only.
    from sklearn.ensemble import HistGradientBoostingRegressor

    total = sum(map(len, values))
    step = max(1, total // _ROWS)
    x = np.concatenate([k[::step] for k in known])
    y = np.concatenate([v[::step] for v in values])
    group = _groups([len(v[::step]) for v in values])
    if len(y) < _FEWEST or not np.any(y):
        return 0.0
    # Leaves need torques of order one to tell a gain from rounding.
    y = y / np.sqrt(np.mean(y**2))
    missed = 0.0
    for number in np.unique(group).tolist():
        unseen = group == number
        trees = HistGradientBoostingRegressor(
            max_iter=40, learning_rate=0.2, max_leaf_nodes=15, l2_regularization=1.0,
            min_samples_leaf=40, early_stopping=False, random_state=0,
        )  # fmt: skip
        # They came after the limit that the diagnosis sets, and few rows are slower with more.
        with threadpool_limits(1):
            trees.fit(x[~unseen], y[~unseen])
            missed += float(np.sum((y[unseen] - trees.predict(x[unseen])) ** 2))
    return 1.0 - missed / len(y)


def _groups(lengths: Sequence[int]) -> IntArray:
    """A number for each row: of its recording, or of its part of one where these are few."""
    parts = 1 if len(lengths) >= _PARTS else _PARTS
    pairs = enumerate(lengths)
    return np.concatenate([place * parts + np.arange(n) * parts // n for place, n in pairs])


def motion_features(motion: Motion) -> FloatArray:
    """What a residual is learnt from, a row for each of the motion."""
    return np.hstack([features_of(name, motion) for name in COORDINATES])


def features_of(
    name: str, motion: Motion, lags: Sequence[tuple[str, bool, float]] = _LAGS
) -> FloatArray:
    """What is learnt from of one coordinate: itself, where in its turn it is, and its past."""
    values = COORDINATES[name](motion)
    columns = [values]
    if name.startswith("theta"):
        columns += [wave(order * values) for order in _HARMONICS for wave in (np.sin, np.cos)]
    for other, sizes, constant in lags:
        if other == name:
            columns.append(_lagged(motion, np.abs(values) if sizes else values, constant))
    if name == "voltage":
        columns += [_beyond_play(values, share * float(np.ptp(values))) for share in _WIDTHS]
    return np.column_stack(columns)


def _beyond_play(values: FloatArray, width: float) -> FloatArray:
    """How far values are from what follows them with play, the operator of Prandtl (1928).

    It tells from which side they came, however long ago that was.
    """
    out, there = np.empty(len(values)), float(values[0])
    for i, value in enumerate(values.tolist()):
        there = min(max(there, value - width), value + width)
        out[i] = value - there
    return out


def _lagged(motion: Motion, values: FloatArray, constant: float) -> FloatArray:
    """Values behind a first-order lag (s), at rest at its first value after each restart."""
    samples = constant / float(np.median(np.diff(motion.t)))
    ends = [*motion.restarts[1:].tolist(), len(values)]
    out = np.empty(len(values))
    for a, b in zip(motion.restarts.tolist(), ends, strict=True):
        out[a:b] = values[a] + lagged(values[a:b] - values[a], samples)
    return out
