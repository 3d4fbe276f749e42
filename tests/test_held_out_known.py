"""Held-out recordings are followed by the motion along which known effects act."""

from __future__ import annotations

import numpy as np

from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.fit_changes import added
from drill_env.diagnosis.held_out import followed
from drill_env.diagnosis.joint import polished
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.identification.samples import Samples, prepare
from drill_env.recordings import Recording
from tests.made_recordings import played

STEP, RATE = 2.0 * np.pi / 65536, 500.0
# A joint that rings at 5.5 Hz, a tenth of critically damped, driven by a measured torque.
JOINT = Rig(
    km=1.0, Ju=0.006, Tsu=0.045, dTsu=0.004, bu=0.003, dbu=0.0, Jl=0.009, ktheta=4.0, Tsl=0.06,
    bl=0.002, friction="coulomb", effects=({"id": "string_damping", "damping": 0.005},),
)  # fmt: skip


def moved(seed: int, plant: Rig = JOINT) -> Samples:
    u = quasi_random(np.random.default_rng(seed), 15.0, RATE, 0.4)
    t = np.arange(len(u)) / RATE
    angles = np.round(played(plant, t, u, np.zeros(4))[1] / STEP) * STEP
    quanta = {"theta_u": STEP, "theta_l": STEP}
    recording = Recording(t, u, angles[:, 0], angles[:, 1], quanta=quanta, drive="torque")
    return prepare(recording, plant)


def test_a_rig_with_a_known_effect_follows_what_it_was_not_fitted_to():
    fitted, held = moved(1), moved(2)
    free = ["Ju", "Tsu", "bu", "Jl", "ktheta", "Tsl", "bl"]
    setting, base = base_fit([fitted], JOINT.replace(ktheta=4.1, Jl=0.0092), free)
    seen = followed(held, setting, base)[2].trace.standardised
    # Under the noise that the fit found: a recording that goes its own way errs by a hundred.
    assert np.sqrt(np.nanmean(seen[500:] ** 2)) < 2.0


def test_it_does_so_under_what_it_lacks_too_however_large_that_is():
    """Without a torque of a tenth of the drive nothing follows under the usual noise."""
    heavy = {"id": "unbalance", "torque": 0.04, "phase": 0.9}
    plant = JOINT.replace(effects=(*JOINT.effects, heavy))
    fitted, held = moved(1, plant), moved(2, plant)
    setting, base = base_fit([fitted], JOINT, ["Tsu", "bu", "Tsl", "bl"])
    unbalance = Term(Named(LIBRARY["unbalance"]), np.array([0.04, 0.9]))
    there = polished(setting, added(setting, base, unbalance))
    seen = followed(held, setting, there)[2].trace.standardised
    assert np.sqrt(np.nanmean(seen[500:] ** 2)) < 2.0
