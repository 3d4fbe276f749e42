"""Which rigs can be continued."""

from __future__ import annotations

from drill_env._errors import InputError
from drill_env.effects.declared import declared
from drill_env.effects.steady import lasting, unsteady
from drill_env.parameters import Rig


def require_string(rig: Rig) -> None:
    """Refuse a rig without a string.

    Raises:
        InputError: the rig has one inertia.
    """
    if rig.inertias == 1:
        raise InputError("continuation needs a rig with two inertias; this one has one")


def returning(rig: Rig) -> Rig:
    """The rig with those of its effects that act under a constant voltage.

    Raises:
        InputError: the rig has one inertia, an effect is wrong, or with one no motion comes back.
    """
    require_string(rig)
    declared(rig)
    if wandering := unsteady(rig):
        raise InputError(
            f"{', '.join(wandering)} follow time or an angle, or never forget: no equilibrium or "
            "limit cycle comes back to where it was. `bifurcation --rig` without a mode shows what "
            "such a rig settles on; or leave them out"
        )
    return lasting(rig)


def require_plain(rig: Rig) -> None:
    """Refuse what the continuation of a controlled rig does not cover.

    Raises:
        InputError: the rig has one inertia or effects.
    """
    require_string(rig)
    if rig.effects:
        names = ", ".join(str(effect.get("id", "?")) for effect in rig.effects)
        raise InputError(
            f"a controlled rig with [[effects]] ({names}) is not continued: `compare` shows what "
            "it does; or continue it without them, rig.replace(effects=())"
        )
