"""What sensitivities of a rig with effects are carried in, and how it is laid out."""

from __future__ import annotations

import numpy as np

from drill_env._errors import InputError
from drill_env.effects import LIBRARY
from drill_env.effects.declared import Declared, slope_code
from drill_env.effects.signal import (
    ENTRY_SLOPES,
    MOST_BRANCHES,
    PARAMETERS_SLOPES,
    PORTS_SLOPES,
    SIGNAL_SLOPES,
)
from drill_env.integrator.records import MAX_STAGES, MOST_COLUMNS, MOST_ROWS, N_STATE
from drill_env.parameters import SYMBOLS, Rig

FIRST_NUMBER = N_STATE + len(SYMBOLS)

SLOPES = np.dtype(
    [
        ("sens", "f8", (MOST_ROWS, MOST_COLUMNS)),
        ("rates", "f8", (MAX_STAGES, MOST_ROWS, MOST_COLUMNS)),
        ("along", "f8", (MOST_ROWS,)),  # direction of the derivative at hand
        # Rates before the event at hand and after it, and whether it is a disc's that moved.
        ("before", "f8", (MOST_ROWS,)), ("after", "f8", (MOST_ROWS,)), ("stopped", "i8"),
        ("moment", "f8", (MOST_COLUMNS,)),  # derivatives of the present instant, of an event
        ("since", "f8", (MOST_COLUMNS,)),  # and of that at which the lower disc came to rest
        ("columns", "i8"), ("width", "i8"),  # all, and those before the first inner states'
        ("effect", "i8", (MOST_COLUMNS,)),  # whose number a column is of, -1 for none
        ("number", "i8", (MOST_COLUMNS,)),
        ("entries", "i8"),  # address of the effects
        ("parameters", "i8"),  # and of `p`, which begins with them
        ("gradient", "f8", (len(SYMBOLS),)),
        ("y", "c16", (MOST_ROWS,)), ("k", "c16", (MOST_ROWS,)),
        ("gaps", "c16", (3 + MOST_BRANCHES,)),
        ("p", PARAMETERS_SLOPES), ("signal", SIGNAL_SLOPES), ("ports", PORTS_SLOPES),
    ],
    align=True,
)  # fmt: skip
"""Sensitivities of the state and the inner states, one column each by the initial state, the
parameters, the numbers of the effects and the first inner states; and working arrays in complex
arithmetic."""


def numbers(rig: Rig) -> list[tuple[int, int]]:
    """Place of the effect and of its parameter, of each column that belongs to an effect.

    A table has none: its knots and values are what it is, not what it depends on.
    """
    found = []
    for place, entry in enumerate(rig.effects):
        count = 0 if entry["id"] == "table" else len(LIBRARY[str(entry["id"])].parameters)
        found += [(place, number) for number in range(count)]
    return found


class Slopes:
    """The record of `SLOPES` of a rig; must live as long as its address is used.

    Args:
        rig: parameters and effects.
        effects: the same effects as the compiled code reads them.
        p: the same parameters, a record of `PARAMETERS`.

    Raises:
        InputError: an effect reads the past, cannot be differentiated, or there are too many.
    """

    def __init__(self, rig: Rig, effects: Declared, p: np.void) -> None:
        if effects.reads_past:
            raise InputError(
                "sensitivity is not offered with input_delay: what the voltage was would have to "
                "be differentiated by the moments at which it jumped; leave the effect or the "
                "sensitivity out"
            )
        self.entries = np.zeros(len(effects.entries), dtype=ENTRY_SLOPES)
        for name in ENTRY_SLOPES.names or ():
            self.entries[name] = effects.entries[name]
        for row, place in enumerate(effects.order):
            self.entries["code"][row] = slope_code(rig.effects[place])
        self.record = np.zeros(1, dtype=SLOPES)
        record = self.record[0]
        record["entries"] = self.entries.ctypes.data
        record["parameters"] = self.record["p"].ctypes.data
        for name in PARAMETERS_SLOPES.names or ():
            record["p"][name] = p[name]
        record["effect"] = record["number"] = -1
        found = numbers(rig)
        self.width = FIRST_NUMBER + len(found)
        column = self.width + effects.inner
        if column > MOST_COLUMNS:
            raise InputError(
                f"the effects have {len(found)} numbers together, and sensitivities are carried "
                f"for {MOST_COLUMNS - FIRST_NUMBER - effects.inner}: leave an effect out"
            )
        for i, (place, number) in enumerate(found):
            record["effect"][FIRST_NUMBER + i] = effects.order.index(place)
            record["number"][FIRST_NUMBER + i] = number
        record["columns"] = column
        record["sens"][:N_STATE, :N_STATE] = np.eye(N_STATE)
        inner = np.arange(effects.inner)
        record["sens"][N_STATE + inner, self.width + inner] = 1.0
        record["width"] = self.width

    def equip(self, work: np.ndarray) -> None:
        """Tell the working arrays."""
        work["restless"] = 2
        work["variation"] = self.record.ctypes.data
        work["variation_at"] = self.record["sens"].ctypes.data
        work["width"] = self.width

    def matrix(self, inner: int) -> np.ndarray:
        """What has been carried so far: a row each of the state and the inner states."""
        return self.record["sens"][0, : N_STATE + inner, : self.width + inner].copy()
