"""An error of a reading that a fit of the rig alone takes for torques is found all the same."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.linearised import linearised_at
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.scan import score_effects
from drill_env.diagnosis.sensor_starts import sensor_starts
from drill_env.effects import LIBRARY
from drill_env.identification.samples import prepare
from drill_env.recordings import Recording
from tests.made_recordings import RATE, STEP, played

# A stiff shaft and a brake with a strong hump: the lower disc reverses often.
STIFF = Rig(
    km=0.9, Ju=3.0, Tsu=2.5, dTsu=-0.1, bu=2.2, dbu=0.04, Jl=0.5, ktheta=25.0, Tsl=1.8, T1=2.5,
    T2=-3.5, beta1=2.2, beta2=0.14, bl=0.22,
)  # fmt: skip
PLAY = {"error": 0.05, "width": 0.06}
ERRORS = [e for e in LIBRARY.values() if e.component == "sensor"]


def fitted(seed: int, *effects: dict[str, object]):
    """The rig alone, fitted to two runs with effects."""
    samples = []
    for i in range(2):
        u = quasi_random(np.random.default_rng([seed, i]), 20.0, RATE, 40.0)
        t = np.arange(len(u)) / RATE
        _, readings = played(STIFF.replace(effects=effects), t, u, None)
        angles = [np.round(angle / STEP) * STEP for angle in readings.T]
        quanta = {"theta_u": STEP, "theta_l": STEP}
        run = Recording(t, u, *angles, quanta=quanta, source=f"run-{i}")
        samples.append(prepare(run, STIFF))
    return base_fit(samples, STIFF, free_parameters(STIFF))


@pytest.fixture(scope="module")
def with_play():
    return fitted(5, {"id": "encoder_play_lower", **PLAY})


def test_a_play_of_the_encoder_is_found_where_its_sensor_takes_the_blame(with_play):
    setting, base = with_play
    # Along a motion that follows the readings nothing is left of it.
    scores = {s.term.id: s for s in score_effects(linearised_at(setting, base), ERRORS, 3)}
    assert "encoder_play_lower" not in scores or scores["encoder_play_lower"].gain < 1000.0
    best = min(sensor_starts(setting, base, ERRORS), key=lambda fit: fit.value)
    assert best.terms[-1].id == "encoder_play_lower"
    assert base.value - best.value > 5000.0
    assert best.terms[-1].q == pytest.approx(list(PLAY.values()), rel=0.05)


def test_where_nothing_is_missing_no_sensor_is_blamed():
    setting, base = fitted(6)
    assert sensor_starts(setting, base, ERRORS) == []
