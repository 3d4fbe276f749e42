"""Two names that explain nearly the same: both are carried to their end before one is chosen."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from drill_env.diagnosis import rivals
from drill_env.diagnosis.rounds import Attempt, Round
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY


def fit_of(value, *names):
    terms = tuple(Term(Named(LIBRARY[n]), np.ones(1)) for n in names)
    return SimpleNamespace(bic=value, value=value, terms=terms)


def refined(monkeypatch, criteria, ends):
    """The round and the name that `refined` leaves, and which names were refined."""
    base = fit_of(0.0)
    fits = [fit_of(-c, name) for name, c in criteria.items()]
    named = tuple(Attempt(f, f.terms[0], -f.value, -f.bic) for f in fits)
    carried = []

    def polished(setting, fit):
        carried.append(fit.terms[0].id)
        return fit_of(-ends[fit.terms[0].id], fit.terms[0].id)

    monkeypatch.setattr(rivals, "polished", polished)
    found, fit = rivals.refined(
        None, Round(base, (), named, ()), list(LIBRARY.values()), lambda text: None
    )
    return {a.term.id: a.criterion for a in found.named}, fit.terms[0].id, carried


CRITERIA = {"gear_compliance": 12881.0, "actuator_lag": 12856.0, "input_delay": 12800.0}


def test_the_one_that_ends_better_is_chosen(monkeypatch):
    """A lag was called a springy gear, which lost 200 along its own motion."""
    ends = {"gear_compliance": 12659.0, "actuator_lag": 12856.0}
    named, best, carried = refined(monkeypatch, CRITERIA, ends)
    assert best == "actuator_lag" and carried == ["gear_compliance", "actuator_lag"]
    assert list(named) == ["actuator_lag", "input_delay", "gear_compliance"]
    assert named["actuator_lag"] - named["gear_compliance"] == pytest.approx(197.0)
    # What was not refined stays as far behind the lead as it was.
    assert named["actuator_lag"] - named["input_delay"] == pytest.approx(81.0)


def test_a_name_far_behind_is_not_refined(monkeypatch):
    criteria = CRITERIA | {"actuator_lag": 12700.0}
    named, best, carried = refined(monkeypatch, criteria, {"gear_compliance": 12900.0})
    assert best == "gear_compliance" and carried == ["gear_compliance"]
    assert named == criteria


NUMBERS = {"motor_share": 0.53, "frequency": 22.5, "friction_share": 0.2, "damping": 0.046}


@pytest.mark.parametrize(("gap", "gain", "name"), [
    (1e-4, 3.0, "gear_compliance"),
    (1e-4, -3.0, "gear_backlash"),
    (0.02, 3.0, "gear_backlash"),
])  # fmt: skip
def test_a_gear_whose_play_closed_is_a_springy_one(monkeypatch, gap, gain, name):
    """Of 48000 rows of a springy gear a play of 0.0001 rad was told, and rejected as no number."""

    def evaluate(setting, vector, terms, noise, starts, motions):
        return SimpleNamespace(bic=-gain, terms=terms)

    monkeypatch.setattr(rivals, "evaluate", evaluate)
    monkeypatch.setattr(rivals, "polished", lambda setting, fit: fit)
    effect = LIBRARY["gear_backlash"]
    told = {"gap": gap, **NUMBERS}
    term = Term(Named(effect), np.array([told[p.name] for p in effect.parameters]))
    start = SimpleNamespace(bic=0.0, terms=(term,), vector=0, noise=0, starts=(), motions=())
    found = rivals.at_limits(None, start, list(LIBRARY.values())).terms[0]
    numbers = dict(
        zip((p.name for p in found.source.effect.parameters), found.q.tolist(), strict=True)
    )
    assert found.id == name
    assert numbers == (NUMBERS if name == "gear_compliance" else told)


@pytest.mark.parametrize(
    ("scored", "over", "carried"),
    [(0.9, "twist", True), (0.7, "twist", False), (0.9, "omega_l", False)],
)
def test_a_free_shape_that_rivals_a_name_comes_to_its_end_too(monkeypatch, scored, over, carried):
    """Of the name 20 were lost on the way, so they are of the shape too."""
    source = SimpleNamespace(component="lower", depends_on=over)
    free_term = SimpleNamespace(id="free", source=source)
    base, name = fit_of(0.0), fit_of(-1000.0, "quadratic_drag")
    free = SimpleNamespace(bic=-1000.0 * scored, value=0.0, terms=(free_term,))
    rounds = Round(
        base, (), (Attempt(name, name.terms[0], 1000.0, 1000.0),),
        (Attempt(free, free.terms[0], 1000.0 * scored, 1000.0 * scored),),
    )  # fmt: skip
    end = SimpleNamespace(bic=-1500.0, value=-1500.0, terms=free.terms)
    monkeypatch.setattr(rivals, "polished", lambda setting, fit: end)
    found = rivals.with_rival_shape(None, rounds, fit_of(-980.0, "quadratic_drag"))
    assert found.shapes[0].criterion == pytest.approx(1520.0 if carried else 1000.0 * scored)
