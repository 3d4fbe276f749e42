"""The effects that a rig declares, checked and laid out for the compiled code."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any, TypeAlias

import numpy as np
from numba.core.errors import NumbaError

from drill_env._checks import real
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.effects import LIBRARY, Effect
from drill_env.effects._effect import SIDES, reads
from drill_env.effects._table import sampled, tabulated
from drill_env.effects._table_entry import is_located, table_entry
from drill_env.effects.pace import REACH, slopes_when
from drill_env.effects.signal import (
    ENTRY,
    MOST_BRANCHES,
    MOST_INNER,
    MOST_STATES,
    PORTS,
    RESPOND_SLOPES,
    SIGNAL,
    number_places,
)
from drill_env.friction import kernel_record
from drill_env.parameters import Rig


@dataclass(frozen=True, eq=False)
class Declared:
    """Effects as the compiled code reads them.

    Attributes:
        entries: records of `ENTRY`, which hold addresses of this process; shape (n,). Whoever
            hands them on must keep this object as long.
        tables: what some of the addresses point to.
        order: place of each entry among the rig's effects.
        pace: fastest rate (1/s) at which inner states relax or ring, of those to which the motion
            makes no difference.
    """

    entries: np.ndarray
    tables: tuple[FloatArray, ...] = ()
    order: tuple[int, ...] = ()
    pace: float = 0.0

    @cached_property
    def inner(self) -> int:
        """Number of inner states."""
        return int(self.entries["states"].sum())

    @cached_property
    def switches(self) -> int:
        """Number of switches."""
        return int(self.entries["switches"].sum())

    @cached_property
    def acts(self) -> bool:
        """Whether any effect enters the motion or has an inner state."""
        return len(self._acting) > 0

    @cached_property
    def _acting(self) -> np.ndarray:
        return self.entries[self.entries["idle"] == 0]

    @cached_property
    def _late(self) -> np.ndarray:
        return self.entries[(self.entries["delayed"] == 1) & (self.entries["senses"] == 0)]

    @cached_property
    def restless(self) -> int:
        """What may change while both discs rest under a constant voltage.

        0: nothing; 1: inner states, until their rates are zero; 2: an effect that reads a clock.
        """
        return 2 if self._acting["timed"].any() else int(self.inner > 0)

    @cached_property
    def wants_own_law(self) -> bool:
        """Whether the lower disc's friction is that of its own speed, or an effect reads that."""
        return bool(self._acting["reads_law"].any()) or not self._acting["moves_law"].any()

    @cached_property
    def reads_past(self) -> bool:
        """Whether an effect reads the voltage late."""
        return len(self._late) > 0

    @cached_property
    def delay(self) -> float:
        """By how much the voltage acts late, s."""
        return float(self._late["delay"].sum())

    @cached_property
    def longest_step(self) -> float:
        """Step (s) within which nothing of the effects swings unseen while the rig rests.

        A tenth of the shortest period: the error estimate of a rig at rest sees no torque. And
        `REACH` over the fastest rate of an inner state.
        """
        fastest = max(float(self.entries["hertz"].max(initial=0.0)) / 0.1, self.pace / REACH)
        return 1.0 / fastest if fastest > 0.0 else math.inf

    @cached_property
    def encoder_delays(self) -> FloatArray:
        """By how much each effect reads an angle late, s; 0 for most; shape (n,)."""
        late = (self.entries["delayed"] == 1) & (self.entries["senses"] == 1)
        return np.where(late, self.entries["delay"], 0.0)


_NONE = Declared(np.zeros(0, dtype=ENTRY))


def declared(rig: Rig) -> Declared:
    """The rig's effects as the compiled code reads them.

    Raises:
        InputError: an effect is unknown, a parameter is missing, unknown or out of range, there
            are too many, or the rig has no such component.
    """
    if not rig.effects:
        return _NONE
    rows = []
    for place, entry in enumerate(rig.effects):
        if not isinstance(entry, Mapping):
            raise InputError(f"rig effect {place + 1} is {entry!r}; give a table")
        try:
            rows.append(_row(entry, rig))
        except InputError as error:
            raise InputError(f"rig effect {place + 1}: {error}") from error
    found = _laid_out(rows)
    return replace(found, pace=max(_pace(entry, rig) for entry in found.entries))


# Rest, and turning with all inner states wound up either way, beyond any play.
_STANDS = (0.0, 0.0), (1.0, -10.0), (1.0, 10.0)


