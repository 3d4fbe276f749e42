"""Recordings that the proof's generator makes of a rig with effects hidden in it."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.concealed.recordings import Hidden, Truth, make_recording
from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env.integrator import sampled_voltage, simulate
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording

RATE, STEP = 200.0, 2.0 * math.pi / 8192
FREE = [name for name in SYMBOLS if name != "Ju"]


def made(
    rig: Rig, hidden: tuple[Hidden, ...], seed: tuple[int, ...], *,
    volts: float = 5.0, seconds: float = 30.0,
) -> Recording:  # fmt: skip
    """One recording of a quasi-random voltage up to `volts`."""
    truth = Truth({name: getattr(rig, name) for name in SYMBOLS}, hidden)
    u = quasi_random(np.random.default_rng(list(seed)), seconds, RATE, volts)
    found = make_recording(truth, u, seed)
    return Recording(
        found.t, found.u, found.angles[:, 0], found.angles[:, 1],
        quanta={"theta_u": STEP, "theta_l": STEP}, source=f"made-{seed[-1]}",
    )  # fmt: skip


def played(rig, t, u, initial, **options):
    """States and readings of a simulation through a sampled voltage, at its samples."""
    run = simulate(
        rig, sampled_voltage(t, u), float(t[-1] - t[0]), t_start=float(t[0]), t_eval=t,
        initial=initial, method="dopri5", rtol=1e-9, atol=1e-11, **options,
    )  # fmt: skip
    return run.state, run.readings
