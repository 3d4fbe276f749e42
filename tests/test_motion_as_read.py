"""The motion that readings show: nearer to the truth with what the given rig says of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env.identification.samples import prepare
from drill_env.prediction.motion import motion_as_read
from drill_env.recordings import Recording

RATE, NOISE = 200.0, 2e-4
STEP = 2.0 * math.pi / 65536
TRUE = Rig.one_inertia(km=0.5, Ju=0.02, Tsu=0.05, bu=0.05)


def swung(seconds=20.0):
    """A recording by SciPy alone, friction's sign steep where it turns, and its velocity."""
    t = np.arange(int(seconds * RATE)) / RATE
    u = 1.5 * quasi_random(np.random.default_rng(3), seconds, RATE, 2.0)

    def rates(now, y):
        volts = u[min(int(now * RATE + 1e-9), len(u) - 1)]
        friction = TRUE.bu * y[1] + TRUE.Tsu * math.tanh(y[1] / 1e-3)
        return [y[1], (TRUE.km * volts - friction) / TRUE.Ju]

    run = solve_ivp(
        rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, max_step=1.0 / RATE, rtol=1e-8, atol=1e-10,
        method="LSODA",
    )  # fmt: skip
    noise = np.random.default_rng(4).normal(0.0, NOISE, len(t))
    theta = STEP * np.round((run.y[0] + noise) / STEP)
    return Recording(t, u, theta, source="axis", quanta={"theta_u": STEP}), run.y[1]


def speed_error(rig, recording, speed):
    told = motion_as_read(prepare(recording, rig), rig).states[:, 1]
    return float(np.sqrt(np.mean((told - speed)[20:-20] ** 2)))


@pytest.fixture(scope="module")
def run():
    return swung()


def test_a_rig_that_is_somewhat_off_tells_speeds_better_than_parabolas_alone(run):
    given = TRUE.replace(km=0.48, Ju=0.021, bu=0.052, Tsu=0.045)
    # Without a drive and friction nothing but the readings is left.
    alone = TRUE.replace(km=1e-12, bu=0.0, Tsu=0.0)
    assert speed_error(given, *run) < 0.75 * speed_error(alone, *run)


def test_a_rig_that_is_wrong_leads_no_further_off_than_parabolas_alone(run):
    alone = TRUE.replace(km=1e-12, bu=0.0, Tsu=0.0)
    wrong = TRUE.replace(km=1.0, bu=0.2)
    assert speed_error(wrong, *run) < 1.5 * speed_error(alone, *run)