def _pace(entry: np.ndarray, rig: Rig) -> float:
    """See `Declared.pace`; where the motion makes a difference the steps ask for it themselves."""
    count, found = int(entry["states"]), np.zeros((len(_STANDS), 5, MOST_STATES))
    if count == 0 or entry["idle"]:
        return 0.0
    signal, ports = np.zeros(1, dtype=SIGNAL)[0], np.zeros(1, dtype=PORTS)[0]
    for stand, slopes in zip(_STANDS, found, strict=True):
        slopes_when(kernel_record(rig)[0], entry.copy(), signal, ports, *stand, slopes)
    found = found[:, :count, :count]
    # Beside the largest slope what rounding leaves of a difference of rates is far below this.
    entry["paced"] = np.ptp(found, axis=0).max() > 1e-5 * np.abs(found).max()
    return 0.0 if entry["paced"] else float(np.abs(np.linalg.eigvals(found[0])).max())


def bundled(effects: Sequence[tuple[Effect, FloatArray]]) -> Declared:
    """Effects with their numbers as the compiled code reads them."""
    return _laid_out([_entry(effect, numbers) for effect, numbers in effects])


def slope_code(entry: Mapping[str, Any]) -> int:
    """What compiled code calls an effect of a rig by in complex arithmetic, for exact derivatives.

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


def _laid_out(rows: Sequence[_Row]) -> Declared:
    # A drive takes the voltage that the others of the motor leave; some look at all the others.
    order = tuple(sorted(range(len(rows)), key=lambda place: rows[place][0]))
    ordered = [rows[place] for place in order]
    entries = np.zeros(len(rows), dtype=ENTRY)
    for i, (_, entry, _) in enumerate(ordered):
        entries[i] = entry
    number_places(entries)
    found = Declared(entries, tuple(row[2] for row in ordered), order)
    if found.inner > MOST_INNER or found.switches > MOST_BRANCHES:
        raise InputError(
            f"the effects have {found.inner} inner states and {found.switches} switches together, "
            f"more than {MOST_INNER} and {MOST_BRANCHES}: leave some out"
        )
    if len(found._late) > 1:
        raise InputError("the voltage is delayed by two effects: give one with the whole delay")
    if np.count_nonzero(entries["drives"]) > 1:
        raise InputError("the motor is put behind two gears by two effects: leave one out")
    return found


_Row: TypeAlias = tuple[int, np.ndarray, FloatArray]


def _row(entry: Mapping[str, Any], rig: Rig) -> _Row:
    """Rank in the order of evaluation, entry and table."""
    name = entry.get("id")
    if name == "table":
        row, table = table_entry(entry)
        _check_component("table", "upper" if row["upper"] else "lower", rig)
        return 0, row, table
    effect = LIBRARY.get(name) if isinstance(name, str) else None
    if effect is None:
        raise InputError(f"id is {name!r}; known: {', '.join([*LIBRARY, 'table'])}")
    _check_component(effect.id, effect.equation, rig)
    values = {key: value for key, value in entry.items() if key != "id"}
    values = {str(key): real(value, f"effect {name}: {key}") for key, value in values.items()}
    return _entry(effect, effect.vector(values))


def _entry(effect: Effect, numbers: FloatArray) -> _Row:
    entry = _without_numbers(effect).copy()
    entry["q"][: len(numbers)] = numbers
    for key, name in (("delay", effect.delay), ("hertz", effect.swings)):
        if name:
            entry[key] = numbers[[p.name for p in effect.parameters].index(name)]
    return effect.replaces_balance + 2 * effect.last, entry, np.zeros((2, 0))


@cache
def _without_numbers(effect: Effect) -> np.ndarray:
    entry = np.zeros((), dtype=ENTRY)
    entry["code"], entry["senses"] = effect.kernel.address, effect.senses
    entry["idle"] = effect.senses and not effect.states
    entry["states"], entry["switches"] = effect.states, effect.switches
    entry["drives"] = effect.replaces_balance
    entry["upper"], entry["delayed"] = effect.equation == "upper", bool(effect.delay)
    entry["timed"] = reads(effect.kernel, "t", "dwell_l")
    entry["sided"], entry["only_at_rest"] = reads(effect.kernel, *SIDES), effect.only_at_rest
    entry["reads_law"] = reads(effect.kernel, "friction_l")
    entry["moves_law"] = reads(effect.kernel, "read_l")
    return entry


def _check_component(name: str, equation: str, rig: Rig) -> None:
    if rig.inertias == 1 and equation != "upper":
        raise InputError(
            f"effect {name} acts on the string or the lower disc, which a rig with "
            "inertias = 1 lacks; remove it"
        )
