"""Which start goes where, at a voltage with an equilibrium and a limit cycle."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import Engine, InputError, Rig
from drill_env.continuation.basins import basins, wilson
from drill_env.integrator import simulate

RIG = Rig()

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")


def test_at_13_6_volts_both_fates_occur_and_are_the_true_ones():
    found = basins(RIG, 13.6, (1.0, 15.0, 15.0), count=200, seed=3)
    counts = found.starts.fate.value_counts().to_dict()
    assert set(counts) == {"equilibrium", "limit cycle"}
    assert found.share == counts["equilibrium"] / 200
    assert found.low < found.share < found.high
    for fate in counts:
        for row in found.starts[found.starts.fate == fate].head(3).itertuples():
            start = np.array([row.twist, row.omega_u, row.omega_l, 0.0])
            run = simulate(RIG, 13.6, 3000.0, initial=start, rate=10.0, rtol=1e-8)
            swing = float(np.ptp(run.omega_l[-200:]))
            assert swing < 0.5 if fate == "equilibrium" else swing > 45.0


def test_where_one_attractor_is_alone_every_start_reaches_it():
    assert basins(RIG, 5.0, (1.0, 3.0, 3.0), count=20).share == 0.0
    assert basins(RIG, 15.0, (1.0, 15.0, 15.0), count=20).share == 1.0


def test_two_workers_find_the_same_fates():
    seen = []
    box = (1.0, 15.0, 15.0)
    both = basins(
        RIG, 13.6, box, count=50, seed=3, engine=Engine(jobs=2),
        progress=lambda *now: seen.append(now),
    )  # fmt: skip
    assert both.starts.equals(basins(RIG, 13.6, box, count=50, seed=3).starts)
    assert seen == [(done, 3) for done in range(4)]


def test_wilsons_interval():
    # Newcombe 1998, table I, method 3: 81 of 263.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=5e-5)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=5e-5)


def test_boxes_without_sense_are_refused():
    with pytest.raises(InputError, match="box"):
        basins(RIG, 13.6, (1.0, -1.0, 1.0))
    with pytest.raises(InputError, match="nothing turns"):
        basins(RIG, 0.05, (1.0, 1.0, 1.0))
