"""Checks of what a manifest says of one recording."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from drill_env._checks import real
from drill_env._errors import InputError
from drill_env.recordings.columns import counts_per_turn, number_of
from drill_env.recordings.units import CHANNELS, COUNTED, UNITS, Channel


def check_keys(where: str, table: Mapping[str, Any], known: tuple[str, ...]) -> None:
    """Raise where a table has a key that is not known.

    Raises:
        InputError: naming where.
    """
    unknown = sorted(set(table) - set(known))
    if unknown:
        raise InputError(f"{where}: unknown key {unknown[0]}; known: {', '.join(known)}")


def check_delay(where: str, delay: Any) -> None:
    """Raise where the delays are no numbers by channel.

    Raises:
        InputError: naming where.
    """
    if not isinstance(delay, dict):
        raise InputError(f"{where}: delay is no table; write delay = {{ theta_l = 0.004 }}")
    check_keys(f"{where}: delay", delay, CHANNELS[1:])
    for channel, seconds in delay.items():
        real(seconds, f"{where}: delay.{channel}")


def check_choice(where: str, key: str, value: Any, known: tuple[str, ...]) -> None:
    """Raise where a value is none of the known ones.

    Raises:
        InputError: naming where.
    """
    if value not in known:
        raise InputError(f"{where}: unknown {key} {value!r}; known: {', '.join(known)}")


def check_counts(where: str, merged: Mapping[str, Any]) -> None:
    """Raise where a unit is unknown, or counts lack their number a turn.

    Raises:
        InputError: naming where.
    """
    counts = merged.get("counts_per_rev")
    good = isinstance(counts, (int, float)) and not isinstance(counts, bool) and 1 <= counts < 1e12
    if counts is not None and not good:
        raise InputError(f"{where}: counts_per_rev is {counts!r}; give a number of 1 or more")
    for channel, unit in merged["units"].items():
        counted = COUNTED.get(cast(Channel, channel))
        if unit == counted:
            if counts is None:
                raise InputError(
                    f'{where}: units.{channel} is "{unit}" but counts_per_rev is not given; add it'
                )
        elif unit not in UNITS[cast(Channel, channel)] and not number_of(unit):
            if counted and counts_per_turn(unit):
                continue
            names = [*UNITS[cast(Channel, channel)], *([counted, "counts/N"] if counted else [])]
            raise InputError(
                f"{where}: unknown unit {unit!r} of {channel}; known: {', '.join(names)}, or a "
                "number to multiply by"
            )
