"""Each half of the recordings is fitted from where the other came to as well."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import StateSpace, lsim

from drill_env import Rig
from drill_env.effects import LIBRARY
from drill_env.identification.samples import prepare
from drill_env.prediction.candidate import candidate_of, scales_of
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.cut import cut
from drill_env.prediction.fit import fit
from drill_env.prediction.motion import motion_as_read
from drill_env.prediction.search import _fitted
from drill_env.prediction.setting import Setting
from drill_env.recordings import Recording

RATE, SECONDS, NOISE = 200.0, 20.0, 1e-5
AXIS = Rig.one_inertia(km=1.0, Ju=2.0, Tsu=0.0, bu=0.5)
FREQUENCY, SHARE, DAMPING = 1.7, 0.08, 0.03


def boom(seed: int) -> Recording:
    """An axis with a body on a spring, a linear system, exactly, under held torques."""
    rng, t = np.random.default_rng(seed), np.arange(int(SECONDS * RATE)) / RATE
    u = np.repeat(rng.uniform(-6.0, 6.0, int(SECONDS / 0.5)), int(0.5 * RATE))
    body, wave = SHARE * AXIS.Ju, 2.0 * math.pi * FREQUENCY
    k, c = body * wave**2, 2.0 * body * DAMPING * wave
    # Angles of axis and body, then their speeds.
    rates = np.array(
        [
            [0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [-k / AXIS.Ju, k / AXIS.Ju, -(c + AXIS.bu) / AXIS.Ju, c / AXIS.Ju],
            [k / body, -k / body, c / body, -c / body],
        ]
    )
    drive = np.array([[0.0], [0.0], [1.0 / AXIS.Ju], [0.0]])
    system = StateSpace(rates, drive, np.eye(4)[:1], [[0.0]])
    theta = lsim(system, u, t, interp=False)[1]
    return Recording(t, u, theta + rng.normal(0.0, NOISE, len(t)), source=f"boom {seed}")


def test_a_half_that_began_far_off_takes_the_peak_that_the_other_found():
    samples = [prepare(boom(seed), AXIS) for seed in (1, 2)]
    motions = [motion_as_read(s, AXIS) for s in samples]
    leads = np.array([0.015, 0.03, 0.08, 0.25])
    before = []
    for s, motion in zip(samples, motions, strict=True):
        setting = Setting(
            AXIS, ("km", "Ju", "bu"), 0.05, (cut(s, motion, AXIS, leads),), Criteria()
        )
        before.append(fit(setting, setting.centre))
    candidate = candidate_of(LIBRARY["upper_resonator"], scales_of(AXIS, motions, 0))
    near, far = (np.array([math.log(f), 1.0, math.log(0.03)]) for f in (1.6, 18.0))
    alone = fit(before[1].setting, before[1].vector, (candidate,), (far,))
    # Begun far off alone, it ends on another peak.
    assert math.exp(alone.numbers[0][0]) != pytest.approx(FREQUENCY, rel=0.5)
    found = _fitted(before, candidate, [near, far])
    for one in found:
        entry = candidate.entry(one.numbers[0])
        assert entry["frequency"] == pytest.approx(FREQUENCY, rel=0.01)
        assert entry["share"] == pytest.approx(SHARE, rel=0.05)
    assert found[1].value > alone.value
