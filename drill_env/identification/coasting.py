"""Rows in which the bridge is off, so that the motor neither drives nor brakes."""

from __future__ import annotations

from collections.abc import Sequence

from drill_env._errors import InputError
from drill_env.parameters import Rig
from drill_env.recordings import Recording

COASTING = "coasting"
"""The effect that holds how much of bu is back EMF."""


def left_out_of_search(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Effects that no search offers for these recordings: `COASTING` where no bridge may be off."""
    return () if any(map(_may_coast, recordings)) else (COASTING,)


def _may_coast(recording: Recording) -> bool:
    """Whether the bridge is off in some rows, or nothing tells whether it is where u is 0."""
    unstated = recording.bridge is None and recording.drive == "voltage"
    return recording.coasts() or (unstated and bool((recording.u == 0.0).any()))


def untold_coasting(recording: Recording, rig: Rig) -> bool:
    """Whether a recording coasts and nothing says how much of bu is gone then."""
    told = (*rig.effects, *recording.effects)
    return recording.coasts() and all(entry.get("id") != COASTING for entry in told)


def check_coasting(recordings: Sequence[Recording], rig: Rig | None = None) -> None:
    """Raise where a recording coasts and its back EMF is not stated.

    Args:
        recordings: to identify from.
        rig: whose effects are followed; None where they are not.

    Raises:
        InputError: naming the recording.
    """
    for recording in recordings:
        if untold_coasting(recording, Rig.paper() if rig is None else rig):
            raise InputError(
                f"{recording.source}: the bridge is off in some rows, and how much of bu is back "
                'EMF is not stated: effects = [{ id = "coasting", back_emf = 0.2 }] in '
                "recordings.toml (V s/rad); diagnose estimates it"
            )
