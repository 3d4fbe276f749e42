"""What drives the recordings: a voltage, whose scale of torque is unknown, or a torque itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from drill_env._errors import InputError
from drill_env.parameters import Rig
from drill_env.recordings import Recording

UNIT = {"voltage": "V", "torque": "Nm"}
"""Unit of each drive; N where a linear axis is driven by a force."""


def torque_driven(recordings: Sequence[Recording]) -> bool:
    """Whether the recordings' drive is a measured torque.

    Raises:
        InputError: some are driven by a voltage and some by a torque.
    """
    first = {recording.drive: recording.source for recording in reversed(recordings)}
    if len(first) > 1:
        raise InputError(
            f"{first['voltage']} is driven by a voltage and {first['torque']} by a torque: take "
            "recordings of one kind, or map the same column in all"
        )
    return "torque" in first


def driven_rig(rig: Rig, recordings: Sequence[Recording]) -> Rig:
    """The rig as these recordings drive it: a measured torque is the motor's own, so km is 1.

    Raises:
        InputError: some are driven by a voltage and some by a torque.
    """
    return rig.replace(km=1.0) if torque_driven(recordings) else rig


def with_known_scale(
    recordings: Sequence[Recording],
    fixed: Mapping[str, float],
    free: Sequence[str] | None = None,
) -> dict[str, float]:
    """The given parameters, km = 1 among them where the drive is a torque.

    Raises:
        InputError: km is given or free although it is known to be 1, or the drives differ.
    """
    if not torque_driven(recordings):
        return dict(fixed)
    if fixed.get("km", 1.0) != 1.0 or "km" in (free or ()):
        raise InputError(
            f"{recordings[0].source} is driven by a measured torque, so that km is 1: leave km out "
            "of the fixed and free parameters"
        )
    return {**fixed, "km": 1.0}
