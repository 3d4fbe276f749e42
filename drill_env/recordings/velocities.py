"""Checks of the velocity channels: units, dead or clipped sensors."""

from __future__ import annotations

import re

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.recordings.checks import Place
from drill_env.recordings.drives import clipped_share
from drill_env.recordings.recording import RecordingWarning

_FASTEST = 100.0
_NAMES = {"rpm": r"rpm|umin", "deg/s": r"deg\w*|dps"}


def check_velocity(omega: FloatArray, place: Place) -> list[RecordingWarning]:
    """Check one velocity channel.

    Args:
        omega: velocities in rad/s (m/s of a linear axis), those that are measured, shape (n,).
        place: where they came from.

    Raises:
        InputError: the column is named as if in another unit and none was stated.
    """
    if not place.column.stated:
        _refuse_name(place)
    if np.all(omega == omega[0]):
        text = (
            f"{place} never changes from {omega[0]:.6g}: the sensor is dead or the disc turned "
            "evenly all the time"
        )
        return [RecordingWarning("constant", text)]
    notes = []
    fastest = float(np.quantile(np.abs(omega), 0.99))
    if fastest > _FASTEST and not place.column.stated:
        text = (
            f"{place} reaches {fastest:.4g} rad/s, too fast for this rig; if it is in revolutions "
            f"a minute state so: {place.mapped('rpm')}"
        )
        notes.append(RecordingWarning("implausible_speed", text))
    for name, level in (("maximum", omega.max()), ("minimum", omega.min())):
        share = clipped_share(omega, float(level))
        if share > 0:
            text = (
                f"{place} sits at its {name} {level:.6g} for {100 * share:.1f} % of the time: the "
                "sensor or its amplifier seems to have reached its end"
            )
            notes.append(RecordingWarning("saturated", text))
    return notes


def _refuse_name(place: Place) -> None:
    words = re.split(r"[^a-z]+", place.column.name.lower())
    for unit, pattern in _NAMES.items():
        if any(re.fullmatch(pattern, word) for word in words):
            raise InputError(
                f"{place} is named as if in {unit}; state the unit: {place.mapped(unit)} "
                f"(or {place.mapped('rad/s')} if it is in rad/s)"
            )
