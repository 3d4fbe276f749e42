"""When held-out recordings let a free shape take the place of a name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from drill_env.diagnosis import judging
from drill_env.diagnosis.held_out import Judged
from drill_env.diagnosis.rounds import Found, Round
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY

SAG = Term(Named(LIBRARY["supply_sag"]), np.array([0.01]))
BASE = SimpleNamespace(bic=0.0, terms=())
NAMED = SimpleNamespace(bic=-600.0, terms=(SAG,))
SHAPED = SimpleNamespace(bic=-1300.0, terms=(SAG,))
GAIN_OF_NAME = 400.0


def judged(value: float, error: float) -> Judged:
    """A recording whose 5 s predictions err by so much on both discs, rad."""
    measured = np.zeros((10, 2))
    short = np.full((10, 2), error)
    return Judged(value, 0.0, 10, short, short, measured, None, measured)


@pytest.mark.parametrize(
    ("gain", "error", "taken"),
    [
        (500.0, 0.8, True),  # more likely, not by a third, but nearer throughout
        (500.0, 0.95, False),  # hardly nearer
        (415.0, 0.85, False),  # hardly more likely
        (500.0, [0.5, 1.0], False),  # nearer on one disc alone
        (530.0, 1.2, True),  # as clearly as the fitted ones: no prediction is asked
        (300.0, 0.85, False),
        (300.0, 0.75, True),  # nearer by a fifth: likelihood is not asked
        (300.0, [0.5, 0.99], True),  # the other disc is within the noise already
        (300.0, [0.5, 1.01], False),  # the other one is further
        (300.0, [0.5, np.nan], False),
    ],
)
def test_held_out_recordings_prefer_the_shape(monkeypatch, gain, error, taken):
    told = {id(NAMED): judged(-GAIN_OF_NAME, 1.0), id(SHAPED): judged(-gain, np.array(error))}
    monkeypatch.setattr(judging, "judge", lambda samples, setting, fit: told[id(fit)])
    rounds = (Round(BASE, (), (), ()),)
    found = Found(None, BASE, rounds, NAMED, nameless=SHAPED)
    chosen, after = judging._named_or_not(found, [judged(0.0, 3.0)], [object()])
    assert (chosen.final is SHAPED) == taken
    assert after == (told[id(chosen.final)],)
    refuted, _ = judging._named_or_not(replace(found, refuted=NAMED), [judged(0.0, 3.0)], [1])
    assert refuted.final is SHAPED
    # Without held-out recordings the fitted ones decide.
    assert judging._named_or_not(found, [], [])[0].final is SHAPED
