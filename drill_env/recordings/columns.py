"""Which column of a file feeds which channel, and in what unit."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias, cast

from drill_env._errors import InputError, printable
from drill_env.recordings.limits import LARGEST
from drill_env.recordings.prescribed import UNKNOWN
from drill_env.recordings.units import (
    ANGLES,
    CHANNELS,
    COUNTED,
    INERTIAS,
    NUMBERED,
    UNITS,
    Channel,
)

# What a file writes beside them under these names is often computed from them.
_STANDS_FOR: dict[Channel, Channel] = {
    "u": "torque", "torque": "u", "omega_u": "theta_u", "omega_l": "theta_l",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Column:
    """One channel's column in a file, or the number in its place.

    Attributes:
        name: the column's name in the file.
        unit: the unit as stated, None when nothing was stated.
        scale: SI value of one unit.
        turn: counts per revolution, for counted angles.
        constant: a number in SI units that stands for the whole column.
        unknown: whether it stands for a drive that nothing is known of.
        delay: how long before its row's time a value belongs, s.
    """

    name: str
    unit: str | None = None
    scale: float = 1.0
    turn: float | None = None
    constant: float | None = None
    unknown: bool = False
    delay: float = 0.0

    @property
    def stated(self) -> bool:
        """Whether a unit was stated, so that no check second-guesses it."""
        return self.unit is not None


ColumnMap: TypeAlias = Mapping[Channel, str]
"""Channel to "COLUMN[:UNIT][@DELAY]", as `parse_map` returns it; a drive, a load and an added
inertia also to a number, and u to "unknown"."""


def parse_map(entries: Iterable[str]) -> dict[Channel, str]:
    """Read ``CHANNEL=COLUMN[:UNIT][@DELAY]`` entries.

    Units: t in s, ms, us, ns, min; u in V, mV, uV, kV; torques in Nm, mNm, uNm, Ncm, kNm or, of
    a linear axis, N, mN, kN; angles in rad, mrad, deg, turn, rev, m, cm, mm, um or ``counts/N``
    (N counts per revolution); velocities in any of these a second (rad/s, deg/s, ...), rpm or
    ``counts/N`` (counts a second); added inertias in kgm2, gm2, kgcm2, gcm2 or, of a linear axis,
    kg, g; or a bare number to multiply by. For drives, loads and added inertias a number may stand
    in place of the column: ``u=0`` is a free decay. ``u=unknown`` makes the upper disc's measured
    motion the input. With a delay in s, of any channel but t, what stands at a time belongs so much
    earlier (later if it is negative).

    Raises:
        InputError: an entry has no "=", an unknown channel or comes twice.
    """
    found: dict[Channel, str] = {}
    for entry in entries:
        name, equals, column = entry.partition("=")
        channel = cast(Channel, name.strip())
        if not equals or not column.strip():
            raise InputError(f"--map {entry}: write CHANNEL=COLUMN[:UNIT], for example t=time:ms")
        if channel not in CHANNELS:
            raise InputError(f"--map {entry}: unknown channel; known: {', '.join(CHANNELS)}")
        if channel in found:
            raise InputError(f"--map names {channel} twice; keep one of them")
        found[channel] = column.strip()
    return found


def resolve(
    source: str,
    found: Sequence[str],
    column_map: ColumnMap | None,
    others: Sequence[str] = (),
) -> dict[Channel, Column]:
    """Match channels with the columns of a file.

    Args:
        source: the file, for messages.
        found: the file's columns.
        column_map: mapped channels; the others are looked for under their own names, a torque
            only where no voltage is, and a velocity only where the disc has no angle.
        others: what else the file holds, for messages.

    Raises:
        InputError: a mapped column or the time column is not there, a unit is unknown, or both
            a voltage and a torque are mapped.
    """
    given: ColumnMap = column_map or {}
    for name in sorted(set(given) - set(CHANNELS)):
        raise InputError(f"column map: unknown channel {name!r}; known: {', '.join(CHANNELS)}")
    columns: dict[Channel, Column] = {
        channel: _parse(source, channel, given[channel], found, others)
        for channel in CHANNELS
        if channel in given
    }
    if "u" in columns and "torque" in columns:
        raise InputError(
            f"{source}: u and torque are both mapped, and either drives the rig: map one of them"
        )
    for channel in CHANNELS:
        stands_for = _STANDS_FOR.get(channel)
        if channel in found and channel not in columns and stands_for not in columns:
            columns[channel] = Column(channel)
    if "t" not in columns:
        raise InputError(missing_text(source, ("t",), found, others))
    return columns


def missing_text(
    source: str, channels: Sequence[str], found: Sequence[str], others: Sequence[str] = ()
) -> str:
    """The message for channels that a file lacks, with the columns and what else it has."""
    one = channels[0]
    short = [f.lower() for f in found if len(f) < 60]
    near = difflib.get_close_matches(one.lower(), short, n=1, cutoff=0.7)
    guess = next((f for f in found if near and f.lower() == near[0]), "COLUMN")
    current = next((f for f in found if "current" in f.lower()), "CURRENT")
    torque = (
        f" (or --map torque=COLUMN, a measured torque, --map torque={printable(current, 60)}:0.05, "
        "a current times the torque constant, Nm/A, --map u=0, no drive, or --map u=unknown, an "
        "upper disc whose motion was measured and moved by whatever)"
        if one == "u"
        else ""
    )
    return (
        f"{source}: no column {' and '.join(channels)}; found: {listed([*found, *others])}. "
        f"Name it, for example --map {one}={guess}{torque}"
    )


def listed(found: Sequence[str]) -> str:
    """The first names of a file's columns, and how many there are."""
    shown = ", ".join(printable(name, 60) for name in found[:20])
    return f"{shown}, … ({len(found)} in all)" if len(found) > 20 else shown or "none"


