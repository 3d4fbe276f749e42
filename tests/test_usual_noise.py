"""Under a torque that follows what is missing a descent ends anywhere; not under little noise."""

from __future__ import annotations

import math

import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env.diagnosis.search import base_fit, search
from drill_env.effects import LIBRARY
from drill_env.identification.noise import NoiseModel
from drill_env.identification.samples import prepare
from tests.made_recordings import FREE, made


def test_a_strong_hold_after_rest_is_fitted_to_its_end():
    hold = Hidden("dwell_stiction", {"torque": 0.08, "tau": 1.8})
    recordings = [made(Rig(), (hold,), (seed,), volts=3.0) for seed in (1, 2)]
    setting, base = base_fit([prepare(r, Rig()) for r in recordings], Rig(), FREE)
    # The rig alone takes it for a slow torque on the lower disc.
    assert math.log(base.noise.tau_l / NoiseModel().tau_l) > 0.5
    found = search(setting, base, [LIBRARY["dwell_stiction"]], lambda text: None).named[0]
    torque, time = found.term.q
    assert torque == pytest.approx(0.08, rel=0.05)
    assert time == pytest.approx(1.8, rel=0.15)
    assert found.fit.noise.torque_l < 2.0 * NoiseModel().torque_l
