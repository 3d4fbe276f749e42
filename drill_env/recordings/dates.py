"""Dates of recordings: in a manifest or in a file's name."""

from __future__ import annotations

import datetime as dt
import re
from typing import Any

from drill_env._errors import InputError

_DATED = re.compile(r"(?<!\d)((?:19|20)\d\d)([-_]?)([01]\d)\2([0-3]\d)(?!\d)")


def date_of(name: str) -> dt.date | None:
    """The date in a file's name, as 2026-01-31, 2026_01_31 or 20260131; None without one."""
    for found in _DATED.finditer(name):
        try:
            return dt.date(int(found[1]), int(found[3]), int(found[4]))
        except ValueError:
            continue
    return None


def date_told(where: str, value: Any) -> dt.date:
    """The date that a manifest gives.

    Args:
        where: what messages call it.
        value: a date, a date with a time, or a text as 2026-01-31.

    Raises:
        InputError: it is none of these.
    """
    try:
        found = dt.date.fromisoformat(value) if isinstance(value, str) else value
    except ValueError:
        found = None
    if not isinstance(found, dt.date):
        raise InputError(f"{where}: date is {value!r}; write date = 2026-01-31")
    return found.date() if isinstance(found, dt.datetime) else found