def wanted_names(mapped: Iterable[str]) -> list[str]:
    """What the texts of a map may name in a file: each whole, without a delay, without a unit."""
    texts = list(mapped)
    texts += [_without_delay(text)[0] for text in texts]
    return list(dict.fromkeys([*texts, *(text.rpartition(":")[0] for text in texts)]))


def _without_delay(text: str) -> tuple[str, float]:
    name, at, delay = text.rpartition("@")
    seconds = number_of(delay) if at and name else None
    return (text, 0.0) if seconds is None else (name, seconds)


def _parse(
    source: str, channel: Channel, text: str, found: Sequence[str], others: Sequence[str]
) -> Column:
    if channel == "u" and text == UNKNOWN and text not in found:
        return Column(text, unknown=True)
    # A column may itself hold a colon or an @, so the whole text is tried first.
    whole, delay = (text, 0.0) if text in found else _without_delay(text)
    name, colon, unit = (whole, "", "") if whole in found else whole.rpartition(":")
    if not colon or unit.endswith((")", "]")):
        name, unit = whole, ""
    number = number_of(name) if channel in NUMBERED and name not in found else None
    if name not in found and number is None:
        text = missing_text(source, (name,), found, others)
        raise InputError(text.replace(f"{name}=", f"{channel}=", 1))
    if delay and (channel in ("t", *INERTIAS) or number is not None):
        raise InputError(f"--map {channel}={text}: no delay here; give it to the other channels")
    column = Column(name, unit or None, delay=delay)
    turn = counts_per_turn(unit)
    if turn and channel in COUNTED:
        scale = 2.0 * math.pi / turn
        return replace(column, scale=scale, turn=turn if channel in ANGLES else None)
    scale = (UNITS[channel].get(unit) or _number(channel, text, unit)) if unit else 1.0
    if number is not None:
        most, si = LARGEST[channel]
        number *= scale
        if not abs(number) <= most:
            raise InputError(f"{source}: {channel}={text} is beyond {most:g} {si}; give less")
    return replace(column, scale=scale, constant=number)


def counts_per_turn(unit: str) -> float | None:
    """N of the unit ``counts/N``, None of any other."""
    counts = re.fullmatch(r"counts/(\d+(?:\.\d+)?(?:[eE]\d+)?)", unit)
    return (float(counts[1]) or None) if counts else None


def number_of(text: str) -> float | None:
    """The finite number that a text is, None where it is none."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def _number(channel: Channel, text: str, unit: str) -> float:
    scale = number_of(unit)
    if scale:
        return scale
    names = [*UNITS[channel], *(["counts/N"] if channel in COUNTED else []), "a number to multiply"]
    raise InputError(f"--map {channel}={text}: unknown unit {unit!r}; known: {', '.join(names)}")
