"""Parameters of the rig that the torques of an effect depend on, as its function tells."""

from __future__ import annotations

from functools import cache

from drill_env.effects import Effect
from drill_env.effects.declared import reads
from drill_env.parameters.rig import LOWER_LAW

# What an effect's function mentions where its torque along a known motion depends on a parameter of
# the rig: the parameter itself, or a port or field that has to do with it. A friction more or less
# is no larger than what pulls at a disc that rests.
_DRIVE, _UPPER, _LOWER = {"drive", "inertia_u"}, {"size_u", "scale_u"}, {"scale_l", "read_l"}
_MENTIONS = {
    **dict.fromkeys(("Tsu", "dTsu", "bu", "dbu"), _DRIVE | {"scale_u", "friction_u"}),
    **dict.fromkeys(LOWER_LAW, _LOWER | {"friction_l"}),
    "km": _DRIVE | _UPPER | {"volts"},
    "ktheta": _DRIVE | _UPPER | _LOWER | {"size_l", "pull"},
    "Ju": _DRIVE,
    "Jl": set[str](),
}


@cache
def made_of(effect: Effect) -> tuple[str, ...]:
    """Parameters of the rig that an effect's torques along a known motion depend on."""
    return tuple(name for name in _MENTIONS if reads(effect.kernel, name, *_MENTIONS[name]))
