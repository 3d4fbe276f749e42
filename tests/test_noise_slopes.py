"""Derivatives of the likelihood by its noise, against finite differences of the filter itself."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.rig_maker import make, quasi_random
from drill_env import Rig
from drill_env.identification.noise import NoiseModel
from drill_env.identification.noise_fit import derivatives_by_noise
from drill_env.identification.prediction_error import path_of, trace_of, value_of
from drill_env.identification.samples import prepare
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording

STEP = 1e-3
# Other than the true ones, so that no derivative is zero.
NOISE = NoiseModel(torque_u=0.03, torque_l=4e-4, tau_u=0.2, tau_l=0.06)


def recorded(volts: float, velocities: bool, relative: bool = False):
    """A recording with a gap and with samples that no model foresees."""
    rng = np.random.default_rng(3)
    u = volts + 0.3 * quasi_random(rng, 12.0, 200.0, 5.0)
    truth = {name: getattr(Rig(), name) for name in SYMBOLS}
    made = make(truth, u, 200.0, seed=5, counts=8192, torque_u=0.02, torque_l=2e-4)
    run = Recording(made.t, made.u, made.theta_u, made.theta_l)
    if velocities:
        speeds = made.truth[:, [1, 3]] + 0.05 * rng.normal(size=(len(u), 2))
        run = replace(run, omega_u=speeds[:, 0], omega_l=speeds[:, 1])
    samples = prepare(run, Rig(), relative=relative)
    samples.angles[700:720, 1] = math.nan
    samples.angles[1200:1800:97, 0] += 0.01
    return samples


@pytest.fixture(scope="module", params=[(3.0, False), (1.6, False), (3.0, True), (3.0, True, True)])
def samples(request):
    return recorded(*request.param)


def moved(place, step):
    logs = NOISE.vector()
    logs[place] += step
    return NoiseModel.from_vector(logs)


def places(samples):
    return range(4 + samples.angles.shape[1])


def test_gradient_is_the_slope_of_the_value(samples):
    trace = path_of(samples, Rig(), NOISE, samples.starts).trace
    found, _ = derivatives_by_noise(samples, NOISE, trace, math.inf)
    for place in places(samples):
        values = [
            value_of(samples, Rig(), moved(place, step), samples.starts) for step in (STEP, -STEP)
        ]
        slope = 0.5 * (values[0] - values[1]) / (2.0 * STEP)
        # Beside the transitions, which are held, the value follows its noise a little.
        assert found[place] == pytest.approx(slope, rel=0.02, abs=0.5)


@pytest.mark.parametrize("robust", [math.inf, 3.0])
def test_curvature_is_that_of_moved_innovations(samples, robust):
    base = path_of(samples, Rig(), NOISE, samples.starts, robust).trace
    _, found = derivatives_by_noise(samples, NOISE, base, robust)
    used = base.variance > 0
    v = base.variance[used]
    pairs = [
        [trace_of(samples, Rig(), moved(i, s), samples.starts, robust) for s in (STEP, -STEP)]
        for i in places(samples)
    ]
    sizes = np.array([np.log(a.variance[used] / b.variance[used]) / (2 * STEP) for a, b in pairs])
    gaps = np.array([(a.innovation - b.innovation)[used] / (2 * STEP) for a, b in pairs])
    expected = 0.5 * sizes @ sizes.T + (gaps / v) @ gaps.T
    count = len(expected)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found[:count, :count] / scale, expected / scale, atol=0.02)
