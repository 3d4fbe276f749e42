"""One rule decides on a whole rig: the evidence of fitted and held-out recordings together."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from drill_env.diagnosis import evidence
from drill_env.diagnosis.evidence import decided
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.rounds import Attempt, Found, Round
from drill_env.diagnosis.terms import Named, Shape, Term
from drill_env.effects import LIBRARY
from drill_env.prediction.criteria import Criteria

BLOCKS = 12


def nothing(rig, motion):
    return None, None


def named(name: str) -> Term:
    return Term(Named(LIBRARY[name]), np.ones(len(LIBRARY[name].parameters)))


def shape(component: str) -> Term:
    source = Shape(
        f"{component}_shape",
        component,
        "omega_l",
        "torque",
        (0.0, 1.0),
        lambda rig, m: (None, None),
    )
    return Term(source, np.ones(2))


LOST = Term(
    LostCounts("missed_counts_upper", "sensor", "omega_u", "error", (0.0,), nothing),
    np.array([0.0015]),
)


def fit_of(told: float, unseen: float, *terms: Term, scatter: float = 1.0):
    """A fit that gains so many nats on fitted and on held-out recordings."""
    # All numbers are estimated to a hundredth.
    information = 1e4 * np.eye(sum(len(term.q) for term in terms))
    return SimpleNamespace(
        bic=-2.0 * told, terms=terms, unseen=unseen, scatter=scatter, vector=np.zeros(0),
        information=information,
    )  # fmt: skip


BASE = fit_of(0.0, 0.0, scatter=0.0)


@pytest.fixture(autouse=True)
def made_up(monkeypatch):
    noise = np.random.default_rng(0).standard_normal(BLOCKS)
    noise = (noise - noise.mean()) / (noise.std(ddof=1) * np.sqrt(BLOCKS))

    def blocks(held, fit):
        # The scatter is the standard error of the sum.
        return (fit.unseen / BLOCKS + fit.scatter * noise) if held.samples else np.zeros(0)

    monkeypatch.setattr(evidence.HeldOut, "blocks", blocks)
    monkeypatch.setattr(evidence.HeldOut, "ask", lambda held, fits: None)
    monkeypatch.setattr(evidence.HeldOut, "marks", lambda held: [0] * BLOCKS)
    monkeypatch.setattr(evidence, "polished", lambda setting, fit: fit)
    monkeypatch.setattr(evidence, "within_filter", lambda setting, fit: fit)


def decision(fits, *, final=None, steps=(), held=(1,)):
    """Ids that stand, and the table."""
    attempts = [Attempt(f, f.terms[-1], -f.bic, -f.bic) for f in fits]
    names = tuple(a for a in attempts if isinstance(a.term.source, (Named, LostCounts)))
    shapes = tuple(a for a in attempts if a not in names)
    rounds = (Round(BASE, (), names, shapes), *(Round(s, (), (), ()) for s in steps))
    found, table = decided(Found(None, BASE, rounds, final or fits[0]), held, Criteria())
    return [t.id for t in found.final.terms], table


def test_evidence_is_that_of_the_fitted_and_then_of_the_unseen_recordings():
    ids, table = decision([fit_of(30.0, 12.0, named("unbalance"))])
    assert ids == ["unbalance"] and table.whole == pytest.approx(42.0)


@pytest.mark.parametrize(
    ("told", "unseen", "stands"),
    [
        (14.0, 0.0, False),  # a trace
        (10.0, 10.0, True),
        (300.0, -30.0, False),  # held-out recordings contradict it
        (-2.0, 40.0, False),  # the fitted ones do not ask for it
    ],
)
def test_a_trace_or_what_bends_to_the_fitted_recordings_is_none(told, unseen, stands):
    ids, _ = decision([fit_of(told, unseen, named("unbalance"))])
    assert bool(ids) == stands


@pytest.mark.parametrize(("told", "asked"), [(25.0, False), (300.0, True)])
def test_what_fitted_recordings_ask_for_and_others_contradict_is_something(told, asked):
    one = fit_of(told, -30.0, named("unbalance"))
    attempt = Attempt(one, one.terms[-1], -one.bic, -one.bic)
    search = Found(None, BASE, (Round(BASE, (), (attempt,), ()),), one)
    found, _ = decided(search, (1,), Criteria())
    assert found.final is BASE
    assert found.rejected == (("unbalance",) if asked else ())


@pytest.mark.parametrize(("scatter", "stands"), [(5.0, False), (20.0, True)])
def test_a_loss_within_three_standard_errors_is_none_once_a_second_name_is_there(scatter, stands):
    one = fit_of(300.0, -30.0, named("unbalance"), scatter=scatter)
    both = fit_of(600.0, 200.0, *one.terms, named("gain_asymmetry"), scatter=scatter)
    ids, _ = decision([one], final=both, steps=(one,))
    assert ids == (["unbalance", "gain_asymmetry"] if stands else [])


@pytest.mark.parametrize("scatter", [0.1, 5.0])
def test_a_name_by_which_unseen_readings_are_less_probable_is_none(scatter):
    assert decision([fit_of(42.0, -1.0, named("coasting"), scatter=scatter)])[0] == []
    assert decision([fit_of(42.0, 1.0, named("coasting"), scatter=scatter)])[0] == ["coasting"]


def test_a_gain_that_lies_in_one_block_is_none():
    assert decision([fit_of(20.0, 1000.0, named("unbalance"), scatter=500.0)])[0] == []


def test_without_held_out_recordings_the_fitted_ones_decide():
    fits = [fit_of(40.0, 0.0, named("unbalance")), fit_of(60.0, 0.0, named("quadratic_drag"))]
    assert decision(fits, held=())[0] == ["quadratic_drag"]
    # That most machines have an unbalance does not make up for 20 nats.
    fits = [fit_of(60.0, 0.0, named("unbalance")), fit_of(30.0, 0.0, named("quadratic_drag"))]
    assert decision(fits, held=())[0] == ["unbalance"]
    fits = [fit_of(60.0, 0.0, named("unbalance")), fit_of(300.0, 0.0, shape("lower"))]
    assert decision(fits, held=())[0] == ["lower_shape"]


@pytest.mark.parametrize(("share", "stands"), [(0.85, True), (0.6, False)])
def test_a_name_stands_by_its_share_of_what_a_free_shape_explains(share, stands):
    name = fit_of(share * 200.0, share * 100.0, named("quadratic_drag"))
    ids, table = decision([name, fit_of(200.0, 100.0, shape("lower"))])
    assert ids == (["quadratic_drag"] if stands else ["lower_shape"])
    assert table.choice.share == pytest.approx(share)


@pytest.mark.parametrize(
    ("second", "told", "unseen", "stands"),
    [
        ("gain_asymmetry", 30.0, 20.0, True),  # elsewhere, and seen in unseen recordings too
        ("gain_asymmetry", 30.0, 2.0, True),  # there by two standard errors, with others by more
        ("gain_asymmetry", 10.0, 2.0, False),  # less than a whole rig asks for
        ("gain_asymmetry", 30.0, -8.0, False),  # unseen recordings contradict it
        ("rate_state", 100.0, 50.0, False),  # at the same place a tenth is the law's difference
        ("rate_state", 300.0, 100.0, True),
    ],
)
def test_a_second_name_is_more_than_a_remainder_of_the_first(second, told, unseen, stands):
    one = fit_of(1000.0, 500.0, named("dwell_stiction"))
    two = fit_of(1000.0 + told, 500.0 + unseen, *one.terms, named(second))
    # Their scatter is common: the difference has one of its own.
    two.scatter = 2.0
    ids, _ = decision([one], final=two, steps=(one,))
    assert ids == ["dwell_stiction", second][: 1 + stands]


def test_a_second_name_whose_gain_lies_in_one_block_is_none():
    one = fit_of(1000.0, 500.0, named("dwell_stiction"))
    two = fit_of(1020.0, 1500.0, *one.terms, named("gain_asymmetry"), scatter=500.0)
    assert decision([one], final=two, steps=(one,))[0] == ["dwell_stiction"]


@pytest.mark.parametrize(
    ("second", "stands"),
    [("commutation_ripple", False), ("upper_asymmetry", False), ("gain_asymmetry", True)],
)
def test_what_a_law_of_an_angle_leaves_may_be_made_by_the_drive_or_beside_it(second, stands):
    """An eccentric gear's lever arm has a second harmonic, which a motor's ripple has too."""
    one = fit_of(1000.0, 500.0, named("gear_eccentricity"))
    two = fit_of(1100.0, 550.0, *one.terms, named(second))
    ids, _ = decision([one], final=two, steps=(one,))
    assert ids == ["gear_eccentricity", second][: 1 + stands]


def test_lost_counts_of_the_fitted_recordings_are_not_asked_of_others():
    """They would be less likely, as other counts are lost in them."""
    one = fit_of(500.0, -900.0, LOST)
    two = fit_of(600.0, -950.0, LOST, named("amplifier_deadzone"))
    ids, _ = decision([one, fit_of(300.0, 400.0, named("slew_limit"))], final=two, steps=(one,))
    assert ids == ["missed_counts_upper", "amplifier_deadzone"]


def test_the_criterion_of_what_was_judged_is_its_evidence():
    fits = [fit_of(50.0, -2.0, named("unbalance")), fit_of(40.0, 30.0, named("quadratic_drag"))]
    attempts = tuple(Attempt(f, f.terms[-1], -f.bic, -f.bic) for f in fits)
    search = Found(None, BASE, (Round(BASE, (), attempts, ()),), fits[0])
    found, _ = decided(search, (1,), Criteria())
    again = {a.term.id: a.criterion for a in found.rounds[0].named}
    assert again == pytest.approx({"quadratic_drag": 140.0, "unbalance": 96.0})
    assert [t.id for t in found.final.terms] == ["quadratic_drag"]


def test_a_second_name_has_the_probability_of_its_own_round():
    """Against the other names of that round, and no shape where the first name acts."""
    one = fit_of(1000.0, 500.0, named("dwell_stiction"))
    right = fit_of(1300.0, 600.0, *one.terms, named("gain_asymmetry"))
    near = fit_of(1299.0, 600.0, *one.terms, named("actuator_lag"))
    law = fit_of(2000.0, 900.0, *one.terms, shape("lower"))

    def attempts(fits, before):
        return tuple(Attempt(f, f.terms[-1], b := before.bic - f.bic, b) for f in fits)

    first = Round(BASE, (), attempts([one], BASE), ())
    second = Round(one, (), attempts([right, near], one), attempts([law], one))
    found, _ = decided(Found(None, BASE, (first, second), right), (1,), Criteria())
    assert [t.id for t in found.final.terms] == ["dwell_stiction", "gain_asymmetry"]
    weights = found.rounds[1].weights
    assert set(weights) == {"gain_asymmetry", "actuator_lag"}
    # A nat is a factor e.
    odds = weights["gain_asymmetry"] / weights["actuator_lag"]
    assert odds == pytest.approx(np.e, rel=1e-6)


@pytest.mark.parametrize(("without", "names"), [(90.0, []), (20.0, ["quadratic_drag"])])
def test_a_name_whose_size_may_be_none_is_rejected(monkeypatch, without, names):
    """Unless the best fit without it is much less likely: then no parabola tells its size."""
    bare = fit_of(without, 0.0)
    monkeypatch.setattr(evidence, "best_without", lambda setting, fit, place: bare)
    vague = fit_of(100.0, 50.0, named("quadratic_drag"))
    vague.information = 1e-5 * vague.information
    assert decision([fit_of(100.0, 50.0, named("quadratic_drag"))])[0] == ["quadratic_drag"]
    assert decision([vague])[0] == names


def resonator(damping: float) -> Term:
    return Term(Named(LIBRARY["lower_resonator"]), np.array([1.0, 0.1, damping]))


# A damping of 2 is the most that is searched.
@pytest.mark.parametrize(("damping", "names"), [(0.3, 2), (2.0, 1)])
def test_a_second_name_leaves_the_first_ones_numbers_determined(damping, names):
    one = fit_of(1000.0, 500.0, resonator(0.3))
    two = fit_of(1300.0, 600.0, resonator(damping), named("gain_asymmetry"))
    ids, _ = decision([one], final=two, steps=(one,))
    assert ids == ["lower_resonator", "gain_asymmetry"][:names]


def test_a_name_whose_number_comes_to_its_end_later_is_none():
    one, later = fit_of(1000.0, 500.0, resonator(0.3)), fit_of(1010.0, 500.0, resonator(2.0))
    assert decision([one], final=later)[0] == []
