"""Limit cycles, their multipliers and their jumps, against the table and finite differences."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from drill_env import Rig
from drill_env.continuation import (
    Corrector,
    CycleError,
    LimitCycle,
    PeriodMap,
    Point,
    StepRule,
    bifurcation_diagram,
    follow,
    oriented,
    settled_cycle,
)
from drill_env.friction import lower_curve
from drill_env.integrator import Disc, Kind, simulate

RIG = Rig()
SCALE = np.array([2.0, 10.0, 20.0, 4.0, 1.0])

# Volts: min, max (rad/s), period (s), second multiplier; computed independently.
STABLE = {
    1.0: (0.24142854, 3.00943862, 4.08502045, 0.10058),
    2.0: (-0.01159509, 7.10201337, 4.10772432, 3.14e-4),
    3.0: (-0.20790959, 11.08310234, 4.10799940, 0.00992),
    3.5: (-0.32042236, 13.04745390, 4.10334278, 0.02186),
    4.0: (-0.44439316, 14.99802653, 4.09727828, 0.04767),
    5.0: (-0.71695208, 18.87307182, 4.08406516, 0.14984),
}


@functools.cache
def cycle_at(volts: float) -> Point:
    guess = settled_cycle(PeriodMap(RIG), volts)
    assert guess is not None
    return Corrector(PeriodMap(RIG), SCALE).at_parameter(guess, volts)


@pytest.mark.parametrize("volts", STABLE)
def test_stable_cycles_of_the_table(volts):
    cycle = cycle_at(volts).cycle
    low, high, period, second = STABLE[volts]
    assert (cycle.min, cycle.max) == pytest.approx((low, high), abs=1e-7)
    assert cycle.period == pytest.approx(period, abs=1e-8)
    largest = abs(complex(cycle.multipliers[0]))
    assert largest == pytest.approx(second, abs=6e-7 if second < 1e-3 else 6e-6)
    assert cycle.stable and cycle.steps <= 5
    assert cycle.trivial == pytest.approx(1.0, abs=1e-7)
    assert cycle.residual < 1e-8


def test_times_stuck_and_reversed_at_2_volts():
    cycle = cycle_at(2.0).cycle
    assert cycle.sticking_s == pytest.approx(0.02334, abs=6e-6)
    assert cycle.reversed_s == pytest.approx(0.10570, abs=6e-6)
    assert cycle.character == "reversing and sticking"
    # States merge in finite time: one multiplier vanishes.
    assert abs(complex(cycle.multipliers[1])) < 1e-9
    run = simulate(RIG, 2.0, cycle.period, initial=np.append(cycle.state, 0.0), rtol=1e-10)
    grid = np.linspace(0.0, cycle.period, 400_001)
    run = simulate(
        RIG, 2.0, cycle.period, initial=np.append(cycle.state, 0.0), t_eval=grid, rtol=1e-10
    )
    step = grid[1]
    assert (run.omega_l < 0.0).sum() * step == pytest.approx(cycle.reversed_s, abs=3 * step)
    assert (run.omega_l == 0.0).sum() * step == pytest.approx(cycle.sticking_s, abs=3 * step)


def plain_return(state: np.ndarray, volts: float) -> np.ndarray:
    """The Poincare map on maxima of omega_l, made with nothing but `simulate`."""
    run = simulate(
        RIG, volts, 6.0, initial=np.append(state, 0.0), t_eval=np.zeros(0), extrema=True,
        rtol=1e-12, atol=1e-14,
    )  # fmt: skip
    peaks = run.events.where(Disc.LOWER, Kind.MAXIMUM)
    late = np.flatnonzero((peaks.t > 3.0) & (peaks.state[:, 2] > 0.5 * state[2]))
    return peaks.state[late[0], :3]


def on_section(upper: float, omega: float) -> np.ndarray:
    return np.array([float(lower_curve(RIG, omega)) / RIG.ktheta, upper, omega])


@pytest.mark.parametrize("volts", [1.0, 3.5, 5.0])
def test_multipliers_against_differences_of_the_plain_return_map(volts):
    cycle = cycle_at(volts).cycle
    columns = []
    step = 1e-4
    for k in (1, 2):
        ends = []
        for sign in (1.0, -1.0):
            place = cycle.state.copy()
            place[k] += sign * step
            ends.append(plain_return(on_section(place[1], place[2]), volts)[1:])
        columns.append((ends[0] - ends[1]) / (2.0 * step))
    values = np.linalg.eigvals(np.array(columns).T)
    ours = np.sort(np.abs(cycle.multipliers))
    assert np.sort(np.abs(values)) == pytest.approx(ours, abs=2e-6)


@pytest.mark.parametrize("parameter", ["voltage", "T2", "ktheta", "Jl", "Tsl"])
def test_jacobian_with_its_jumps_against_differences(parameter):
    """At 3.5 V the disc reverses twice a period."""
    value = 3.5 if parameter == "voltage" else getattr(RIG, parameter)
    flow = PeriodMap(RIG, parameter, 3.5, rtol=1e-12)
    cycle = cycle_at(3.5).cycle
    z = np.concatenate([cycle.state, [0.93 * cycle.period, value]])
    shot = flow.shoot(z[:3], z[3], z[4])
    for k in range(5):
        step = 1e-6 * max(1.0, abs(z[k])) if k < 4 else 1e-6 * abs(value)
        ends = []
        for sign in (1.0, -1.0):
            moved = z.copy()
            moved[k] += sign * step
            ends.append(flow.shoot(moved[:3], moved[3], moved[4]).end)
        difference = (ends[0] - ends[1]) / (2.0 * step)
        bound = 1e-6 * (1.0 + np.abs(difference).max())
        assert shot.jacobian[:, k] == pytest.approx(difference, abs=bound)


def gather(start: Point, side: float, until: tuple[float, float]) -> list[LimitCycle]:
    corrector = Corrector(PeriodMap(RIG), SCALE)
    found = []
    for point in follow(corrector, oriented(start, side * np.eye(5)[4]), StepRule()):
        if not until[0] < point.z[4] < until[1]:
            return found
        found.append(point.cycle)
    return found


def test_reversed_continuation_finds_the_same_branch():
    """Out from 3.5 V to 1.5 V, then back from there; every cycle lies on the same branch."""
    down = gather(cycle_at(3.5), -1.0, (1.5, 4.0))
    last = down[-1]
    corrector = Corrector(PeriodMap(RIG), SCALE)
    z = np.append(last.state, [last.period, last.parameter])
    back = gather(corrector.at_parameter(z, last.parameter), 1.0, (1.4, 3.5))
    assert min(c.parameter for c in back) < 1.6 and max(c.parameter for c in back) > 3.3
    for cycle in back[:: max(1, len(back) // 12)]:
        near = min(down, key=lambda c: abs(c.parameter - cycle.parameter))
        guess = np.append(near.state, [near.period, near.parameter])
        same = corrector.at_parameter(guess, cycle.parameter).cycle
        assert same.max == pytest.approx(cycle.max, abs=1e-8)
        assert same.period == pytest.approx(cycle.period, abs=1e-9)


def test_from_the_fold_both_ways_the_branch_is_the_diagrams():
    diagram = bifurcation_diagram(RIG, 15.0)
    (branch,) = diagram.branches
    middle = next(p for p in branch.points if not p.cycle.stable and p.cycle.parameter > 14.0)
    corrector = Corrector(PeriodMap(RIG), SCALE)
    for sign, goal in ((1.0, 13.25), (-1.0, 13.6)):
        start = oriented(middle, sign * middle.tangent)
        for point in follow(corrector, start, StepRule()):
            if point.z[4] < goal:
                break
        volts = point.z[4]
        stable = sign < 0.0
        near = min(
            (p for p in branch.points if p.cycle.stable == stable and p.z[4] > 10.0),
            key=lambda p: abs(p.z[4] - volts),
        )
        same = corrector.at_parameter(near.z, volts).cycle
        assert same.stable == stable == point.cycle.stable
        assert (same.min, same.max) == pytest.approx((point.cycle.min, point.cycle.max), abs=1e-7)


def test_a_cycle_that_is_not_there_is_refused_in_words():
    corrector = Corrector(PeriodMap(RIG), SCALE)
    with pytest.raises(CycleError, match="Newton|singular|shooting"):
        corrector.at_parameter(np.array([1.0, 30.0, 60.0, 4.0, 14.9]), 14.9)
