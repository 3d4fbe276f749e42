"""Candidates that are another one, or the rig's own physics, are no names."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drill_env.diagnosis.rounds import (
    Attempt,
    at_its_limit,
    at_range_end,
    outdone,
)
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY

MINUTE = SimpleNamespace(motions=(SimpleNamespace(t=np.array([0.0, 30.0, 60.0])),))


def attempt(name: str, *q: float, fit: Any = MINUTE) -> Attempt:
    return Attempt(fit, Term(Named(LIBRARY[name]), np.array(q)), 100.0, 90.0)


def test_play_without_a_gap_is_a_springy_gear():
    spring = attempt("gear_compliance", 20.0, 0.3, 0.1, 0.05)
    closed = attempt("gear_backlash", 1e-4, 0.3, 20.0, 0.1, 0.05)
    open_ = attempt("gear_backlash", 4e-3, 0.3, 20.0, 0.1, 0.05)
    assert at_its_limit(closed, [closed, spring])
    assert not at_its_limit(closed, [closed])
    assert not at_its_limit(open_, [open_, spring])
    assert not at_its_limit(spring, [closed, spring])


@pytest.mark.parametrize("minutes, told", [(1.0, True), (10.0, False)])
def test_a_warm_up_far_slower_than_the_recordings_is_constant_friction(minutes: float, told: bool):
    lasting = SimpleNamespace(motions=(SimpleNamespace(t=np.array([0.0, 60.0 * minutes])),))
    slow = attempt("friction_warmup", 0.1, 900.0, fit=lasting)
    assert at_its_limit(slow, []) == told
    assert not at_its_limit(attempt("friction_warmup", 0.1, 100.0, fit=lasting), [])


@pytest.mark.parametrize("time, told", [(0.1, True), (3.0, False)])
def test_a_step_of_friction_at_the_start_is_the_rigs_own(time: float, told: bool):
    lasting = SimpleNamespace(motions=(SimpleNamespace(t=np.array([0.0, 60.0])),))
    assert at_its_limit(attempt("friction_step", 0.1, time, fit=lasting), []) == told


@pytest.mark.parametrize(
    ("name", "numbers", "told"),
    [
        # The brake settles faster, or wears off sooner, than is searched.
        ("friction_settling", (-0.006, 0.5), True),
        ("friction_settling", (-0.006, 0.6), False),
        ("wear", (0.01, 1.0), True),
        ("actuator_lag", (20.0,), True),
        # All of the friction is the motor's, and hardly any damping: no end of a search.
        ("gear_compliance", (20.0, 0.3, 1.0, 0.002), False),
        # Damped until no critical speed shows.
        ("whirl_drag", (0.2, 5.0, 0.7071), True),
        ("whirl_drag", (0.2, 5.0, 0.4), False),
        # None at all.
        ("missed_counts_lower", (0.1, 0.0), False),
    ],
)
def test_a_number_at_the_end_of_its_range_is_not_determined(name, numbers, told):
    assert at_range_end(attempt(name, *numbers).term) == told


def test_a_name_that_explains_less_than_what_was_taken_is_outdone():
    ripple = replace(attempt("torque_ripple", 0.01, 0.0, 6.0), criterion=14000.0)
    lag = replace(attempt("friction_lag", 0.01), criterion=25000.0)
    taken: Any = SimpleNamespace(term=SimpleNamespace(id="error_l_of_theta_l"), criterion=26000.0)
    first = SimpleNamespace(named=(ripple, lag), shapes=(taken,))
    found: Any = SimpleNamespace(rounds=(first,), final=SimpleNamespace(terms=(taken.term,)))
    assert outdone(found, "torque_ripple", 0.8)
    assert not outdone(found, "friction_lag", 0.8)
    # What was never tried, or stands beside nothing, is not outdone.
    assert not outdone(found, "upper_offset", 0.8)
    nothing: Any = SimpleNamespace(rounds=(first,), final=SimpleNamespace(terms=()))
    assert not outdone(nothing, "torque_ripple", 0.8)
