"""Batches are the single runs, in order."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import InputError, Rig
from drill_env.integrator import simulate, simulate_batch


def test_batch_equals_single_runs_bit_for_bit() -> None:
    volts = [0.05, 1.0, 2.0, 3.5]
    rigs = [Rig(), Rig(ktheta=0.1), Rig(friction="coulomb"), Rig(clamp=True)]
    starts = np.array([[0.0, 0, 0, 0], [0.1, 1, 2, 0], [0, 0, 0, 0], [0.5, -1, 3, 1]])
    together = simulate_batch(rigs, volts, 20.0, initial=starts, rate=10.0)
    for run, rig, u, start in zip(together, rigs, volts, starts, strict=True):
        alone = simulate(rig, u, 20.0, initial=start, rate=10.0)
        np.testing.assert_array_equal(run.state, alone.state)
        np.testing.assert_array_equal(run.events.t, alone.events.t)


def test_one_rig_serves_all_and_lengths_must_fit() -> None:
    assert len(simulate_batch(Rig(), [1.0, 2.0, 3.0], 1.0)) == 3
    with pytest.raises(InputError, match="rigs has 2 entries: give 1 or 3"):
        simulate_batch([Rig(), Rig()], [1.0, 2.0, 3.0], 1.0)
