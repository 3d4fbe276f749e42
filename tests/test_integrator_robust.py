"""Property tests: any rig, any voltage, any start; the integrator neither hangs nor lies."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drill_env._types import FrictionLaw
from drill_env.friction import lower_torque_set
from drill_env.integrator import Disc, Kind, Trajectory, Voltage, sampled_voltage, simulate
from drill_env.parameters import Rig

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")

SECONDS = 2.0
# The stiffest rigs below (T1 beta1 / Jl near 1e6 1/s) need a few million explicit steps.
BUDGET = 20.0
COMMON = settings(
    max_examples=120, deadline=None, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)  # fmt: skip


def logarithmic(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(np.log10(low), np.log10(high)).map(lambda x: float(10.0**x))


@st.composite
def rigs(draw: st.DrawFn, stiff: bool = True) -> Rig:
    law = draw(st.sampled_from(get_args(FrictionLaw)))
    static_u = draw(st.one_of(st.just(0.0), logarithmic(1e-3, 3.0)))
    static_l = draw(st.one_of(st.just(0.0), logarithmic(1e-4, 1.0)))
    viscous = draw(st.one_of(st.just(0.0), logarithmic(1e-2, 5.0)))
    t1 = -static_l * draw(st.floats(0.0, 1.0)) if law == "stribeck" else None
    slopes = [0.0, 1.0, 6.3598, 100.0] + ([1e3, 1e4] if stiff else [])
    return Rig(
        km=draw(logarithmic(0.3, 10.0)),
        Ju=draw(logarithmic(0.01, 10.0)),
        Jl=draw(logarithmic(1e-3 if stiff else 1e-2, 1.0)),
        ktheta=draw(logarithmic(0.01, 10.0)),
        Tsu=static_u,
        dTsu=static_u * draw(st.sampled_from([0.0, 0.03, -0.5, 1.0, -1.0])),
        bu=viscous,
        dbu=viscous * draw(st.sampled_from([0.0, 0.3, -0.9])),
        Tsl=static_l,
        T1=draw(st.sampled_from([0.0826, -0.1, 0.0, 0.3])) if t1 is None else t1,
        T2=draw(st.sampled_from([-0.291, 0.0, 0.2])),
        beta1=draw(st.sampled_from(slopes)),
        beta2=draw(st.sampled_from([0.0, 0.0768, 3.0])),
        bl=draw(st.sampled_from([0.0, 0.0042, 0.1])),
        friction=law,
        clamp=draw(st.booleans()),
    )  # fmt: skip


@st.composite
def voltages(draw: st.DrawFn) -> Callable[[Rig], Any]:
    """A voltage, given the rig whose stiction band it may aim at."""
    kind = draw(st.sampled_from(["constant", "edge", "steps", "chatter", "sine", "graze"]))
    seed = draw(st.integers(0, 2**32 - 1))
    level = draw(st.sampled_from([0.0, 0.02, 0.09, 1.0, 5.0]))

    def build(rig: Rig) -> Any:
        rng = np.random.default_rng(seed)
        edge = (rig.Tsu + rig.dTsu) / rig.km
        if kind == "constant":
            return level
        if kind == "edge":
            return float(edge)
        if kind == "steps":
            n = 40
            volts = rng.uniform(-5.0, 5.0, n) * rng.choice([0.0, 0.02, 1.0], n)
            # Starts and ends inside the band.
            volts[0] = volts[-1] = 0.5 * edge
            return sampled_voltage(np.arange(n) * SECONDS / n, volts, SECONDS)
        if kind == "chatter":
            n = 2000
            volts = np.where(np.arange(n) % 2, level, -level)
            return sampled_voltage(np.arange(n) * SECONDS / n, volts, SECONDS)
        if kind == "sine":
            return lambda t: level * np.sin(20.0 * t) ** 3
        return lambda t: edge + 1e-3 * np.sin(7.0 * t)

    return build


STARTS = st.lists(
    st.one_of(st.just(0.0), st.sampled_from([1e-300, -1e-12, 1e-9]), st.floats(-8.0, 8.0)),
    min_size=4, max_size=4,
).map(np.array)  # fmt: skip


def check(rig: Rig, run: Trajectory) -> None:
    """What every run must satisfy."""
    assert np.isfinite(run.state).all() and np.isfinite(run.events.state).all()
    assert (run.omega_u[run.stuck_u] == 0.0).all() and (run.omega_l[run.stuck_l] == 0.0).all()
    # Stuck means that stiction can hold the disc, to rounding and root-finding accuracy.
    torque_u = rig.km * run.u - rig.ktheta * run.twist - rig.dTsu
    slack = 1e-9 * (1.0 + np.abs(torque_u) + rig.ktheta * np.abs(run.twist))
    jump = np.isin(run.t, run.voltage.breaks)
    held = run.stuck_u & ~jump
    assert (np.abs(torque_u) <= rig.Tsu + slack)[held].all()
    assert (rig.ktheta * np.abs(run.twist) <= rig.Tsl + slack)[run.stuck_l].all()
    assert (np.diff(run.events.t) >= 0.0).all()


@COMMON
@given(rigs(), voltages(), STARTS)
def test_never_hangs_and_never_lies(rig: Rig, drive: Any, start: np.ndarray) -> None:
    began = time.monotonic()
    run = simulate(rig, drive(rig), SECONDS, initial=start, rate=500.0)
    assert time.monotonic() - began < BUDGET
    check(rig, run)


@COMMON
@given(rigs(stiff=False), voltages(), STARTS)
def test_continuous_at_events_and_dissipative(rig: Rig, drive: Any, start: np.ndarray) -> None:
    voltage = drive(rig)
    events = simulate(rig, voltage, SECONDS, initial=start).events
    if len(events):
        gap = 1e-7
        at = np.unique(np.clip(np.concatenate([events.t - gap, events.t + gap]), 0.0, SECONDS))
        run = simulate(rig, voltage, SECONDS, initial=start, t_eval=at)
        before = run.state[np.searchsorted(at, np.maximum(events.t - gap, 0.0))]
        after = run.state[np.searchsorted(at, np.minimum(events.t + gap, SECONDS))]
        torque = rig.km * 5.0 + rig.ktheta * np.abs(run.twist).max() + 5.0 * (rig.Tsu + rig.bu)
        rate = np.abs(run.state).max() * 20.0 + torque * (1.0 / rig.Ju + 1.0 / rig.Jl)
        assert np.abs(after - before).max() <= 2.0 * gap * (1e3 + 10.0 * rate)
        slipping = (events.disc == Disc.LOWER) & (events.kind <= Kind.REVERSAL)
        assert (events.state[slipping, 2] == 0.0).all()
    if rig.clamp:
        run = simulate(rig, voltage, SECONDS, initial=start)
        assert (lower_torque_set(rig, run.omega_l)[0] * run.omega_l >= 0.0).all()


def separated(run: Trajectory) -> bool:
    """Whether no contact is so near a graze that rounding may decide its outcome."""
    e = run.events
    return len(e) < 2 or bool(np.diff(e.t).min() > 1e-5)


def contacts(run: Trajectory) -> int:
    """Mode changes of the discs; a clamp switch at zero speed may or may not be logged."""
    return int((run.events.disc != Disc.LOWER_LAW).sum())


def coarse(rig: Rig, run: Trajectory, other: Trajectory) -> float:
    """Largest difference in units of the state's size."""
    return float(np.abs(run.final_state - other.final_state).max()
                 / (1.0 + np.abs(run.state).max()))  # fmt: skip


