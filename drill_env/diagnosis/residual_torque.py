"""Whether the residual torque of a fit can be predicted from the motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._threads import each
from drill_env._types import FloatArray
from drill_env.diagnosis.learners import known_of, share_of
from drill_env.diagnosis.shapes import COORDINATES
from drill_env.effects.along import Motion

# Of 25 nulls the largest share was 0.04; of 59 right answers all but three had 0.12 and less.
PREDICTABLE = 0.2
"""Share of the residual torque which the motion predicts, above which something is missing."""


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

    They are learnt as a function of time, voltage, angles, twist, speeds and the past of these. No
    acceleration is among them: the torque itself accelerates the disc.

    Args:
        latents: of all recordings.
    """
    known = [known_of(list(COORDINATES), one.motion) for one in latents]
    torques = [one.torques for one in latents]
    rows = np.concatenate(torques)
    first, second = each(lambda disc: share_of(known, [t[:, disc] for t in torques]), range(2))
    sizes = np.sqrt(np.mean(rows**2, axis=0)).tolist()
    return ResidualTorque((first, second), (sizes[0], sizes[1]))


def share_by(name: str, latents: Sequence[Latent], values: Sequence[FloatArray]) -> float:
    """The share of some torques that one coordinate alone predicts.

    Args:
        name: of the coordinate.
        latents: of all recordings.
        values: torques, Nm, of shape (n,) each.
    """
    return share_of([known_of([name], one.motion) for one in latents], values)
