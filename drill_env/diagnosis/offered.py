"""What a search may move and what it may add, by the rig it starts from."""

from __future__ import annotations

from collections.abc import Container

from drill_env.effects import LIBRARY, Effect
from drill_env.identification.coordinates import active_names
from drill_env.parameters import SYMBOLS, Rig
from drill_env.prediction.offer import is_behind_the_current, second_gear

# An asymmetry lies within the level that it is an asymmetry of.
_LEVELS = {"dTsu": "Tsu", "dbu": "bu"}


def free_parameters(rig: Rig, fixed: Container[str] = (), scale: str = "Ju") -> list[str]:
    """Names of the rig's parameters that are fitted, in the order of `SYMBOLS`.

    Args:
        rig: where to start. `Tsu` or `bu` of 0 is a model without that term: its coordinate is a
            logarithm, so it stays out, and its asymmetry with it.
        fixed: parameters that are held besides the scale of torque.
        scale: the parameter that sets it: Ju, or km where the drive is a measured torque; "" where
            something else was measured in Nm.
    """
    absent = {name for name in ("Tsu", "bu") if getattr(rig, name) == 0.0}
    absent |= {name for name, level in _LEVELS.items() if level in absent}
    known = active_names(rig) - absent - {scale}
    return [name for name in SYMBOLS if name in known and name not in fixed]


def offered_effects(
    rig: Rig, free: Container[str], leave_out: Container[str] = (), *, amplifier: bool = True,
    moved: bool = False,
) -> list[Effect]:  # fmt: skip
    """The effects of the library that a rig of two discs can have.

    Args:
        rig: where to start.
        free: its free parameters; an effect that is a parameter of the rig is offered where the
            rig lacks that, so where it is 0 and held. What its file has is not offered again.
        leave_out: ids that are not wanted.
        amplifier: whether one lies between what was recorded and the motor.
        moved: whether the upper disc's motion is the input: nothing acts on it or its encoder.
    """
    there = [LIBRARY[e["id"]] for e in rig.effects if e["id"] in LIBRARY]
    return [
        effect
        for effect in LIBRARY.values()
        if effect.id not in leave_out
        and effect not in there
        and not second_gear(effect, there)
        and not effect.axis_only
        and not (moved and effect.equation == "upper")
        and (amplifier or is_behind_the_current(effect))
        and not (effect.stands_for and _has(rig, effect.stands_for, free))
    ]


def is_parameter(name: str) -> bool:
    """Whether an effect of that name is a parameter of the rig's own model."""
    return name in LIBRARY and bool(LIBRARY[name].stands_for)


def _has(rig: Rig, name: str, free: Container[str]) -> bool:
    return name in free or getattr(rig, name) != 0.0
