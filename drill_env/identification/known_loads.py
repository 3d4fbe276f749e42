"""What is known to act in one recording beside the rig: measured loads, added inertia, effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion, responses_along
from drill_env.effects.declared import Declared, declared
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


def tells_scale(recordings: Sequence[Recording]) -> bool:
    """Whether something is known in Nm or kg m^2, which volts and angles do not tell.

    An inertia that was added in all recordings alike is part of the unknown one. What acts on an
    upper disc whose motion is prescribed tells nothing.
    """
    every = {(r.added_inertia_u, r.added_inertia_l, r.drive == "motion") for r in recordings}
    added = {(0.0 if moved else upper, lower) for upper, lower, moved in every}
    return len(added) > 1 or any(_knows_newtons(recording) for recording in recordings)


def _knows_newtons(recording: Recording) -> bool:
    if recording.drive != "motion":
        return bool(recording.loads()) or any(_in_newtons(e) for e in recording.effects)
    return recording.load_l is not None or any(
        _in_newtons(e, lower=True) for e in recording.effects
    )


def _in_newtons(entry: Mapping[str, Any], *, lower: bool = False) -> bool:
    effect = LIBRARY.get(str(entry.get("id")))
    where = entry.get("component") if effect is None else effect.equation
    if lower and where in ("actuator", "upper"):
        return False
    if effect is None:
        return entry.get("sort") in ("torque", "friction", "damping")
    return any("Nm" in p.unit for p in effect.parameters)


def with_added_inertia(rig: Rig, recording: Recording) -> Rig:
    """A rig as heavy as it was in a recording; what effects are of its inertia stays.

    Derivatives by Ju and Jl are the same, since the inertia is their sum with what was added.
    """
    if recording.added_inertia_u == 0.0 and recording.added_inertia_l == 0.0:
        return rig
    lower = recording.added_inertia_l if rig.inertias == 2 else 0.0
    effects = [_same_body(entry, rig, recording) for entry in rig.effects]
    return rig.replace(
        Ju=rig.Ju + recording.added_inertia_u, Jl=rig.Jl + lower, effects=tuple(effects)
    )


def times_inertia(rig: Rig, recording: Recording, equation: str) -> float:
    """How many times its own inertia the disc of an effect has in a recording."""
    if equation == "upper":
        return 1.0 + recording.added_inertia_u / rig.Ju
    return 1.0 + recording.added_inertia_l / rig.Jl


def _same_body(entry: Mapping[str, Any], rig: Rig, recording: Recording) -> Mapping[str, Any]:
    effect = LIBRARY.get(str(entry.get("id")))
    if effect is None or effect.heavier is None:
        return entry
    names = [p.name for p in effect.parameters]
    numbers = effect.vector({key: value for key, value in entry.items() if key != "id"})
    numbers = effect.heavier(numbers, times_inertia(rig, recording, effect.equation))
    return {"id": effect.id, **dict(zip(names, numbers.tolist(), strict=True))}


def known_effects(rig: Rig, recording: Recording) -> tuple[Mapping[str, Any], ...]:
    """The known physics of a recording that acts on a rig; one of one inertia has no lower disc.

    Raises:
        InputError: an effect is wrong, or of a sort that is stated elsewhere.
    """
    kept = []
    for entry in recording.effects:
        effect = LIBRARY.get(str(entry.get("id")))
        on = entry.get("depends_on") if effect is None else effect.depends_on
        remedy = ""
        if on == "time":
            remedy = "follows time: give its torque in each row as load_u or load_l"
        elif entry.get("sort") == "error" or (effect is not None and effect.senses):
            remedy = "is an error of an encoder: put it in the rig file"
        elif effect is not None and effect.delay:
            remedy = "is a delay: give that of u with its column"
        if remedy:
            raise InputError(f"{recording.source}: effect {entry.get('id')} {remedy}")
        where = entry.get("component") if effect is None else effect.equation
        if rig.inertias == 2 or where in ("upper", "actuator"):
            kept.append(entry)
    try:
        declared(rig.replace(effects=tuple(kept)))
    except InputError as error:
        text = str(error).replace("rig effect", "effect", 1)
        raise InputError(f"{recording.source}: {text}") from error
    return tuple(kept)


def known_physics(rig: Rig, recording: Recording) -> Declared:
    """The known physics of a recording for the filter, which takes it at its own state.

    Args:
        rig: as heavy as it was.
        recording: with effects, or without.
    """
    if not recording.effects:
        return declared(rig.replace(effects=()))
    return declared(rig.replace(effects=known_effects(rig, recording)))


def loaded(rig: Rig, recording: Recording, begin: float = 0.0) -> Rig:
    """A rig with all that is known to act in a recording.

    Args:
        rig: parameters and effects; one of one inertia has no lower disc to load.
        recording: with `load_u`, `load_l`, added inertia or effects, or without.
        begin: time of the first row in the run that is wanted, s.

    Raises:
        InputError: an effect of the recording is wrong.
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
    rig = with_added_inertia(rig, recording)
    known = (*tables, *known_effects(rig, recording)) if recording.effects else tables
    return rig.replace(effects=(*rig.effects, *known)) if known else rig


def force_on_axis(recording: Recording, gain: float) -> FloatArray:
    """What moves an axis of one inertia: its drive and its measured load, Nm, shape (n,)."""
    force = gain * recording.channel("u")
    return force if recording.load_u is None else force + recording.load_u


def known_force(
    recording: Recording, gain: float, motion: tuple[FloatArray, FloatArray, FloatArray]
) -> FloatArray:
    """What known physics and the inertia that was added do to an axis, Nm, shape (n,).

    Args:
        recording: of one inertia.
        gain: force per volt.
        motion: angle (rad), velocity and acceleration at each row.
    """
    angle, velocity, acceleration = motion
    force = -recording.added_inertia_u * acceleration
    rig = Rig.one_inertia(km=gain, Ju=1.0, Tsu=0.0, bu=0.0)
    effects = known_effects(rig, recording)
    if not effects:
        return force
    nothing = np.zeros_like(angle)
    states = np.stack([angle, velocity, nothing, nothing, acceleration, nothing], axis=1)
    along = Motion(recording.t, recording.channel("u"), states, np.array([0]))
    after = responses_along(declared(rig.replace(effects=effects)), rig, along)[0][:, 0]
    after[-1] = after[-2]
    # That of the row lies between the means over the intervals on both sides.
    return force + 0.5 * (after + np.append(after[0], after[:-1]))
