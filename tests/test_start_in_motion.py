"""Recordings that begin in motion, of a rig that lacks much: the start is fitted, not given up."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import value_at
from drill_env.diagnosis.offered import free_parameters
from drill_env.identification.samples import prepare
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording

STEP, RATE = 2.0 * math.pi / 8192, 125.0
# A flexible joint; in another maker's recordings its string stiffened in three straight pieces.
JOINT = Rig.paper().replace(
    km=2.0, Ju=0.2, Tsu=0.35, dTsu=0.02, bu=0.5, dbu=0.02, Jl=0.17, ktheta=16.0, Tsl=0.4, bl=0.14,
    friction="coulomb",
)  # fmt: skip
STIFF = JOINT.replace(effects=({"id": "string_hardening", "coefficient": 1000.0},))


def recorded(seed: int) -> Recording:
    rng = np.random.default_rng(seed)
    t = np.arange(int(10 * RATE)) / RATE
    u = 4.0 * quasi_random(rng, 10.0, RATE, 5.0)
    run = simulate(
        STIFF, sampled_voltage(t, u), float(t[-1]), t_eval=t, initial=(-0.14, 4.0, 5.9, 0.0)
    )
    angles = run.readings + rng.normal(0.0, 4e-4, run.readings.shape)
    angles = STEP * np.round(angles / STEP)
    return Recording(
        t, u, angles[:, 0], angles[:, 1], quanta={"theta_u": STEP, "theta_l": STEP}, source="made"
    )  # fmt: skip


def test_a_step_of_the_start_makes_a_recording_no_less_likely():
    samples = [prepare(recorded(3), JOINT)]
    setting, fit = base_fit(samples, JOINT, free_parameters(JOINT, {}, "Ju"))
    assert np.abs(fit.starts[0][0, 1:3]).min() > 1.0
    moved = [s + m for s, m in zip(fit.starts, fit.start_steps, strict=True)]
    there = value_at(setting, fit.vector, fit.terms, fit.noise, moved, fit.motions)
    # Within what is left to gain where the fit ended.
    assert there < fit.value + 1.0
