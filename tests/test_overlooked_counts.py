"""A step of an encoder that was overlooked at first does not take a second effect's place."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from drill_env.diagnosis import find as module
from drill_env.diagnosis import rivals
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.rounds import Attempt, Round
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY

LOST = Term(
    LostCounts("missed_counts_upper", "sensor", "time", "error", (0.0,), lambda rig, motion: None),
    np.array([0.0015]),
)
WARMUP = Term(Named(LIBRARY["friction_warmup"]), np.array([0.01, 14.0]))
DRAG = Term(Named(LIBRARY["quadratic_drag"]), np.array([1e-4]))


def fit_with(*terms):
    return SimpleNamespace(terms=terms, bic=-100.0 * len(terms), value=-100.0 * len(terms))


def searched(monkeypatch, best, most):
    """What is found where each round's best term is told in advance."""
    told = iter(best)

    def round_at(setting, fit, effects, report, *, more):
        assert more == (most == 2 and not fit.terms)
        term = next(told)
        attempt = Attempt(fit_with(*fit.terms, term), term, 110.0, 100.0)
        return Round(fit, (), (attempt,), ())

    monkeypatch.setattr(module, "search", round_at)
    monkeypatch.setattr(rivals, "polished", lambda setting, fit: fit)
    monkeypatch.setattr(module, "refitted_alone", lambda setting, found: found)
    here, *_, rounds = module._sought(None, fit_with(), (), most, lambda text: None, lambda: None)
    assert len(rounds) == len(here.terms)
    return [term.id for term in here.terms]


@pytest.mark.parametrize(
    ("best", "most", "expected"),
    [
        ((LOST, LOST, WARMUP), 2, 3),
        ((LOST, WARMUP, DRAG), 2, 2),
        ((DRAG, WARMUP, LOST), 2, 2),
        ((LOST, LOST, LOST, LOST), 2, 3),
        ((LOST, WARMUP), 1, 1),
    ],
)
def test_rounds_go_on_until_there_are_as_many_effects_as_asked(monkeypatch, best, most, expected):
    found = searched(monkeypatch, best, most)
    assert found == [term.id for term in best[:expected]]
