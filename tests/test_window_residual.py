"""What is left of an axis' readings is learnt from one coordinate where that tells most."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.by_prediction import diagnose_by_prediction
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.recordings import Recording

RATE, SECONDS, NOISE, BIT = 200.0, 20.0, 2e-4, 1.5
AXIS = Rig.one_inertia(km=0.5, Ju=0.05, Tsu=0.0, bu=0.1)


def stuck(u: np.ndarray) -> np.ndarray:
    """What a bridge makes of a voltage whose register never sets the bit worth 1.5 V."""
    return u - np.sign(u) * BIT * (np.floor(np.abs(u) / BIT) % 2)


def run_of(seed: int, bridge) -> Recording:
    """A linear axis, exactly, under slow voltages that pass through all levels."""
    rng, t = np.random.default_rng(seed), np.arange(int(SECONDS * RATE)) / RATE
    tones = rng.uniform(0.02, 0.3, 6)
    u = sum(3.0 * np.cos(2.0 * math.pi * f * t + rng.uniform(0.0, 6.3)) for f in tones.tolist())
    u = np.repeat(np.asarray(u)[::10], 10)
    load = np.repeat(rng.normal(0.0, 0.05, len(t) // 10), 10)
    decay = math.exp(-AXIS.bu / AXIS.Ju / RATE)
    theta, omega = np.zeros(len(t)), 0.0
    for k, volts in enumerate((bridge(u)[:-1]).tolist()):
        end = (AXIS.km * volts + load[k]) / AXIS.bu
        theta[k + 1] = theta[k] + end / RATE + (omega - end) * (1.0 - decay) * AXIS.Ju / AXIS.bu
        omega = end + (omega - end) * decay
    return Recording(t, u, theta + rng.normal(0.0, NOISE, len(t)), source=f"axis {seed}")


@pytest.mark.parametrize("bridge", [stuck, np.asarray])
def test_a_saw_over_the_voltage_is_no_loss_of_small_voltages(bridge):
    """The nearest name removes a part of it only; what is left is learnt from the voltage."""
    runs = [run_of(seed, bridge) for seed in (1, 2, 3, 4)]
    options = DiagnosisOptions(given_rig=True, most=1)
    result = diagnose_by_prediction(runs[:2], AXIS, runs[2:], options).result
    assert not result.effects
    assert (result.verdict == "unexplained") == (bridge is stuck)
    if bridge is stuck:
        assert result.located is not None
        assert (result.located.component, result.located.depends_on) == ("actuator", "voltage")
