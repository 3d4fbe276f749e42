"""The sampled position law that made the voltages of a recording, found in the recording."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification._closed_loop import LAW
from drill_env.recordings import Recording
from drill_env.recordings.columns import resolve

_DELAYS = (0, 1, 2)
_SPANS = (1, 2, 3, 4)
# Of the voltage: more than this left over, and it is another law that made it.
_WORST_LEFT = 0.1


@dataclass(frozen=True, slots=True)
class PositionLaw:
    """A velocity loop inside a position loop, sampled with the recording.

    u[k] = kv (kp (r[j] - y[j]) - (y[j] - y[j - span]) / (span dt)) + gain d[k], j = k - delay,
    held from t[k] to t[k+1] and cut at +-limit.

    Args:
        kp: position gain, 1/s.
        kv: velocity gain, V s per unit of position.
        reference: "COLUMN" or "COLUMN:UNIT" of the position asked for, r.
        span: samples over which the velocity is taken; 2 is the central difference one
            sample ago.
        delay: samples from a position to the voltage that answers it.
        disturbance: column of a voltage known to act beside the law, d, where there is one;
            recordings without it have none.
        disturbance_gain: volts per unit of that column.
        limit: largest voltage, V.
        left: share of the voltage that the law left unexplained where it was found.
    """

    kp: float
    kv: float
    reference: str
    span: int = 2
    delay: int = 0
    disturbance: str | None = None
    disturbance_gain: float = 1.0
    limit: float = math.inf
    left: float = 0.0

    def __post_init__(self) -> None:
        if not (0 < self.kp < math.inf and 0 < self.kv < math.inf):
            raise InputError(f"kp is {self.kp} and kv {self.kv}: give numbers greater than 0")
        if self.span < 1 or self.delay < 0 or not self.limit > 0:
            raise InputError("span must be 1 or more, delay 0 or more and limit greater than 0")

    def record(self) -> np.ndarray:
        """The law as the kernel reads it, shape (1,)."""
        return np.array([(self.kp, self.kv, self.limit, self.span, self.delay)], dtype=LAW)

    def wanted(self, recording: Recording) -> FloatArray:
        """The position asked for, in the unit of theta_u, shape (n,).

        Raises:
            InputError: the recording has no such column.
        """
        name = self.reference if self.reference in recording.extra else None
        name = name or self.reference.rpartition(":")[0]
        if name not in recording.extra:
            raise InputError(
                f"{recording.source}: no column {self.reference} for the reference; found besides "
                f"channels: {', '.join(recording.extra) or 'none'}"
            )
        found = ["t", *recording.extra]
        column = resolve(recording.source, found, {"theta_u": self.reference})["theta_u"]
        return recording.extra[column.name] * column.scale

    def added(self, recording: Recording) -> FloatArray:
        """The voltage beside the law (V), shape (n,)."""
        column = recording.extra.get(self.disturbance or "", np.zeros(len(recording)))
        return self.disturbance_gain * column


def find_position_law(
    recordings: Sequence[Recording], reference: str, disturbance: str | None = None
) -> PositionLaw:
    """Regress the voltage on position error and velocity, for each span and delay; the best one.

    Args:
        recordings: with u, theta_u and the reference; those to fit, not those held out.
        reference: "COLUMN" or "COLUMN:UNIT" of the position asked for.
        disturbance: column of a voltage that acts beside the law; its gain is regressed too
            where a recording has it, else it counts as volts.

    Raises:
        InputError: a column is missing, or no such law makes these voltages.
    """
    if not recordings:
        raise InputError("no recording to find the position law in; give at least one")
    tries = [
        _regressed(recordings, PositionLaw(1.0, 1.0, reference, span, delay, disturbance))
        for delay in _DELAYS
        for span in _SPANS
    ]
    gains, law = min(tries, key=lambda one: one[1].left)
    kv, kp = float(gains[1]), float(gains[0] / gains[1])
    if law.left > _WORST_LEFT or not (kv > 0 and kp > 0):
        raise InputError(
            f"{recordings[0].source}: a position law leaves {100 * law.left:.3g} % of the voltage "
            f"unexplained (kp = {kp:.3g}, kv = {kv:.3g}): the reference {reference} or its unit "
            "is wrong, or another law made the voltage; identify without --closed-loop"
        )
    gain = float(gains[2]) if len(gains) == 3 else 1.0
    return replace(law, kp=kp, kv=kv, disturbance_gain=gain)


def _regressed(recordings: Sequence[Recording], law: PositionLaw) -> tuple[FloatArray, PositionLaw]:
    """Gains of error, velocity and disturbance, and the law with its limit and what it leaves."""
    blocks = []
    limit = max(
        (float(np.abs(r.channel("u")).max()) for r in recordings if r.has_note("saturated")),
        default=math.inf,
    )
    for recording in recordings:
        u, y = recording.channel("u"), recording.channel("theta_u")
        rows = np.arange(law.delay + law.span, len(u))
        rows = rows[np.abs(u[rows]) < limit * (1.0 - 1e-9)]
        now = rows - law.delay
        speed = (y[now] - y[now - law.span]) / (law.span * recording.interval)
        error = (law.wanted(recording) - y)[now]
        blocks.append(np.stack([error, -speed, law.added(recording)[rows], u[rows]], axis=1))
    table = np.concatenate(blocks)
    used = [0, 1, 2] if table[:, 2].any() else [0, 1]
    sizes = np.maximum(np.linalg.norm(table[:, used], axis=0), 1e-300)
    values = np.linalg.lstsq(table[:, used] / sizes, table[:, 3], rcond=None)[0] / sizes
    missed = table[:, 3] - table[:, used] @ values
    share = float(np.linalg.norm(missed) / max(np.linalg.norm(table[:, 3]), 1e-300))
    return np.asarray(values, float), replace(law, limit=limit, left=share)
