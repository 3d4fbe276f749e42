"""Places of entries among the inner states and switches of all."""

from __future__ import annotations

import numpy as np


def number_places(entries: np.ndarray) -> None:
    """Fill in the first inner state and the first switch of each entry, records of `ENTRY`."""
    for first, count in (("first_state", "states"), ("first_switch", "switches")):
        entries[first] = np.cumsum(entries[count]) - entries[count]
