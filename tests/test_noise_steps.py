"""Where a sequence of noise models ends whose steps hardly shorten."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env.diagnosis.joint_noise import NoiseStep, extrapolated
from drill_env.identification.noise import NoiseModel
from drill_env.identification.noise_fit import LONGEST_STEP

END = NoiseModel(torque_u=0.01, torque_l=3e-4, tau_u=0.2)


def steps(rate: float, far: float) -> tuple[NoiseStep, NoiseStep]:
    """Two steps towards the end, each of which leaves the same share of the way."""
    way = far * np.array([1.0, -0.5, 0.2, *np.zeros(5)])
    models = [NoiseModel.from_vector(END.vector() + rate**k * way) for k in range(3)]
    return NoiseStep(models[0], models[1], models[1]), NoiseStep(models[1], models[2], models[2])


@pytest.mark.parametrize("rate", [0.95, 0.5, -0.5])
def test_steps_that_shorten_evenly_are_followed_to_their_end(rate):
    before, step = steps(rate, 1.0)
    assert extrapolated(step, before).vector() == pytest.approx(END.vector(), abs=1e-9)


def test_no_number_moves_further_than_a_step_may():
    before, step = steps(0.99, 10.0)
    moved = extrapolated(step, before).vector() - step.here.vector()
    assert np.abs(moved).max() == pytest.approx(LONGEST_STEP)
    assert moved / moved[0] == pytest.approx([1.0, -0.5, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0], abs=1e-6)


def test_a_model_that_rests_stays():
    before, step = steps(0.5, 0.0)
    assert extrapolated(step, before).vector() == pytest.approx(END.vector())
