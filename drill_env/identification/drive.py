"""What drives the recordings: a voltage, of unknown scale of torque, a torque, or a motion."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import Any

from drill_env._errors import InputError
from drill_env.effects import LIBRARY
from drill_env.identification.coordinates import active_names
from drill_env.identification.known_loads import tells_scale
from drill_env.parameters import Rig
from drill_env.parameters.rig import UPPER
from drill_env.recordings import Drive, Recording

UNIT: Mapping[Drive, str] = {"voltage": "V", "torque": "Nm", "motion": "rad/s^2"}
"""Unit of `Recording.u` by the drive; N where a linear axis is driven by a force."""

_DRIVEN_BY: Mapping[Drive, str] = {
    "voltage": "a voltage", "torque": "a torque", "motion": "an unknown drive",
}  # fmt: skip

# Inertia (kg m^2) of an upper disc that nothing but its prescribed acceleration moves: the largest
# torque that is read, 1e7 Nm, moves it by 2e-5 rad in a minute, a fortieth of an encoder's step.
_UNMOVED = 1e15
_MOVED = {"km": _UNMOVED, "Ju": _UNMOVED, "Tsu": 0.0, "dTsu": 0.0, "bu": 0.0, "dbu": 0.0}


def drive_of(recordings: Sequence[Recording]) -> Drive:
    """What drives the recordings.

    Raises:
        InputError: not all are driven alike.
    """
    first = {recording.drive: recording.source for recording in reversed(recordings)}
    drives: list[Drive] = [drive for drive in UNIT if drive in first]
    if len(drives) > 1:
        one, other = drives[:2]
        raise InputError(
            f"{first[one]} is driven by {_DRIVEN_BY[one]} and {first[other]} by "
            f"{_DRIVEN_BY[other]}: take recordings of one kind, or map the same column in all"
        )
    return drives[0] if drives else "voltage"


def torque_driven(recordings: Sequence[Recording]) -> bool:
    """Whether the recordings' drive is a measured torque.

    Raises:
        InputError: not all are driven alike.
    """
    return drive_of(recordings) == "torque"


def motion_driven(recordings: Sequence[Recording]) -> bool:
    """Whether the upper disc's measured motion is the input, and its drive unknown.

    Raises:
        InputError: not all are driven alike.
    """
    return drive_of(recordings) == "motion"


def driven_rig(rig: Rig, recordings: Sequence[Recording]) -> Rig:
    """The rig as these recordings drive it.

    A measured torque is the motor's own, so km is 1. An upper disc whose motion is prescribed has
    neither friction nor effects, and is so heavy that no string moves it; its u is an acceleration.

    Raises:
        InputError: the recordings are not driven alike, or the motion of the only disc, or of the
            upper one alone, is all that was recorded.
    """
    drive = drive_of(recordings)
    if drive == "voltage":
        return rig
    if drive == "torque":
        return rig.replace(km=1.0)
    _check_lower(rig, recordings)
    misread = next((e for e in rig.effects if _is_upper_encoder(e)), None)
    if misread is not None:
        raise InputError(
            f"rig effect {misread['id']} misreads the motion that is the input with u=unknown: "
            "correct theta_u in the recordings, and take the effect out of the rig file"
        )
    return rig.replace(**_MOVED, effects=tuple(e for e in rig.effects if not _is_upper(e)))


def as_given(found: Rig, given: Rig, recordings: Sequence[Recording]) -> Rig:
    """A rig that was found, with its drive and upper disc as given where nothing is told of them.

    Args:
        found: from a `driven_rig`.
        given: the rig before.
        recordings: what it was found from.
    """
    if not motion_driven(recordings):
        return found
    kept = tuple(effect for effect in given.effects if _is_upper(effect))
    upper = {name: getattr(given, name) for name in UPPER}
    return found.replace(**upper, effects=(*kept, *found.effects))


def with_known_scale(
    recordings: Sequence[Recording],
    fixed: Mapping[str, float],
    free: Sequence[str] | None = None,
) -> dict[str, float]:
    """The given parameters, and those that the drive makes known: km = 1 where it is a torque.

    Raises:
        InputError: what is known so is given otherwise or free, or the drives differ.
    """
    drive = drive_of(recordings)
    if drive == "motion":
        lost = [name for name in UPPER if name in (free or ())]
        if lost:
            raise InputError(
                f"{recordings[0].source}: what moves the upper disc is unknown, so that nothing is "
                f"told of {', '.join(lost)}: leave it out of the free parameters"
            )
        return {**fixed, **_MOVED}
    if drive == "voltage":
        return dict(fixed)
    if fixed.get("km", 1.0) != 1.0 or "km" in (free or ()):
        raise InputError(
            f"{recordings[0].source} is driven by a measured torque, so that km is 1: leave km out "
            "of the fixed and free parameters"
        )
    return {**fixed, "km": 1.0}


def gives_scale(recordings: Sequence[Recording], fixed: Container[str]) -> bool:
    """Whether parameters that are given as exact set the scale of torque.

    Args:
        recordings: to fit.
        fixed: names, as they were given.
    """
    drive = drive_of(recordings)
    names = {"motion": ("Jl", "ktheta"), "torque": ("Ju", "km"), "voltage": ("Ju", "km")}[drive]
    return any(name in fixed for name in names)


def check_scale(recordings: Sequence[Recording], rig: Rig, free: Sequence[str]) -> None:
    """Refuse to estimate all torques of the lower disc where only motions were recorded.

    Args:
        recordings: to fit.
        rig: with its law.
        free: names of the parameters to estimate.

    Raises:
        InputError: none of them is given, and no load tells their scale.
    """
    torques = active_names(rig) - {*UPPER, "beta1", "beta2"}
    if motion_driven(recordings) and torques <= set(free) and not tells_scale(recordings):
        raise InputError(
            "two motions do not show the scale of torque: give one parameter of the lower disc or "
            "the string, such as Jl (--fix Jl=VALUE); the ratios to it are what is told"
        )


def check_axis(recordings: Sequence[Recording]) -> None:
    """Refuse recordings of one inertia whose drive is unknown.

    Raises:
        InputError: the only disc's motion is the input, or not all are driven alike.
    """
    if motion_driven(recordings):
        raise InputError(
            f"{recordings[0].source}: with u=unknown the upper disc's motion is the input and "
            "nothing is told of what moves it, and a rig of one inertia has no other disc: map its "
            "drive u or torque"
        )


def _check_lower(rig: Rig, recordings: Sequence[Recording]) -> None:
    if rig.inertias == 1:
        check_axis(recordings)
    for recording in recordings:
        if not any(name.endswith("_l") for name in recording.readings()):
            raise InputError(
                f"{recording.source}: with u=unknown the upper disc's motion is the input, and "
                "nothing of the lower disc was recorded: map theta_l or omega_l"
            )


def _is_upper(entry: Mapping[str, Any]) -> bool:
    """Whether an effect acts on the drive or the upper disc, or is of its encoder, alone."""
    effect = LIBRARY.get(str(entry.get("id")))
    if effect is not None:
        return effect.equation == "upper"
    if entry.get("sort") == "error":
        return entry.get("encoder", entry.get("depends_on")) in ("upper", "theta_u")
    return entry.get("component") in ("actuator", "upper")


def _is_upper_encoder(entry: Mapping[str, Any]) -> bool:
    effect = LIBRARY.get(str(entry.get("id")))
    return _is_upper(entry) and (
        effect.senses if effect is not None else entry.get("sort") == "error"
    )
