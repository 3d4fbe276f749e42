"""Loads that were measured beside the drive: known torques on the discs."""

from __future__ import annotations

from typing import Any

import numpy as np

from drill_env._types import FloatArray
from drill_env.parameters import Rig
from drill_env.recordings import Recording

_COMPONENTS = {"load_u": "upper", "load_l": "lower"}


def mean_loads(recording: Recording) -> FloatArray:
    """Mean of each load over the interval after each row, Nm, shape (n, 2); 0 if unmeasured.

    A load is straight between two rows.
    """
    found = np.zeros((len(recording), 2))
    for place, name in enumerate(_COMPONENTS):
        load = getattr(recording, name)
        if load is not None:
            found[:, place] = np.append(0.5 * (load[1:] + load[:-1]), load[-1])
    return found


def loaded(rig: Rig, recording: Recording, begin: float = 0.0) -> Rig:
    """A rig on which the measured loads of a recording act.

    Args:
        rig: parameters and effects; one of one inertia has no lower disc to load.
        recording: with `load_u` or `load_l`, or without.
        begin: time of the first row in the run that is wanted, s.
    """
    t = recording.t - recording.t[0] + begin
    tables: list[dict[str, Any]] = [
        {
            "id": "table", "component": _COMPONENTS[name], "depends_on": "time", "sort": "torque",
            "knots": t, "values": load, "located": False,
        }
        for name, load in recording.loads().items()
        if name == "load_u" or rig.inertias == 2
    ]  # fmt: skip
    return rig.replace(effects=(*rig.effects, *tables)) if tables else rig


def force_on_axis(recording: Recording, gain: float) -> FloatArray:
    """What moves an axis of one inertia: its drive and its measured load, Nm, shape (n,)."""
    force = gain * recording.channel("u")
    return force if recording.load_u is None else force + recording.load_u
