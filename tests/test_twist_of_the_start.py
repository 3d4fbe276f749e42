"""A torque over the twist follows the twist at which the encoders agree."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit_changes import added, with_new_motions
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.start_twist import twisted_by_start
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.identification.samples import prepare
from tests.made_recordings import FREE, made

COEFFICIENT = 0.004
AWAY = 1e-3
# Where its noise has come to its end minus twice the log likelihood changes by this at random.
ROUGH = 20.0


@pytest.fixture(scope="module")
def stiffened():
    """Three times the cubic term's stiffness is over the linear one's at 3 rad."""
    hidden = (Hidden("string_hardening", {"hardening": COEFFICIENT / Rig().ktheta}),)
    recordings = [made(Rig(), hidden, (seed,)) for seed in (1, 2)]
    setting, base = base_fit([prepare(r, Rig()) for r in recordings], Rig(), FREE)
    term = Term(Named(LIBRARY["string_hardening"]), np.array([COEFFICIENT]))
    return setting, added(setting, base, term)


def test_what_a_fit_comes_to_holds_along_the_motion_that_it_tells(stiffened):
    """The motion told without the term had another offset; what was fitted along it fell apart."""
    setting, start = stiffened
    fit = descend_jointly(setting, start, limit=20, enough=1.0, only=None)
    again = with_new_motions(setting, fit)
    assert again.value - fit.value < ROUGH
    assert fit.terms[0].q[0] == pytest.approx(COEFFICIENT, rel=0.02)


def test_steps_of_the_start_know_how_the_torque_follows(stiffened):
    """From an offset that is moved away, the step leads back: it aims where the slope is none."""
    setting, start = stiffened
    here = descend_jointly(setting, start, limit=20, enough=1.0, only=None)
    away = [s + np.array([0.0, 0.0, 0.0, 0.0, AWAY]) for s in here.starts]
    motions = [
        twisted_by_start(s, m, np.array([AWAY]))
        for s, m in zip(setting.samples, here.motions, strict=True)
    ]
    there = evaluate(setting, here.vector, here.terms, here.noise, away, motions)
    for step in there.start_steps:
        assert step[0, 4] == pytest.approx(-AWAY, rel=0.1)
