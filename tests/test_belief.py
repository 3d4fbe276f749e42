"""From evidence to probability: what the numbers may claim."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drill_env.diagnosis.belief import UNLISTED, probabilities
from drill_env.diagnosis.rounds import Attempt, Round
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY

NAMES = ("actuator_lag", "gear_compliance", "string_damping", "unbalance")


def a_round(criteria):
    """One search in which these names gained so much."""
    attempts = [
        Attempt(None, Term(Named(LIBRARY[name]), np.zeros(0)), value, value)
        for name, value in zip(NAMES, criteria, strict=False)
    ]
    return Round(None, (), tuple(sorted(attempts, key=lambda a: -a.criterion)), ())


def test_no_evidence_among_candidates_outweighs_what_no_library_holds():
    told = probabilities(a_round([1e6]))
    assert told["actuator_lag"] == pytest.approx(1.0 - UNLISTED, abs=1e-9)


def test_two_that_explain_as_much_share_alike():
    told = probabilities(a_round([5000.0, 5000.0]))
    assert told["actuator_lag"] == told["gear_compliance"] == pytest.approx(0.5 * (1.0 - UNLISTED))


def test_what_was_given_up_has_none():
    told = probabilities(a_round([5000.0, 4000.0]), ["actuator_lag"])
    assert told["actuator_lag"] == 0.0
    assert told["gear_compliance"] == pytest.approx(1.0 - UNLISTED, abs=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.floats(0.0, 1e5), min_size=1, max_size=4))
def test_probabilities_follow_the_evidence_and_leave_room_for_the_unlisted(criteria):
    told = probabilities(a_round(criteria))
    named = dict(zip(NAMES, criteria, strict=False))
    order = sorted(named, key=lambda name: named[name])
    assert [told[n] for n in order] == sorted(told[n] for n in order)
    assert all(p >= 0.0 for p in told.values())
    assert sum(told[name] for name in named) <= 1.0 - UNLISTED + 1e-12
    assert sum(told.values()) <= 1.0 + 1e-12
