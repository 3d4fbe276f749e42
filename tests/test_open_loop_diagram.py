"""The open-loop diagram against independently computed limit cycles and equilibria."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import Rig
from drill_env.benchmark import open_loop_diagram
from drill_env.dynamics import equilibrium_voltage

# Volts: min, max (rad/s), period (s) of the stable cycle, computed outside this project.
CYCLES = {
    1.0: (0.24142854, 3.00943862, 4.08502045),
    2.0: (-0.01159509, 7.10201337, 4.10772432),
    3.0: (-0.20790959, 11.08310234, 4.10799940),
    3.5: (-0.32042236, 13.04745390, 4.10334278),
    4.0: (-0.44439316, 14.99802653, 4.09727828),
    5.0: (-0.71695208, 18.87307182, 4.08406516),
}


@pytest.fixture(scope="module")
def diagram():
    return open_loop_diagram(Rig.paper(), np.array(sorted(CYCLES))).set_index("voltage")


@pytest.mark.parametrize("volts", CYCLES)
def test_cycles_are_the_published_ones(diagram, volts):
    row = diagram.loc[volts]
    low, high, period = CYCLES[volts]
    assert row["min"] == pytest.approx(low, abs=1e-7)
    assert row["max"] == pytest.approx(high, abs=1e-7)
    assert row["period"] == pytest.approx(period, abs=1e-7)


def test_equilibria_solve_equation_11(diagram):
    volts = equilibrium_voltage(Rig.paper(), diagram.equilibrium.to_numpy())
    assert np.abs(volts - diagram.index.to_numpy()).max() < 1e-9


def test_below_the_hopf_point_the_speed_is_steady():
    """Hopf point B lies at 0.5657 V, the rig turns above 0.0953 V."""
    found = open_loop_diagram(Rig.paper(), np.array([0.05, 0.2, 0.5]))
    assert found["max"][0] == found["min"][0] == found["equilibrium"][0] == 0.0
    assert np.abs(found["max"][1:] - found["equilibrium"][1:]).max() < 1e-5
    assert np.isnan(found["period"]).all()


def test_a_rising_grid_follows_one_branch():
    """Each voltage starts where the last one ended: the neighbours do not matter here."""
    alone = open_loop_diagram(Rig.paper(), np.array([3.5]))
    assert alone["max"][0] == pytest.approx(CYCLES[3.5][1], abs=1e-7)
