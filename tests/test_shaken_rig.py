"""A rig that slow torques shake is fitted as well as from its true numbers and true noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.concealed import recordings as maker
from benchmarks.concealed.recordings import Truth, make_recording
from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.rounds import NEEDED
from drill_env.identification.samples import prepare
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording
from tests.made_recordings import FREE, STEP

TRUE = Rig(
    km=4.862, Ju=0.7527, Tsu=0.4136, dTsu=0.01856, bu=3.228, dbu=-0.02906, Jl=0.053, ktheta=0.1773,
    Tsl=0.02055, T1=0.1174, T2=-0.3513, beta1=5.216, beta2=0.07702, bl=0.006181,
)  # fmt: skip
GIVEN = TRUE.replace(
    km=5.059, Tsu=0.4444, bu=3.097, Jl=0.04814, ktheta=0.1616, T1=0.1202, T2=-0.3676, beta1=5.557,
    beta2=0.08442, bl=0.00603,
)  # fmt: skip
SHAKEN = (0.06, 0.04)
"""Nm; the lower one is twice what the brake holds at rest."""
SLOW = 0.5
"""Correlation time of these, s."""


def shaken(seed: int) -> Recording:
    """30 s at 100 Hz."""
    truth = Truth({name: getattr(TRUE, name) for name in SYMBOLS}, (), torque=SHAKEN)
    u = np.repeat(quasi_random(np.random.default_rng([seed]), 30.0, 100.0, 3.0), 2)
    found = make_recording(truth, u, (seed,))
    angles = found.angles[::2]
    return Recording(
        found.t[::2], found.u[::2], angles[:, 0], angles[:, 1],
        quanta={"theta_u": STEP, "theta_l": STEP}, source=f"made-{seed}",
    )  # fmt: skip


@pytest.mark.parametrize("seed", [3, 7, 9, 11])
def test_too_little_noise_leads_no_rig_astray(seed, monkeypatch):
    monkeypatch.setattr(maker, "NOISE_TAU", SLOW)
    samples = [prepare(shaken(one), TRUE) for one in (seed, seed + 1)]
    setting, base = base_fit(samples, GIVEN, FREE, 0.06)
    noise = replace(base.noise, torque_u=SHAKEN[0], torque_l=SHAKEN[1], tau_u=SLOW, tau_l=SLOW)
    truth = evaluate(
        setting, setting.coordinates.vector(TRUE), (), noise, base.starts, base.motions
    )
    assert base.value < truth.value + NEEDED
    assert base.rig.Jl == pytest.approx(TRUE.Jl, rel=0.2)
    assert base.rig.ktheta == pytest.approx(TRUE.ktheta, rel=0.2)
