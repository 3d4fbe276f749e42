"""A residual that a linear law with a memory makes is predicted; noise is not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import StateSpace, lfilter, lsim, lti
from sklearn.linear_model import Ridge

from drill_env.diagnosis.learners import _by_ridge, known_of, share_of
from drill_env.diagnosis.residual_torque import PREDICTABLE
from drill_env.effects.along import Motion

RATE, SECONDS = 200.0, 30.0
NAMES = ("voltage", "omega_u")


def moved(seed: int) -> Motion:
    """An axis of one time constant, exactly, under steps of the voltage."""
    rng, t = np.random.default_rng(seed), np.arange(int(SECONDS * RATE)) / RATE
    u = np.repeat(rng.uniform(-3.0, 3.0, int(SECONDS) * 2), int(RATE) // 2)
    _, omega, _ = lsim(lti([4.0], [1.0, 5.0]), u, t, interp=False)
    states = np.zeros((len(t), 6))
    states[:, 1] = omega
    return Motion(t, u, states, np.array([0]))


@pytest.fixture(scope="module")
def motions():
    return [moved(seed) for seed in range(4)]


def shares(motions, torque, *sizes):
    """Share predicted of a torque in white noise, of given sizes in torques of each recording."""
    torques = [torque(m) for m in motions]
    for k, (one, size) in enumerate(zip(torques, sizes, strict=True)):
        one += size * (np.std(one) or 1.0) * np.random.default_rng(k).standard_normal(len(one))
    return share_of([known_of(NAMES, m) for m in motions], torques)


def damper_on_rubber(m: Motion) -> np.ndarray:
    """A Maxwell element: a damper of 1 Nm s/rad in series with a spring of 1/0.17 Nm/rad."""
    return lsim(lti([1.0], [0.17, 1.0]), m.states[:, 1], m.t)[1]


def stator_on_feet(m: Motion) -> np.ndarray:
    """A mass on a spring that the drive's torque shakes, of 3 Hz and little damping."""
    w = 2.0 * np.pi * 3.0
    return lsim(lti([w * w], [1.0, 0.3 * w, w * w]), m.u, m.t, interp=False)[1]


@pytest.mark.parametrize(("torque", "least"), [(damper_on_rubber, 0.95), (stator_on_feet, 0.8)])
def test_a_linear_memory_is_predicted_whatever_its_lag(motions, torque, least):
    assert shares(motions, torque, *[0.1] * 4) > least
    # Half of the squares is noise.
    assert 0.5 * least < shares(motions, torque, *[1.0] * 4) < 0.55


def test_a_recording_counts_as_the_others_however_much_is_left_in_it(motions):
    """All but all squares are those of one that nothing predicts: it is a quarter of them."""
    share = shares(motions, damper_on_rubber, 0.1, 0.1, 0.1, 30.0)
    assert share == pytest.approx(0.75, abs=0.05)


def test_noise_is_not_predicted(motions):
    assert shares(motions, lambda m: np.zeros(len(m.t)), *[1.0] * 4) < 0.02


def test_torque_that_shakes_the_disc_is_not_predicted_from_how_it_was_shaken():
    """Coloured torque of a tenth of the drive's, and the speed that both give, exactly."""
    axis, t = StateSpace([[-2.0]], [[1.0, 1.0]], [[1.0]], [[0.0, 0.0]]), np.arange(6000) / RATE
    known, torques = [], []
    for seed in range(5):
        rng = np.random.default_rng(seed)
        u = np.repeat(1.0 + rng.uniform(-1.0, 1.0, 60), 100)
        keep = math.exp(-1.0 / (RATE * 0.3))
        shaken = (
            0.1 * math.sqrt(1.0 - keep**2) * lfilter([1.0], [1.0, -keep], rng.normal(size=6000))
        )
        states = np.zeros((len(t), 6))
        states[:, 1] = lsim(axis, np.column_stack([u, shaken]), t)[1]
        known.append(known_of(NAMES, Motion(t, u, states, np.array([0]))))
        torques.append(shaken)
    assert share_of(known, torques) < 0.1


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_of_two_recordings_each_is_predicted_from_the_other(motions, sign):
    """A curve that the other recording has not is its own affair."""
    pair = motions[:2]
    signs = (1.0, sign)
    torques = [s * np.abs(m.states[:, 1]) ** 2 for s, m in zip(signs, pair, strict=True)]
    torques = [torque - torque.mean() for torque in torques]
    share = share_of([known_of(NAMES, m) for m in pair], torques)
    assert share > 0.8 if sign > 0.0 else share < 0.05


def test_the_ridge_is_that_of_scikit_learn():
    """The strongest within one standard error of the best, each part predicted from the others."""
    rng = np.random.default_rng(3)
    x, group = rng.normal(size=(90, 5)), np.repeat([0, 1, 2], 30)
    y = x @ [2.0, -1.0, 0.0, 0.0, 0.4] + rng.normal(size=90)
    y /= np.sqrt(np.mean(y**2))
    z = (x - x.mean(axis=0)) / x.std(axis=0)
    z = np.column_stack([z, np.ones(len(z))])
    missed = []
    for power in range(-6, 1):
        each = []
        for part in range(3):
            here = group == part
            law = Ridge(10.0**power * 60, fit_intercept=False).fit(z[~here], y[~here])
            each.append(np.sum((y[here] - law.predict(z[here])) ** 2))
        missed.append(each)
    total = np.sum(missed, axis=1)
    best = int(np.argmin(total))
    more = np.subtract(missed, missed[best])
    # 1.32 deviations of three values have the chance of one of a normal.
    errors = 1.3213 * math.sqrt(3.0) * np.std(more, axis=1, ddof=1)
    strongest = max(i for i in range(7) if more[i].sum() <= errors[i])
    assert strongest > best
    share = 1.0 - total[strongest] / 90
    assert _by_ridge([x], y, np.ones(90), group) == pytest.approx(share, rel=1e-9)


def test_slow_noise_under_a_slow_motion_is_not_predicted():
    """A minute holds few independent values of it, which one strength or another fits by chance."""
    t = np.arange(2500) / 50.0
    worst = 0.0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        known, torques = [], []
        for phase in (0.0, 2.0):
            states = np.zeros((len(t), 6))
            states[:, 1] = 6.0 + 2.1 * np.cos(0.6 * t + phase) + 0.84 * np.cos(2.1 * t)
            motion = Motion(t, np.zeros(len(t)), states, np.array([0]))
            known.append(known_of(("omega_u",), motion))
            keep = math.exp(-1.0 / (50.0 * 1.0))
            torques.append(lfilter([1.0], [1.0, -keep], rng.standard_normal(len(t))))
        worst = max(worst, share_of(known, torques))
    assert worst < PREDICTABLE
