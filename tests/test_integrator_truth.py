"""The event-driven integrator against an independent reference and the published numbers."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from reference import DATA, PAPER, cases, solve
from scipy.linalg import expm

from drill_env._types import Method
from drill_env.friction import lower_curve, lower_torque_set
from drill_env.integrator import Disc, Kind, Trajectory, Voltage, simulate
from drill_env.parameters import Rig

METHODS: tuple[Method, ...] = get_args(Method)
STORED = dict(np.load(DATA))
CASES = cases()

# Volts: min, max, period of omega_l on the stable cycle (`issues show 3`).
CYCLES = {
    1.0: (0.24142854, 3.00943862, 4.08502045),
    2.0: (-0.01159509, 7.10201337, 4.10772432),
    3.0: (-0.20790959, 11.08310234, 4.10799940),
    3.5: (-0.32042236, 13.04745390, 4.10334278),
    4.0: (-0.44439316, 14.99802653, 4.09727828),
    5.0: (-0.71695208, 18.87307182, 4.08406516),
}


def run_case(name: str, **options: Any) -> Trajectory:
    """One stored case, run by our integrator."""
    case = CASES[name]
    voltage = Voltage(case["breaks"], case["volts"][:, None])
    initial = np.array(case.get("initial", (0.0, 0.0, 0.0, 0.0)))
    return simulate(
        Rig(**case["par"]), voltage, case["breaks"][-1], t_eval=case["t_eval"], initial=initial,
        **options,
    )  # fmt: skip


def contacts(run: Trajectory) -> np.ndarray:
    """Rows (t, disc, kind) of the mode changes, as the reference logs them."""
    e = run.events
    keep = (e.disc != Disc.LOWER_LAW) & (e.kind <= Kind.REVERSAL)
    return np.column_stack([e.t, e.disc, e.kind])[keep]


@pytest.fixture(scope="module")
def cycle_runs() -> dict[float, Trajectory]:
    """Each constant voltage of the table, run into its cycle (multipliers are below 0.15)."""
    start = np.array([2.0, 3.0, 8.0, 0.0])
    return {
        volts: simulate(Rig(), volts, 150.0, rate=1.0, initial=start, rtol=1e-12, extrema=True)
        for volts in CYCLES
    }


@pytest.mark.parametrize("name", list(CASES))
def test_same_trajectory_and_events_as_the_reference(name: str) -> None:
    run = run_case(name)
    assert np.abs(run.state - STORED[f"{name}_state"]).max(axis=0)[2] <= 1e-7
    assert np.abs(run.state - STORED[f"{name}_state"]).max() <= 1e-7
    ours, theirs = contacts(run), STORED[f"{name}_events"]
    assert ours.shape == theirs.shape
    assert (ours[:, 1:] == theirs[:, 1:]).all()
    # An event moves by state error / rate; the slowest crossings here run at 0.01 rad/s^2.
    assert np.abs(ours[:, 0] - theirs[:, 0]).max() <= 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_long_run_bar_for_both_methods(method: Method) -> None:
    run = run_case("long", rtol=1e-11, method=method)
    assert np.abs(run.omega_l - STORED["long_state"][:, 2]).max() <= 1e-7


def test_samples_inside_long_steps_are_as_good_as_their_ends() -> None:
    """One disc settles in 4 ms, all else is slow; both turn, so that the exponential is exact."""
    rig = Rig(
        km=9.48, Ju=0.0108, Tsu=0.0034, dTsu=0.0, bu=2.64, dbu=0.0, Jl=0.103, ktheta=0.0215,
        Tsl=0.0237, bl=0.1, friction="coulomb",
    )  # fmt: skip
    start, volts, t = np.array([1.0, 5.0, 6.0, 0.0]), 1.5, np.linspace(0.0, 10.0, 1001)
    run = simulate(rig, volts, 10.0, t_eval=t, initial=start)
    field = np.zeros((4, 4))
    field[0, 1], field[0, 2] = 1.0, -1.0
    field[1, [0, 1, 3]] = (
        -rig.ktheta / rig.Ju,
        -rig.bu / rig.Ju,
        (rig.km * volts - rig.Tsu) / rig.Ju,
    )
    field[2, [0, 2, 3]] = rig.ktheta / rig.Jl, -rig.bl / rig.Jl, -rig.Tsl / rig.Jl
    step, exact = expm(field * t[1]), np.tile(np.append(start[:3], 1.0), (len(t), 1))
    for i in range(1, len(t)):
        exact[i] = step @ exact[i - 1]
    assert len(run.events) == 0 and run.steps < 700
    assert np.abs(run.state - exact)[:, 1:3].max() < 1e-9


def test_stored_reference_is_reproduced() -> None:
    """Guards the data file: its first two seconds, computed again from the equations."""
    t = CASES["random"]["t_eval"]
    t = t[t <= 2.0]
    case = CASES["random"]
    again = solve(PAPER, case["breaks"][:9], case["volts"][:8], t)
    assert np.abs(again.state - STORED["random_state"][: len(t)]).max() < 1e-11


@pytest.mark.parametrize("start", [(3.0, 0.0, 1.0, 0.0), (0.0, 0.0, -8.0, 0.0)])
def test_clamped_law_that_switches_right_before_a_reversal(
    start: tuple[float, float, float, float],
) -> None:
    """T_l > 0 only below 0.2 rad/s: clamp switch, reversal and switch within one step."""
    change = {"Tsl": 0.0, "beta1": 100.0, "beta2": 3.0, "Jl": 0.0106, "ktheta": 1.0, "clamp": True}
    t = np.linspace(0.0, 1.5, 31)
    truth = solve({**PAPER, **change}, t[[0, -1]], np.array([1.0]), t, initial=start, cap=5e-4)
    for method in METHODS:
        run = simulate(Rig(**change), 1.0, t[-1], t_eval=t, initial=np.array(start), method=method)
        assert np.abs(run.state - truth.state).max() < 1e-7


@pytest.mark.parametrize("volts", list(CYCLES))
def test_published_cycles(cycle_runs: dict[float, Trajectory], volts: float) -> None:
    low, high, period = CYCLES[volts]
    lower = cycle_runs[volts].events.where(Disc.LOWER)
    minima, maxima = lower.where(kind=Kind.MINIMUM), lower.where(kind=Kind.MAXIMUM)
    peaks = maxima.t[maxima.state[:, 2] > 0.5 * high]
    assert minima.state[-6:, 2].min() == pytest.approx(low, abs=1e-8)
    assert maxima.state[-6:, 2].max() == pytest.approx(high, abs=1e-8)
    assert np.diff(peaks)[-5:] == pytest.approx(period, abs=1e-8)


def test_sticking_and_reversed_time_at_two_volts(cycle_runs: dict[float, Trajectory]) -> None:
    e = cycle_runs[2.0].events.where(Disc.LOWER)
    keep = e.kind <= Kind.REVERSAL
    t, kind = e.t[keep], e.kind[keep]
    turn = np.flatnonzero(kind == Kind.REVERSAL)[-2]
    assert [Kind(k) for k in kind[turn : turn + 3]] == [Kind.REVERSAL, Kind.STICK, Kind.SLIP]
    assert t[turn + 1] - t[turn] == pytest.approx(0.10570, abs=5e-6)
    assert t[turn + 2] - t[turn + 1] == pytest.approx(0.02334, abs=5e-6)


def test_a_release_is_no_turning_point(cycle_runs: dict[float, Trajectory]) -> None:
    """omega_l leaves a stick tangentially: rounding of its rate must not log an extremum."""
    e = cycle_runs[2.0].events.where(Disc.LOWER)
    turns = e.t[(e.kind == Kind.MINIMUM) | (e.kind == Kind.MAXIMUM)]
    release = e.where(kind=Kind.SLIP).t
    assert np.abs(turns[:, None] - release).min() > 1e-6


def test_no_stick_at_the_default_voltage(cycle_runs: dict[float, Trajectory]) -> None:
    lower = cycle_runs[3.5].events.where(Disc.LOWER)
    late = lower.t > 20.0
    assert not (lower.kind[late] == Kind.STICK).any()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10, 1e-12])
def test_all_ten_grazing_contacts(method: Method, rtol: float) -> None:
    """1.8138 V: the cycle touches zero for 2.8 ms once a period."""
    period = 4.104344
    window = (200.0, 200.0 + 10 * period)
    theirs = STORED["graze_events"]
    truth = theirs[(theirs[:, 0] >= window[0]) & (theirs[:, 0] < window[1]) & (theirs[:, 1] == 1)]
    assert (truth[:, 2] == Kind.STICK).sum() == 10
    run = simulate(Rig(), 1.8138, 245.0, rtol=rtol, atol=0.01 * rtol, rate=1.0, method=method)
    ours = contacts(run)
    ours = ours[(ours[:, 0] >= window[0]) & (ours[:, 0] < window[1]) & (ours[:, 1] == 1)]
    assert (ours[:, 1:] == truth[:, 1:]).all()


@pytest.mark.parametrize("volts", [0.09, -0.085, 0.0])
def test_stiction_band_moves_nothing_exactly(volts: float) -> None:
    run = simulate(Rig(), volts, 20.0)
    assert (run.state == 0.0).all() and len(run.events) == 0
    assert run.stuck_u.all() and run.stuck_l.all()


@pytest.mark.parametrize("name", ["random", "both", "stribeck", "coulomb", "clamp"])
def test_mirror(name: str) -> None:
    """Equation (5) mirrored: dTsu and dbu change sign with the voltage and the state."""
    case = CASES[name]
    rig = Rig(**case["par"])
    mirrored = rig.replace(dTsu=-rig.dTsu, dbu=-rig.dbu)
    seconds = min(case["breaks"][-1], 30.0)
    breaks = case["breaks"][case["breaks"] <= seconds]
    volts = case["volts"][: len(breaks) - 1, None]
    start = np.array(case.get("initial", (0.0, 0.0, 0.0, 0.0)))
    one = simulate(rig, Voltage(breaks, volts), seconds, initial=start)
    other = simulate(mirrored, Voltage(breaks, -volts), seconds, initial=-start)
    assert np.abs(one.state + other.state).max() == 0.0
    assert (one.events.t == other.events.t).all()


@pytest.mark.parametrize("name", ["long", "random", "stribeck", "coulomb", "clamp", "both"])
def test_energy_balance(name: str) -> None:
    """Kinetic plus string energy = work of the motor - dissipation, by Gauss quadrature."""
    case = CASES[name]
    rig, seconds = Rig(**case["par"]), min(case["breaks"][-1], 30.0)
    start = np.array(case.get("initial", (0.0, 0.0, 0.0, 0.0)))
    voltage = Voltage(case["breaks"], case["volts"][:, None])
    events = simulate(rig, voltage, seconds, initial=start).events.t
    # The integrand is smooth between events and voltage jumps only.
    grid = np.concatenate([np.linspace(0.0, seconds, round(seconds / 0.05) + 1), events,
                           case["breaks"][case["breaks"] < seconds]])  # fmt: skip
    edges = np.unique(grid)
    nodes, weights = leggauss(6)
    half, middle = 0.5 * np.diff(edges), 0.5 * (edges[1:] + edges[:-1])
    t = (middle[:, None] + half[:, None] * nodes).ravel()
    w = (half[:, None] * weights).ravel()
    run = simulate(rig, voltage, seconds, initial=start, t_eval=t)
    wu, wl = run.omega_u, run.omega_l
    fu = rig.Tsu * np.sign(wu) + rig.dTsu + rig.bu * wu + rig.dbu * np.abs(wu)
    work = w @ (rig.km * run.u * wu)
    loss = w @ (fu * wu + lower_torque_set(rig, wl)[0] * wl)
    if rig.clamp:
        assert (lower_curve(rig, wl) * np.abs(wl) >= 0.0).all()

    def energy(x: np.ndarray) -> float:
        return 0.5 * (rig.Ju * x[1] ** 2 + rig.Jl * x[2] ** 2 + rig.ktheta * x[0] ** 2)

    gain = energy(run.final_state) - energy(start)
    assert gain == pytest.approx(work - loss, abs=1e-8 * (1.0 + float(abs(work))))
