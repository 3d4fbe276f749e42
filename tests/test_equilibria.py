"""Equilibria, the sticking set and the Hopf points, against closed forms and simulation."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import InputError, Rig
from drill_env.continuation import (
    PeriodMap,
    critical_slope,
    equilibrium_branch,
    hopf_points,
    routh_hurwitz,
    sticking_set,
)
from drill_env.continuation.branch import Corrector
from drill_env.integrator import simulate

RIG = Rig()


def test_critical_slope_of_equation_12():
    slope = critical_slope(RIG)
    assert f"{slope:.2e}" == "-1.14e-03"
    assert slope == pytest.approx(-0.00114224, abs=5e-9)
    assert routh_hurwitz(RIG, slope)[3] == pytest.approx(0.0, abs=1e-15)


def test_branch_changes_stability_where_routh_and_hurwitz_say():
    branch = equilibrium_branch(RIG, np.linspace(0.01, 40.0, 400))
    expected = [min(routh_hurwitz(RIG, float(slope))) > 0.0 for slope in branch.slope]
    assert branch.stable.tolist() == expected
    assert 0 < sum(expected) < 400


@pytest.mark.parametrize("volts", [0.0, 0.05, 0.09, 0.0952])
def test_sticking_set_ends_where_simulation_starts_to_move(volts):
    found = sticking_set(RIG, volts)
    assert found is not None and found.attractive
    low, high = found.twist
    for twist, stays in ((low, 1), (high, 1), (low, 0), (high, 0)):
        inside = 1e-7 * (high - low) * (1 if twist == low else -1)
        start = np.array([twist + (inside if stays else -inside), 0.0, 0.0, 0.0])
        end = simulate(RIG, volts, 5.0, initial=start).final_state
        moved = float(np.abs(end - start)[:3].max())
        assert moved == 0.0 if stays else moved > 0.0


def test_sticking_set_vanishes_at_a():
    assert RIG.breakaway_voltage == pytest.approx(0.0952848, abs=5e-8)
    assert sticking_set(RIG, RIG.breakaway_voltage - 1e-12) is not None
    assert sticking_set(RIG, RIG.breakaway_voltage + 1e-12) is None


def test_hopf_points_b_and_d():
    b, d = hopf_points(RIG, 20.0)
    assert (b.voltage, b.omega) == pytest.approx((0.565729270, 0.815194), abs=5e-7)
    assert (d.voltage, d.omega) == pytest.approx((13.183693585, 23.76907), abs=5e-6)
    assert b.supercritical and not d.supercritical
    for point in (b, d):
        # Independent of the search: the linearisation's eigenvalues on both sides.
        sides = equilibrium_branch(RIG, point.omega * np.array([1 - 1e-9, 1 + 1e-9]))
        growth = np.sort(sides.eigenvalues.real, axis=1)[:, -1]
        assert growth[0] * growth[1] < 0.0
        volts = np.interp(0.0, np.sort(growth), sides.voltage[np.argsort(growth)])
        assert point.voltage == pytest.approx(volts, abs=1e-10)
        assert point.slope == pytest.approx(critical_slope(RIG), abs=1e-15)
        assert point.frequency == pytest.approx(1.55297, abs=5e-6)


@pytest.mark.parametrize("index", [0, 1])
def test_lyapunov_coefficient_and_crossing_against_small_cycles(index):
    """Near a Hopf point the cycles' amplitude is sqrt(-mu Re c / l1), with mu = u - u_H."""
    point = hopf_points(RIG, 20.0)[index]
    flow = PeriodMap(RIG, rtol=1e-12)
    corrector = Corrector(flow, np.array([2.0, 5.0, 10.0, 4.0, 1.0]))
    mode = point.mode / np.linalg.norm(point.mode)
    border = np.eye(5)[2]
    coefficients = []
    for amplitude in (0.01, 0.02):
        state = point.state + amplitude * point.omega * point.mode.real
        guess = np.append(state, [2.0 * np.pi / point.frequency, point.voltage])
        cycle = corrector.point(guess, border, 0.0).cycle
        # omega_l swings by +-2 r |q3| when the normal form's amplitude is r.
        radius = 0.5 * (cycle.max - cycle.min) / (2.0 * abs(mode[2]))
        mu = cycle.parameter - point.voltage
        coefficients.append(-mu * point.crossing / (point.frequency * radius**2))
    # The error of the ratio is of second order in the amplitude.
    extrapolated = (4.0 * coefficients[0] - coefficients[1]) / 3.0
    assert extrapolated == pytest.approx(point.lyapunov, rel=2e-3)
    assert (cycle.stable, cycle.parameter > point.voltage) == ((True, True), (False, True))[index]


def test_crossing_is_the_derivative_of_the_real_part():
    for point in hopf_points(RIG, 20.0):
        sides = equilibrium_branch(RIG, point.omega * np.array([1 - 1e-5, 1 + 1e-5]))
        pair = [max(v.real for v in row if abs(v.imag) > 0.1) for row in sides.eigenvalues]
        slope = (pair[1] - pair[0]) / (sides.voltage[1] - sides.voltage[0])
        assert point.crossing == pytest.approx(slope, rel=1e-5)


def test_a_rig_that_no_slope_makes_swing_has_no_hopf_point():
    heavy = Rig(Jl=1.0, Ju=0.1, ktheta=1.0, bu=0.1, dbu=0.0)
    with pytest.raises(InputError, match="no friction slope"):
        critical_slope(heavy)
    assert hopf_points(heavy, 20.0) == []
