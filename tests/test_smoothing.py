"""Slopes of the likelihood by known torques and reading errors, against finite differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.rig_maker import make, quasi_random
from drill_env import Rig
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import path_of, value_of
from drill_env.identification.samples import prepare
from drill_env.identification.smoothing import slopes_of, smoothed
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording

# Large enough that no disc changes its mode under the finite step.
NOISE = NoiseModel(torque_u=0.05, torque_l=5e-3)


@pytest.fixture(scope="module", params=[False, True], ids=["apart", "relative"])
def samples(request):
    truth = {name: getattr(Rig(), name) for name in SYMBOLS}
    u = 3.0 + 0.3 * quasi_random(np.random.default_rng(3), 12.0, 200.0, 5.0)
    made = make(truth, u, 200.0, seed=5, counts=8192, torque_u=0.02, torque_l=2e-4)
    recording = Recording(made.t, made.u, made.theta_u, made.theta_l)
    return prepare(recording, Rig(), relative=request.param)


@pytest.fixture(scope="module")
def passed(samples):
    path = path_of(samples, Rig(), NOISE, samples.starts)
    return path, smoothed(samples, NOISE, path)


def log_likelihood(samples, loads=0.0, errors=0.0):
    moved = replace(samples, loads=samples.loads + loads, angles=samples.angles - errors)
    return -0.5 * value_of(moved, Rig(), NOISE, samples.starts)


@pytest.mark.parametrize("row", [900, 1500, 2100])
@pytest.mark.parametrize(("disc", "step"), [(0, 1e-3), (1, 1e-5)])
def test_pull_is_the_slope_by_a_torque(samples, passed, row, disc, step):
    push = np.zeros_like(samples.loads)
    push[row, disc] = step
    slope = (log_likelihood(samples, push) - log_likelihood(samples, -push)) / (2 * step)
    assert passed[1].pull[row, disc] == pytest.approx(slope, rel=0.02, abs=2e-5 / step)


@pytest.mark.parametrize("row", [900, 1500])
@pytest.mark.parametrize("encoder", [0, 1])
def test_misread_is_the_slope_by_a_reading_error(samples, passed, row, encoder):
    error = np.zeros_like(samples.angles)
    error[row, encoder] = 1e-5
    slope = log_likelihood(samples, 0.0, error) - log_likelihood(samples, 0.0, -error)
    assert passed[1].misread[row, encoder] == pytest.approx(slope / 2e-5, rel=0.02, abs=20.0)


def test_carried_columns_and_the_backward_pass_agree(samples, passed):
    rng = np.random.default_rng(0)
    n = len(samples.t)
    loads, errors = rng.normal(size=(n, 2, 5)), rng.normal(size=(n, 2, 5))
    path, smooth = passed
    columns = slopes_of(samples, NOISE, path, loads, errors)
    forward = np.einsum("ke,kec->c", path.rows["white"], columns)
    backward = np.einsum("ke,kec->c", smooth.pull, loads) + np.einsum(
        "ke,kec->c", smooth.misread, samples.misread(errors)
    )
    np.testing.assert_allclose(forward, backward, rtol=1e-9)


def test_smoothed_torque_follows_a_torque_the_rig_lacks(samples):
    t = samples.t
    known = 0.004 * np.sin(2 * np.pi * 0.7 * t)
    # Taking a torque out of what the filter is told leaves it for the filter to find.
    moved = replace(samples, loads=samples.loads + np.column_stack([0 * t, -known]))
    path = path_of(moved, Rig(), NOISE, samples.starts)
    found = smoothed(moved, NOISE, path).states[:, 5]
    inner = (t > 1) & (t < t[-1] - 1)
    assert np.corrcoef(found[inner], known[inner])[0, 1] > 0.9
    assert found[inner].std() == pytest.approx(known[inner].std(), rel=0.15)
