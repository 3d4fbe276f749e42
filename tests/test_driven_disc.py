"""The driven disc of a rig whose drive is a measured torque, by its encoders alone."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.rig_maker import quasi_random
from drill_env import InputError, Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.by_prediction import _from_one_zero
from drill_env.diagnosis.offered import free_parameters
from drill_env.identification.samples import Samples, prepare
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.cut import leads_of
from drill_env.recordings import Recording
from tests.made_recordings import played

RATE, NOISE = 100.0, 3e-4
RIG = Rig().replace(km=1.0, Tsu=0.5, Tsl=0.02)


def recorded(seed: int, upper_zero: float, lower_zero: float) -> Samples:
    rng = np.random.default_rng(seed)
    torque = quasi_random(rng, 20.0, RATE, 18.0)
    t = np.arange(len(torque)) / RATE
    _, angles = played(RIG, t, torque, (0.0, 0.0, 0.0, 0.0))
    angles = angles + [upper_zero, lower_zero] + rng.normal(0.0, NOISE, angles.shape)
    given = Recording(t, torque, angles[:, 0], angles[:, 1], drive="torque", source=f"run-{seed}")
    return prepare(given, RIG)


def test_what_twist_lies_between_the_encoders_zeros_is_no_torque():
    zeros = [(0.0, 0.0), (-1.1, 0.0), (2.0, 0.4)]
    samples = [recorded(i, *zero) for i, zero in enumerate(zeros)]
    whole = base_fit(samples[:2], RIG, free_parameters(RIG, {"km": 1.0}, "km"))
    seen, unseen = _from_one_zero(samples[:2], samples[2:], *whole)
    for before, after, (upper, lower) in zip(samples, [*seen, *unseen], zeros, strict=True):
        moved = float(np.median(after.angles[:, 1] - before.angles[:, 1]))
        # The two angles then differ by the twist alone.
        assert moved == pytest.approx(upper - lower, abs=0.02)
        assert (after.angles[:, 0] == before.angles[:, 0]).all()


def test_leads_that_are_no_row_apart_are_left_out():
    given = recorded(4, 0.0, 0.0)
    long, short = (leads_of([given], Criteria(), horizon) for horizon in (1.0, 0.25))
    assert long == pytest.approx([0.03, 0.1, 0.3, 0.95])
    # A tenth of 0.25 s comes before the third row.
    assert short == pytest.approx([0.03, 0.075, 0.2375])
    with pytest.raises(InputError, match="too few windows"):
        leads_of([given], Criteria(), 0.03)
