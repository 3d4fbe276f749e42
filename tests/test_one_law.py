"""Two functions of one coordinate at one place are one law, unless both are large."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drill_env.diagnosis import one_law as module
from drill_env.diagnosis.one_law import one_law
from drill_env.diagnosis.rounds import Found
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.decide import least_share

CRITERIA = Criteria()


def named(name: str) -> Term:
    return Term(Named(LIBRARY[name]), np.array([p.grid[0] for p in LIBRARY[name].parameters]))


def found(first: str, second: str, alone: float, both: float) -> Any:
    """A search whose fits with one and with two names gain so much over the rig alone."""
    one, other = named(first), named(second)
    fits = [SimpleNamespace(terms=terms, bic=-gain)
            for terms, gain in (((), 0.0), ((one,), alone), ((one, other), both))]  # fmt: skip
    rounds = tuple(SimpleNamespace(before=fit, later=None) for fit in fits[:2])
    return Found(SimpleNamespace(), fits[0], rounds, fits[2])  # type: ignore[arg-type]


def judged(error: float) -> Any:
    n = 40
    return SimpleNamespace(
        short=np.full((n, 2), error), measured=np.zeros((n, 2)), spans=np.array([0, 20])
    )


@pytest.mark.parametrize(
    ("first", "second", "alike"),
    [
        ("string_hardening", "string_play", True),
        ("lower_stribeck", "lower_gaussian_stribeck", True),
        # Friction falls and drag rises; another coordinate; what happens in time; harmonics of one
        # angle; a memory; what most machines have.
        ("lower_stribeck", "quadratic_drag", False),
        ("string_hardening", "string_damping", False),
        ("friction_step", "friction_warmup", False),
        ("torque_ripple", "gear_eccentricity", False),
        ("actuator_lag", "input_delay", False),
        ("upper_coulomb", "upper_viscous", False),
    ],
)
def test_what_completes_a_law_is_no_second_name(first: str, second: str, alike: bool):
    """A string that stiffens by another power was told as hardening beside a play."""
    for a, b in ((first, second), (second, first)):
        told = one_law(found(a, b, 500.0, 1000.0), (), (), (), CRITERIA)
        assert told == ({b: a} if alike else {})


@pytest.mark.parametrize(
    ("second", "alone", "completes"),
    [
        ("lower_stribeck", 900.0, True),
        ("lower_stribeck", 700.0, False),
        # Of another coordinate it is another cause, however small.
        ("unbalance", 990.0, False),
        ("friction_drift", 990.0, False),
    ],
)
def test_of_one_curve_a_name_stands_from_its_share_of_it(
    second: str, alone: float, completes: bool
):
    """A drag with w^1.8 was told as a quadratic one beside friction that falls."""
    told = one_law(found("quadratic_drag", second, alone, 1000.0), (), (), (), CRITERIA)
    assert told == ({second: "quadratic_drag"} if completes else {})


@pytest.mark.parametrize(("alone", "completes"), [(0.1, True), (0.6, False)])
def test_unseen_recordings_tell_the_share_where_there_are_any(
    monkeypatch: pytest.MonkeyPatch, alone: float, completes: bool
):
    """By the likelihood of what was fitted both are near a half; squared errors say more."""
    monkeypatch.setattr(module, "judge_all", lambda *args: (judged(alone),))
    pair = found("quadratic_drag", "lower_stribeck", 500.0, 1000.0)
    told = one_law(pair, [SimpleNamespace()], [judged(1.0)], [judged(0.01)], CRITERIA)  # type: ignore[list-item]
    assert told == ({"lower_stribeck": "quadratic_drag"} if completes else {})


@pytest.mark.parametrize(
    ("first", "second", "share"),
    [
        ("upper_gaussian_stribeck", "upper_drag_above_speed", 1.0 - CRITERIA.share),
        ("upper_gaussian_stribeck", "torque_ripple", CRITERIA.neighbour),
        ("upper_coulomb", "upper_stribeck", CRITERIA.neighbour),
    ],
)
def test_on_an_axis_a_second_name_of_one_curve_is_more_than_its_remainder(first, second, share):
    def candidate(name: str) -> Any:
        effect = LIBRARY[name]
        return SimpleNamespace(
            effect=effect, component=effect.component, depends_on=effect.depends_on
        )

    before = SimpleNamespace(chosen=SimpleNamespace(candidate=candidate(first)))
    assert least_share(candidate(second), [before], CRITERIA) == pytest.approx(share)  # type: ignore[list-item]
