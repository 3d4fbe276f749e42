"""From evidence to probability: what the numbers may claim."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drill_env.diagnosis.belief import UNLISTED, belief_in, probabilities, rivals, standings
from drill_env.diagnosis.named import named_effects
from drill_env.diagnosis.remainder import Remainder
from drill_env.diagnosis.rounds import Attempt, Found, Round
from drill_env.diagnosis.terms import Named, Shape, Term
from drill_env.effects import LIBRARY

NAMES = ("actuator_lag", "gear_compliance", "string_damping", "unbalance")


def a_round(criteria):
    """One search in which these names gained so much."""
    attempts = [
        Attempt(None, Term(Named(LIBRARY[name]), np.zeros(0)), value, value)
        for name, value in zip(NAMES, criteria, strict=False)
    ]
    return Round(
        SimpleNamespace(bic=0.0, terms=()),
        (),
        tuple(sorted(attempts, key=lambda a: -a.criterion)),
        (),
    )


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


def test_what_explains_less_than_two_names_together_is_no_rival_of_theirs():
    """A free shape that alone explains more than the first name had a probability near 1."""
    first = a_round([500.0, 400.0])
    shape = Shape("lower_torque_of_omega_l", "lower", "omega_l", "torque", (0.0, 1.0), unused)
    first = replace(
        first,
        before=SimpleNamespace(bic=0.0, terms=()),
        shapes=(Attempt(None, shape_term(shape), 2e3, 2e3),),
    )
    final = SimpleNamespace(bic=-5000.0, terms=(*(a.term for a in first.named[:1]),))
    beside = {"actuator_lag": 900.0, "gear_compliance": 850.0}
    found = Found(None, None, (first,), final, {"actuator_lag": beside})
    told = standings(found, first)
    assert probabilities(first)[shape.id] > 0.99
    assert told[shape.id][0] < 1e-6 and told[shape.id][1] == pytest.approx(3000.0)
    assert told["gear_compliance"][1] == pytest.approx(50.0)
    assert told["actuator_lag"][0] == pytest.approx(belief_in(found, "actuator_lag"))


def test_a_name_has_even_odds_where_fitted_recordings_ask_for_something_else():
    """Held-out recordings kept the name; both were said with near certainty."""
    shape = Shape("upper_torque_of_omega_u", "upper", "omega_u", "torque", (0.0, 1.0), unused)
    first = a_round([500.0])
    first = replace(
        first,
        before=SimpleNamespace(bic=0.0, terms=()),
        shapes=(Attempt(None, shape_term(shape), 2e3, 2e3),),
    )
    second = a_round([600.0])
    final = SimpleNamespace(bic=-500.0, terms=(first.named[0].term,))
    found = Found(None, None, (first, second), final)
    assert probabilities(second)["actuator_lag"] > 0.9
    assert belief_in(found, "actuator_lag") == pytest.approx(0.5, abs=0.01)
    told = {name: chance for name, chance, _ in rivals(found, found.rounds, {"actuator_lag"})}
    assert told[shape.id] == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    ("name", "shares", "most"),
    [
        ("actuator_lag", (0.3, 0.0), 0.5),
        ("actuator_lag", (0.1, 0.9), 1.0),  # at the other disc
        ("encoder_gain_lower", (0.0, 0.3), 0.5),
        ("encoder_gain_lower", (0.1, 0.1), 1.0),
        ("upper_viscous", (0.9, 0.0), 1.0),  # the rig's own
    ],
)
def test_a_name_that_leaves_what_the_motion_predicts_has_even_odds(name, shares, most):
    term = Term(Named(LIBRARY[name]), np.ones(1))
    one = Round(SimpleNamespace(bic=0.0, terms=()), (), (Attempt(None, term, 5e3, 5e3),), ())
    left = Remainder(shares, (1e-3, 1e-3))
    final = SimpleNamespace(bic=-5e3, terms=(term,))
    found = Found(None, None, (one,), final, remainder=left)
    assert belief_in(found, name) == pytest.approx(min(most, 1.0 - UNLISTED), abs=1e-6)


def unused(rig, motion):
    raise AssertionError("nothing is computed of it")


def shape_term(shape):
    return Term(shape, np.zeros(2))


@pytest.mark.parametrize(
    ("name", "told"), [("upper_viscous", True), ("upper_quadratic_drag", False)]
)
def test_beside_a_shape_at_its_place_only_a_parameter_keeps_its_name(name, told):
    """EMPS without its viscous term: the rig had it again, and no name said so."""
    shape = Shape("upper_torque_of_omega_u", "upper", "omega_u", "torque", (0.0, 1.0), unused)
    named = [Term(Named(LIBRARY[n]), np.ones(1)) for n in (name, "actuator_lag")]
    final = SimpleNamespace(
        terms=(*named, shape_term(shape)), vector=np.zeros(1), information=np.eye(5), motions=()
    )
    found = Found(None, None, (), final)
    ids = [effect.id for effect in named_effects(found, None, [], 0.0)]
    assert ids == [*([name] if told else []), "actuator_lag"]


def test_a_shape_that_stands_beside_a_parameter_is_no_rival_of_it():
    """EMPS without its offset and asymmetry: the rig had the offset again, unnamed."""
    shape = Shape("upper_torque_of_omega_u", "upper", "omega_u", "torque", (0.0, 1.0), unused)
    offset = Term(Named(LIBRARY["upper_offset"]), np.ones(1))
    beside = (Attempt(None, shape_term(shape), 2e3, 2e3),)
    one = Round(
        SimpleNamespace(bic=0.0, terms=()), (), (Attempt(None, offset, 450.0, 450.0),), beside
    )
    for terms, chance in [((offset, shape_term(shape)), 1.0 - UNLISTED), ((offset,), 0.0)]:
        found = Found(None, None, (one,), SimpleNamespace(bic=-2e3, terms=terms))
        assert belief_in(found, "upper_offset") == pytest.approx(chance, abs=1e-6)
