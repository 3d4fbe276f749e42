"""Which effects may be missing from a rig, by what was recorded."""

from __future__ import annotations

from collections.abc import Container, Iterable, Sequence

from drill_env.effects import LIBRARY, Effect
from drill_env.effects.along import Motion
from drill_env.identification.coordinates import active_names
from drill_env.parameters import SYMBOLS, Rig
from drill_env.prediction.candidate import Candidate, candidate_of, scales_of
from drill_env.prediction.shapes import free_shapes

# Of the motor, whose iron saturates too, behind whatever was measured.
_BEHIND_THE_CURRENT = (
    "torque_ripple", "commutation_ripple", "drive_speed_loss", "soft_saturation",
)  # fmt: skip
# Beside what depends on the voltage.
_READ_THE_DRIVE = (
    "gear_eccentricity", "gear_backlash", "gear_compliance", "commutation_ripple",
    "drive_speed_loss",
)  # fmt: skip
# A lone encoder that reports late is the drive that acts late.
_SHIFTS = ("encoder_delay_upper",)


_PULLED = frozenset({"km", "Ju", "Tsu", "dTsu", "bu", "dbu", "ktheta"})
# The encoders do not show exactly where the string is not twisted: an error there is a constant
# torque.
_OF_THE_ZERO = "dTsu"


def free_names(rig: Rig, fixed: Container[str], *, pulled: bool = False) -> tuple[str, ...]:
    """Parameters of the rig that are fitted: all that are not 0 and not held.

    One that is 0 is no part of the given model; an effect may stand for it.

    Args:
        rig: the given one.
        fixed: what is held.
        pulled: whether the upper disc alone is predicted, on a string whose other end was measured.
    """
    known = _PULLED if pulled else active_names(rig)
    there = {n for n in SYMBOLS if getattr(rig, n) != 0.0}
    if pulled and _tells_its_zero(rig):
        there |= {_OF_THE_ZERO}
    return tuple(n for n in SYMBOLS if n in known and n not in fixed and n in there)


def _tells_its_zero(rig: Rig) -> bool:
    """Whether a constant torque is estimated: its prior is as wide as the disc's dry friction."""
    return rig.Tsu != 0.0


def candidates_for(
    rig: Rig, motions: Sequence[Motion], leave_out: Container[str], *, amplifier: bool,
    pulled: bool = False,
) -> list[Candidate]:  # fmt: skip
    """Effects of the library and free shapes, at the sizes that the recordings have.

    Args:
        rig: the given one.
        motions: of the recordings.
        leave_out: ids that are not wanted.
        amplifier: whether one lies between what was recorded and the motor; behind a measured
            current or torque there is none.
        pulled: whether the drive has the pull of a string in it, so that nothing may read it.
    """
    scales = [scales_of(rig, motions, disc) for disc in range(rig.inertias)]
    possible = [
        effect
        for effect in LIBRARY.values()
        if effect.id not in leave_out
        and _possible(effect, rig, amplifier=amplifier)
        and not (pulled and (effect.depends_on == "voltage" or effect.id in _READ_THE_DRIVE))
        and not (pulled and _tells_its_zero(rig) and effect.stands_for == _OF_THE_ZERO)
    ]
    same = {alias for effect in possible for alias in effect.aliases}
    found = []
    for effect in possible:
        lower = rig.inertias == 2 and effect.equation != "upper"
        if effect.id not in same:
            found.append(candidate_of(effect, scales[1 if lower else 0]))
    return [*found, *free_shapes(rig, motions, scales, amplifier=amplifier)]


def _possible(effect: Effect, rig: Rig, *, amplifier: bool) -> bool:
    given = {str(entry.get("id")) for entry in rig.effects}
    if effect.id in given or (effect.stands_for and getattr(rig, effect.stands_for) != 0.0):
        return False
    if rig.inertias == 1 and (effect.equation != "upper" or effect.id in _SHIFTS):
        return False
    return amplifier or is_behind_the_current(effect)


def second_gear(effect: Effect, there: Iterable[Effect]) -> bool:
    """Whether an effect puts the motor behind a gear beside another one that does.

    Args:
        effect: that may join.
        there: effects of the rig.
    """
    return effect.replaces_balance and any(other.replaces_balance for other in there)


def is_behind_the_current(effect: Effect) -> bool:
    """Whether a measured current or torque leaves room for it: it is no amplifier's."""
    return effect.component != "actuator" or effect.id in _BEHIND_THE_CURRENT
