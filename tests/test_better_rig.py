"""What a candidate gains because it made the rig better is no gain of the candidate's."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.attempts import attempted, refitted_alone
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit_changes import added
from drill_env.diagnosis.rounds import NEEDED, Round
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.identification.samples import prepare
from tests.made_recordings import FREE, made

DRAG = Term(Named(LIBRARY["quadratic_drag"]), np.array([1e-7]))


@pytest.fixture(scope="module")
def fitted():
    recordings = [made(Rig(), (), (seed,), volts=4.0) for seed in (1, 2)]
    return base_fit([prepare(r, Rig()) for r in recordings], Rig(), FREE)


def searched_at(setting, fit, end):
    """A search at a fit whose one candidate, of next to no size, came to another rig."""
    return Round(fit, (), (attempted(fit, added(setting, end, DRAG)),), ())


def test_a_search_goes_on_from_the_rig_that_a_candidate_found(fitted):
    setting, base = fitted
    astray = evaluate(setting, base.vector + 0.02, (), base.noise, base.starts, base.motions)
    found = searched_at(setting, astray, base)
    assert found.named[0].criterion > 10.0 * NEEDED
    again = refitted_alone(setting, found)
    assert again.before.terms == ()
    assert again.before.value == pytest.approx(base.value, abs=2.0)
    assert again.named[0].criterion < NEEDED


def test_a_search_at_the_best_rig_stays_as_it_is(fitted):
    setting, base = fitted
    found = searched_at(setting, base, base)
    assert refitted_alone(setting, found) is found
