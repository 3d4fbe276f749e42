"""Held-out recordings speak against names: another one is tried, or the name is given up."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from drill_env.diagnosis import contest, judging
from drill_env.diagnosis import diagnose as module
from drill_env.diagnosis.belief import belief_in, rivals
from drill_env.diagnosis.law import LawFit
from drill_env.diagnosis.rounds import Attempt, Found, Round
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY

# Minus twice the log likelihood, and the error of 5 s predictions, of the held-out recording.
ALONE = (0.0, 1.0)


def fit_of(bic, *names):
    terms = tuple(Term(Named(LIBRARY[n]), np.ones(1)) for n in names)
    return SimpleNamespace(bic=bic, value=bic, terms=terms)


def judged_by(monkeypatch, tries, *, carried=None, final=None):
    """The search's answer after judging, each name's fit carried on to `carried[name]`."""

    def judge(samples, setting, fit):
        value, error = tries[fit.terms[-1].id] if fit.terms else ALONE
        nothing = np.zeros((4, 2))
        return SimpleNamespace(value=value, short=nothing + error, free=nothing, measured=nothing)

    monkeypatch.setattr(judging, "judge", judge)
    monkeypatch.setattr(
        judging, "polished", lambda setting, fit: fit_of(carried[fit.terms[0].id], fit.terms[0].id)
    )
    base, fits = fit_of(0.0), [fit_of(-800.0, "unbalance"), fit_of(-600.0, "brake_runout")]
    named = tuple(Attempt(f, f.terms[0], -f.value, -f.bic) for f in fits)
    found = Found(None, base, (Round(base, (), named, ()),), final or fits[0])
    fewer = {1: base, 2: fits[0]}
    monkeypatch.setattr(
        judging, "trimmed", lambda found: replace(found, final=fewer[len(found.final.terms)])
    )
    return judging.judged(found, None, base, [None])[0]


@pytest.mark.parametrize(("reached", "given_up"), [(-1100.0, ()), (-700.0, ("unbalance",))])
def test_the_next_name_stands_where_it_holds(monkeypatch, reached, given_up):
    """A brake's runout that a blind maker hid was called an unbalance: the descent ended early."""
    tries = {"unbalance": (300.0, 0.6), "brake_runout": (-500.0, 0.1)}
    found = judged_by(monkeypatch, tries, carried={"brake_runout": reached})
    assert [t.id for t in found.final.terms] == ["brake_runout"]
    assert found.given_up == given_up
    assert belief_in(found, "brake_runout") > 0.9


@pytest.mark.parametrize("other", [(50.0, 0.1), (-500.0, 0.9)])
def test_one_that_holds_no_better_is_not_taken(monkeypatch, other):
    """Less likely than nothing, or further in its predictions."""
    tries = {"unbalance": (300.0, 0.6), "brake_runout": other}
    found = judged_by(monkeypatch, tries, carried={"brake_runout": -1100.0})
    assert [t.id for t in found.final.terms] == ["unbalance"]


@pytest.mark.parametrize(("error", "stays"), [(2.0, False), (1.2, True)])
def test_a_name_with_which_all_is_predicted_far_worse_is_none(monkeypatch, error, stays):
    """The play of an encoder was called a delay, which errs seven times as far; noise gives 1.1."""
    found = judged_by(monkeypatch, {"unbalance": (-500.0, error)})
    assert [t.id for t in found.final.terms] == (["unbalance"] if stays else [])
    assert found.given_up == (() if stays else ("unbalance",))
    left = {name: chance for name, chance, _ in rivals(found, found.rounds, ("unbalance",))}
    assert left["brake_runout"] <= (0.05 if stays else 0.5)


@pytest.mark.parametrize(("value", "stays"), [(1000.0, False), (-400.0, True)])
def test_a_second_name_that_costs_more_than_it_shows_goes(monkeypatch, value, stays):
    """With the first it predicts no worse, which excuses a loss, but not more than was gained."""
    tries = {"unbalance": (-500.0, 0.5), "brake_runout": (value, 0.5)}
    both = fit_of(-1100.0, "unbalance", "brake_runout")
    found = judged_by(monkeypatch, tries, final=both)
    assert [t.id for t in found.final.terms] == ["unbalance", "brake_runout"][: 1 + stays]


@pytest.mark.parametrize(("error", "stays"), [(0.5, False), (0.4, True)])
def test_a_second_name_that_but_makes_up_for_the_first_goes(monkeypatch, error, stays):
    """Both are less likely than nothing; a blind maker's hysteresis had lost counts beside it."""
    tries = {"unbalance": (5000.0, 0.5), "brake_runout": (3000.0, error)}
    both = fit_of(-1100.0, "unbalance", "brake_runout")
    found = judged_by(monkeypatch, tries, final=both)
    assert [t.id for t in found.final.terms] == ["unbalance", "brake_runout"][: 1 + stays]


@pytest.mark.parametrize(("error", "stays"), [(2.0, False), (0.3, True)])
def test_a_friction_law_with_which_all_is_predicted_far_worse_is_none(monkeypatch, error, stays):
    """A blind maker's stribeck rig was given a hump: 5 s predictions erred seven times as far."""
    nothing = np.zeros((4, 2))
    setting = SimpleNamespace(samples=[SimpleNamespace(release=1.0)], jitter=0.0)
    plain, humped = (Found(setting, fit_of(bic), (), fit_of(bic)) for bic in (0.0, -500.0))

    def judge(found, setting, base, held):
        short = nothing + (error if found is humped else 1.0)
        at = [SimpleNamespace(value=0.0, short=s, measured=nothing) for s in (nothing + 1.0, short)]
        return found, (at[0],), (at[1],)

    monkeypatch.setattr(module, "judged", judge)
    monkeypatch.setattr(module, "cleaned", lambda held, jitter: list(held))
    law = LawFit(setting, plain.base, humped, 500.0)
    kept, found, *_ = module._held_out(plain, law, [])
    assert (kept, found) == ((law, humped) if stays else (None, plain))


def test_a_name_that_came_in_anothers_place_is_believed_when_it_is_left_alone(monkeypatch):
    """Springy gears that had taken a lag's place stood with the chance that they had before."""
    monkeypatch.setattr(contest, "descend_jointly", lambda setting, fit, **_: fit)
    alone = fit_of(-1400.0, "brake_runout")
    monkeypatch.setattr(contest, "without", lambda setting, fit, place: alone)
    base, fits = fit_of(0.0), [fit_of(-800.0, "unbalance"), fit_of(-600.0, "brake_runout")]
    named = tuple(Attempt(f, f.terms[0], -f.value, -f.bic) for f in fits)
    both = fit_of(-1500.0, "brake_runout", "quadratic_drag")
    found = contest.trimmed(Found(None, base, (Round(base, (), named, ()),), both))
    assert belief_in(found, "brake_runout") > 0.9
