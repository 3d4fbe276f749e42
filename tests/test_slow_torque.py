"""Physics that is missing poses as a slow torque: descents leave that, and shapes see near rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.first_look import first_look
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.joint_noise import TORQUES
from drill_env.diagnosis.linearised import linearised_at
from drill_env.diagnosis.rounds import NEEDED, Attempt
from drill_env.diagnosis.scan import score_shapes
from drill_env.diagnosis.shapes import free_shapes
from drill_env.identification.samples import prepare
from tests.made_recordings import FREE, made

VOLTS = 3.0
"""Low, so that the upper disc turns slowly at times, where its friction differs."""


def fitted(*hidden: Hidden) -> tuple[Setting, Fit]:
    recordings = [made(Rig(), hidden, (seed,), volts=VOLTS) for seed in (1, 2)]
    return base_fit([prepare(r, Rig()) for r in recordings], Rig(), FREE)


def speed_shape(setting: Setting, base: Fit) -> Attempt:
    """A free torque of the upper disc's speed, fitted beside the rig."""
    shapes = free_shapes(base.motions, FREE)
    scores = score_shapes(linearised_at(setting, base), shapes)
    score = next(s for s in scores if s.term.id == "upper_torque_of_omega_u")
    start = first_look(setting, base, score).start(setting, base)
    there = descend_jointly(setting, start, limit=6, enough=2.0, only=TORQUES)
    return Attempt(there, there.terms[-1], base.value - there.value, base.bic - there.bic)


@pytest.mark.parametrize(("size", "time"), [(0.034, 0.61), (0.09, 0.002)])
def test_a_descent_from_another_noise_ends_at_the_same_one(size: float, time: float):
    setting, base = fitted()
    best = descend_jointly(setting, base, limit=15, enough=0.1, only=None)
    wrong = replace(best.noise, torque_u=size, tau_u=time)
    start = evaluate(setting, best.vector, (), wrong, best.starts, best.motions)
    found = descend_jointly(setting, start, limit=15, enough=0.1, only=None)
    assert start.value > best.value + 50.0
    assert found.value < best.value + 1.0
    assert found.noise.tau_u == pytest.approx(best.noise.tau_u, rel=0.05)


def test_friction_that_differs_near_rest_alone_is_told_by_a_shape():
    hidden = Hidden("upper_stribeck", {"torque": 0.11, "speed": 0.26})
    attempt = speed_shape(*fitted(hidden))
    assert attempt.criterion > NEEDED


def test_the_rigs_own_friction_is_no_shape():
    attempt = speed_shape(*fitted())
    assert attempt.criterion < 0.0 and attempt.gain < len(attempt.term.q)


def test_knots_of_speeds_lie_near_rest_and_apart():
    _, base = fitted()
    for shape in free_shapes(base.motions):
        gaps = np.diff(shape.knots)
        assert (gaps > 0.0).all()
        if shape.depends_on in ("omega_u", "omega_l"):
            fastest = max(map(abs, shape.knots))
            near = [k for k in shape.knots if abs(k) < 0.07 * fastest]
            assert len(near) >= 4 and gaps.min() > 0.009 * fastest
