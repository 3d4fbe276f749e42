"""Effects in complex arithmetic, for exact derivatives of the motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numba.core.errors import NumbaError

from drill_env._errors import InputError
from drill_env.effects import LIBRARY
from drill_env.effects._table import sampled, tabulated
from drill_env.effects._table_entry import is_located
from drill_env.effects.signal import RESPOND_SLOPES


def slope_code(entry: Mapping[str, Any]) -> int:
    """What compiled code calls an effect of a rig by in complex arithmetic, in this process.

    Raises:
        InputError: its function cannot be compiled so.
    """
    name = str(entry["id"])
    table = tabulated if is_located(entry) else sampled
    kernel = table if name == "table" else LIBRARY[name].kernel
    try:
        return int(kernel.address_for(RESPOND_SLOPES))
    except NumbaError as error:
        raise InputError(
            f"sensitivity is not offered with effect {name}: its function cannot be evaluated in "
            "complex arithmetic; take cos, exp and the like from numpy and compare real parts"
        ) from error
