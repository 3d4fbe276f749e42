"""Where a model errs by no more than noise of the readings gives, nothing is sought."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.by_prediction import diagnose_by_prediction
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.identification.equation_error import with_integrals
from drill_env.identification.samples import prepare
from drill_env.integrator import sampled_voltage, simulate
from drill_env.prediction.noise import drawn_noise, is_noise
from drill_env.recordings import Recording

LONE = Rig.one_inertia(km=0.3, Ju=0.02, Tsu=0.03, dTsu=0.0, bu=0.03, dbu=0.0)
WEIGHED = LONE.replace(effects=({"id": "upper_unbalance", "torque": 0.05, "phase": 0.3},))
QUICK = DiagnosisOptions(most=1, given_rig=True, doubt=0.1, leave_out=("gear_backlash",))


def by_tachometer(rig: Rig, noise: float, seed: int) -> Recording:
    """Speeds (rad/s) under voltages held for half a second, read with white noise."""
    rng = np.random.default_rng(seed)
    t = np.asarray(0.005 * np.arange(4001), dtype=np.float64)
    u = np.repeat(rng.uniform(-1.6, 1.6, 41), 100)[: len(t)]
    run = simulate(rig, sampled_voltage(t, u), t[-1], t_eval=t, method="dopri5", rtol=1e-8)
    speed = np.asarray(run.state[:, 1] + noise * rng.standard_normal(len(t)), dtype=np.float64)
    return Recording(t=t, u=u, omega_u=speed, source=f"run-{seed}.csv")


def test_the_noise_of_a_speed_adds_up_in_its_integral():
    rng = np.random.default_rng(0)
    speed = prepare(with_integrals(by_tachometer(LONE, 0.05, 2)), LONE)
    steps = np.diff(drawn_noise(speed, rng))
    # Of a trapezium's two ends each counts a half.
    assert np.std(steps) == pytest.approx(0.05 * 0.005 / np.sqrt(2.0), rel=0.1)
    angle = replace(speed.recording, omega_u=None, quanta={"theta_u": 0.02})
    white = drawn_noise(prepare(angle, LONE), rng)
    assert np.std(white) == pytest.approx(0.02 / np.sqrt(12.0), rel=0.1)


@pytest.mark.parametrize(("rig", "noise"), [(LONE, True), (WEIGHED, False)])
def test_a_noisy_tachometer_is_noise_and_a_weight_is_none(rig: Rig, noise: bool):
    runs = [by_tachometer(rig, 0.05, i) for i in range(3)]
    found = diagnose_by_prediction(runs[:2], LONE, runs[2:], QUICK)
    assert is_noise([(found.before, found.fold.unseen)]) is noise
    assert bool(found.result.effects) is not noise
    # What was found leaves no more than noise.
    assert is_noise([(found.after, found.fold.unseen)])
