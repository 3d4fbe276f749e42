"""From evidence to probability: what the numbers may claim."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drill_env.diagnosis import evidence
from drill_env.diagnosis.probability import UNLISTED, of_gain, probability, rivals
from drill_env.diagnosis.rounds import Attempt, Found, Round
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.prediction.criteria import Criteria


def a_round(weights: dict[str, float], **criteria: float) -> Round:
    named = [
        Attempt(None, Term(Named(LIBRARY[name]), np.zeros(0)), value, value)  # type: ignore[arg-type]
        for name, value in criteria.items()
    ]
    named.sort(key=lambda a: -a.criterion)
    return Round(None, (), tuple(named), (), weights)  # type: ignore[arg-type]


def a_search(*rounds: Round) -> Found:
    final: Any = SimpleNamespace(terms=())
    return Found(None, None, rounds, final)  # type: ignore[arg-type]


def test_no_evidence_among_candidates_outweighs_what_no_library_holds():
    found = a_search(a_round({"actuator_lag": 1.0}, actuator_lag=1e6))
    assert probability(found, "actuator_lag") == pytest.approx(1.0 - UNLISTED)


def test_each_name_has_the_probability_of_the_round_that_found_it():
    first = a_round({"unbalance": 0.9, "whirl_drag": 0.1}, unbalance=900.0, whirl_drag=800.0)
    second = a_round({"whirl_drag": 0.7, "actuator_lag": 0.3}, whirl_drag=300.0, actuator_lag=290.0)
    found = a_search(first, second)
    assert probability(found, "unbalance") == pytest.approx(0.9 * (1.0 - UNLISTED))
    assert probability(found, "whirl_drag") == pytest.approx(0.7 * (1.0 - UNLISTED))
    assert probability(found, "string_damping") == 0.0


def test_rivals_are_those_of_the_round_that_found_what_leads():
    first = a_round({}, unbalance=900.0)
    second = a_round({"whirl_drag": 0.7, "actuator_lag": 0.3}, whirl_drag=300.0, actuator_lag=290.0)
    found = a_search(first, second)
    told = rivals(found, "whirl_drag", {"whirl_drag"})
    assert told == [("actuator_lag", pytest.approx(0.3 * (1.0 - UNLISTED)), 10.0)]


def test_a_lone_finding_is_as_probable_as_its_evidence_says():
    """15 nats are even odds; Bayes: each nat more multiplies the odds by e."""
    most = 1.0 - UNLISTED
    assert of_gain(30.0) == pytest.approx(0.5 * most)
    odds = [of_gain(gain) / (most - of_gain(gain)) for gain in (34.0, 36.0)]
    assert odds[1] / odds[0] == pytest.approx(math.e)
    assert of_gain(math.inf) == pytest.approx(most) and of_gain(-math.inf) == pytest.approx(0.0)


@pytest.mark.parametrize(("weight", "told"), [(0.9, True), (0.0, False)])
def test_a_second_name_that_its_own_round_gives_no_chance_is_not_told(monkeypatch, weight, told):
    """A torque pulse was told beside a resonator with a probability of 0.00."""

    def fit(*names: str) -> Any:
        terms = tuple(Term(Named(LIBRARY[n]), np.zeros(0)) for n in names)
        return SimpleNamespace(terms=terms, bic=0.0)

    one, two = fit("upper_resonator"), fit("upper_resonator", "torque_pulse")
    first = Round(fit(), (), (), (), {"upper_resonator": 1.0})
    tried = Attempt(two, two.terms[-1], 800.0, 800.0)
    second = Round(one, (), (tried,), (), {"torque_pulse": weight, "friction_lag": 1.0 - weight})
    found = Found(None, None, (first, second), two)  # type: ignore[arg-type]
    monkeypatch.setattr(evidence._Judge, "earned", lambda *args: True)
    monkeypatch.setattr(evidence, "within_filter", lambda setting, fit: fit)
    judge = evidence._Judge(None, (), Criteria())  # type: ignore[arg-type]
    taken = Attempt(one, one.terms[0], 1e3, 1e3)
    table = SimpleNamespace(whole=500.0)
    assert (judge.climbed(found, taken, table) is two) == told  # type: ignore[arg-type]
