"""A name whose size may be none is no name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drill_env.diagnosis.intervals import numbers_of, sized
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY


def fitted(name: str, q: list[float], deviations: list[float]) -> tuple[Any, Term]:
    """A fit of one rig's number and a term, whose numbers have these standard deviations."""
    term = Term(Named(LIBRARY[name]), np.array(q))
    information = np.diag(np.array([1.0, *deviations]) ** -2.0)
    return SimpleNamespace(
        vector=np.zeros(1), terms=(term,), ends=None, information=information
    ), term


@pytest.mark.parametrize(
    ("name", "q", "deviations", "has_size"),
    [
        ("string_second_spring", [0.0, 0.00355], [0.05, 1e-5], False),
        ("string_second_spring", [0.3, 0.00355], [0.05, 1e-5], True),
        ("quadratic_drag", [1e-4], [1e-4], False),
        ("quadratic_drag", [1e-4], [1e-5], True),
        # A lag's time is no size: how well it is estimated is asked elsewhere.
        ("friction_lag", [1e-4], [1e-3], True),
    ],
)
def test_a_size_whose_interval_holds_zero_is_none(name, q, deviations, has_size):
    assert sized(*fitted(name, q, deviations)) is has_size


def test_a_number_that_is_never_negative_has_no_negative_interval():
    """Of a lognormal the 95 % lie within exp(1.96 s) of the median."""
    wide = numbers_of(*fitted("quadratic_drag", [1e-4], [1e-4]))["coefficient"]
    assert wide.low == pytest.approx(1e-4 * np.exp(-1.959964), rel=0.02)
    assert wide.high == pytest.approx(1e-4 * np.exp(1.959964), rel=0.02)
    narrow = numbers_of(*fitted("quadratic_drag", [1e-4], [1e-5]))["coefficient"]
    assert narrow.high - 1e-4 == pytest.approx(1e-4 - narrow.low)