@COMMON
@given(rigs(stiff=False), voltages(), STARTS, st.floats(0.05, 0.95))
def test_two_halves_are_one_run(rig: Rig, drive: Any, start: np.ndarray, share: float) -> None:
    voltage, split = drive(rig), share * SECONDS
    whole = simulate(rig, voltage, SECONDS, initial=start)
    if not isinstance(voltage, float):
        # One and the same piecewise polynomial for all three runs.
        voltage = whole.voltage
    first = simulate(rig, voltage, split, initial=start)
    second = simulate(
        rig, voltage, SECONDS - split, t_start=split,
        initial=first.final_state, modes=first.final_modes,
    )  # fmt: skip
    if separated(whole):
        assert coarse(rig, whole, second) < 1e-6
        # Contacts of a motion below the absolute tolerance may be counted either way.
        if np.abs(whole.state[:, :3]).max() > 1e-9:
            assert contacts(first) + contacts(second) == contacts(whole)


@COMMON
@given(rigs(stiff=False), voltages(), STARTS)
def test_sampling_changes_nothing(rig: Rig, drive: Any, start: np.ndarray) -> None:
    sparse = simulate(rig, drive(rig), SECONDS, initial=start, rate=1.0)
    dense = simulate(rig, drive(rig), SECONDS, initial=start, rate=5000.0)
    assert (sparse.final_state == dense.final_state).all()
    assert (sparse.events.t == dense.events.t).all()


@COMMON
@given(rigs(stiff=False), voltages(), STARTS)
def test_both_methods_agree(rig: Rig, drive: Any, start: np.ndarray) -> None:
    one = simulate(rig, drive(rig), SECONDS, initial=start)
    other = simulate(rig, drive(rig), SECONDS, initial=start, method="dopri5")
    if separated(one) and separated(other):
        assert coarse(rig, one, other) < 1e-6


def test_both_discs_reach_zero_together() -> None:
    """Two equal, decoupled-by-symmetry discs stop at the same instant."""
    rig = Rig(Ju=0.05, Jl=0.05, Tsu=0.1, dTsu=0.0, bu=0.02, dbu=0.0, Tsl=0.1, bl=0.02,
              friction="coulomb")  # fmt: skip
    run = simulate(rig, 0.0, 5.0, initial=np.array([0.0, 2.0, 2.0, 0.0]))
    assert (run.final_state[:3] == 0.0).all()
    assert sorted(run.events.disc) == [Disc.UPPER, Disc.LOWER]
    assert np.ptp(run.events.t) < 1e-12


@pytest.mark.parametrize("hertz", [20.0, 50.0, 1000.0])
def test_chatter_voltage_equals_a_finer_hold_of_itself(hertz: float) -> None:
    """A square wave around zero: splitting every hold in three must change nothing."""
    n = round(10.0 * hertz)
    volts = np.where(np.arange(n) % 2, 4.0, -4.0)
    one = simulate(Rig(), Voltage(np.arange(n + 1) / hertz, volts[:, None]), 10.0)
    breaks = np.linspace(0.0, n / hertz, 3 * n + 1)
    other = simulate(Rig(), Voltage(breaks, np.repeat(volts, 3)[:, None]), 10.0)
    assert np.abs(one.final_state - other.final_state).max() < 1e-8
