"""Which rigs can be continued."""

from __future__ import annotations

from drill_env._errors import InputError
from drill_env.parameters import Rig


def require_string(rig: Rig) -> None:
    """Refuse a rig without a string.

    Raises:
        InputError: the rig has one inertia.
    """
    if rig.inertias == 1:
        raise InputError("continuation needs a rig with two inertias; this one has one")


def require_plain(rig: Rig) -> None:
    """Refuse what continuation does not cover.

    Raises:
        InputError: the rig has one inertia or effects.
    """
    require_string(rig)
    if rig.effects:
        names = ", ".join(str(effect.get("id", "?")) for effect in rig.effects)
        raise InputError(
            f"limit cycles of a rig with [[effects]] ({names}) are not continued: `bifurcation` "
            "--rig without a mode, or continuation.extended_diagram, gives its equilibria, Hopf "
            "points and what it settles on; or continue it without them, rig.replace(effects=())"
        )
