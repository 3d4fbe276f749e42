"""Sensitivities with saltation against central finite differences.

The runs go through stick, break-away and reversal of both discs. With step e a central
difference errs by e^2 f'''/6 + d/e, d being the integrator's own error (about 1e-11 at
rtol 1e-12): at e = 1e-5 of a parameter's size both terms are near 1e-6 of the largest
entry of a column, which is the tolerance.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drill_env._types import FloatArray
from drill_env.integrator import Disc, Kind, Voltage, sampled_voltage, simulate
from drill_env.parameters import SYMBOLS, Rig

TIGHT: dict[str, Any] = {"rtol": 1e-12, "atol": 1e-14}
SWINGING = np.array([2.0, 1.0, 6.0, 0.5])
ON_THE_CYCLE = np.array([-3.39, 6.27, 10.18, 0.5])


def steps(seed: int = 3, hold: float = 0.5, seconds: float = 12.0) -> Voltage:
    n = round(seconds / hold)
    volts = np.random.default_rng(seed).uniform(-5.0, 5.0, n)
    volts[n // 2 : n // 2 + 3] = 0.05
    return sampled_voltage(np.linspace(0.0, seconds - hold, n), volts, seconds)


STRIBECK = Rig(friction="stribeck", Tsl=0.09, T1=-0.06, beta1=1.5)
RUNS: dict[str, tuple[Rig, Any, float, set[tuple[Disc, Kind]]]] = {
    "sticks": (Rig(), 2.0, 30.0, {(Disc.LOWER, Kind.STICK), (Disc.LOWER, Kind.SLIP)}),
    "reversals": (Rig(), 3.5, 12.0, {(Disc.LOWER, Kind.REVERSAL)}),
    "both discs": (
        Rig(), steps(), 12.0,
        {(Disc.UPPER, Kind.REVERSAL), (Disc.UPPER, Kind.STICK), (Disc.LOWER, Kind.REVERSAL)},
    ),
    "smooth": (
        Rig(), lambda t: 0.5 * np.sin(0.7 * t), 12.0,
        {(Disc.UPPER, Kind.STICK), (Disc.UPPER, Kind.SLIP)},
    ),
    "stribeck": (STRIBECK, 1.0, 12.0, {(Disc.LOWER, Kind.STICK)}),
    "coulomb": (Rig(friction="coulomb", Tsl=0.3), 1.0, 12.0, {(Disc.LOWER, Kind.STICK)}),
    "clamp": (Rig(clamp=True), 5.0, 20.0, {(Disc.LOWER_LAW, Kind.CLAMP)}),
}  # fmt: skip


def differences(rig: Rig, drive: Any, start: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Central differences of the sampled states, columns ordered as the sensitivities'."""

    def states(changed: Rig, initial: np.ndarray) -> np.ndarray:
        return simulate(changed, drive, t[-1], t_eval=t, initial=initial, **TIGHT).state

    columns = []
    for i in range(4):
        step = np.zeros(4)
        step[i] = 1e-5
        columns.append((states(rig, start + step) - states(rig, start - step)) / 2e-5)
    for name in SYMBOLS:
        value = getattr(rig, name)

        def slope(e: float, name: str = name, value: float = value) -> FloatArray:
            up, down = rig.replace(**{name: value + e}), rig.replace(**{name: value - e})
            return (states(up, start) - states(down, start)) / (2.0 * e)

        # Richardson, so that the step may be long: rounding of the states, over the step, is what
        # limits these differences.
        e = 4e-5 * max(abs(value), 0.01)
        columns.append((4.0 * slope(e) - slope(2.0 * e)) / 3.0)
    return np.stack(columns, axis=-1)


@pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")
@pytest.mark.parametrize("method", ["dop853", "dopri5"])
@pytest.mark.parametrize("name", list(RUNS))
def test_every_column_matches_finite_differences(name: str, method: Any) -> None:
    rig, drive, seconds, wanted = RUNS[name]
    t = np.linspace(0.0, seconds, 41)
    start = ON_THE_CYCLE if name == "reversals" else SWINGING
    run = simulate(
        rig, drive, seconds, t_eval=t, initial=start, sensitivity=True, method=method, **TIGHT
    )
    seen = {(Disc(d), Kind(k)) for d, k in zip(run.events.disc, run.events.kind, strict=True)}
    assert wanted <= seen
    found = differences(rig, drive, start, t)
    # A sample within the shift of an event mixes both sides of the jump: leave it out.
    clear = np.array([np.abs(run.events.t - s).min() > 2e-3 for s in t])
    size = np.maximum(np.abs(found).max(axis=(0, 1)), 1e-3)
    miss = np.abs(run.sensitivity - found)[clear].max(axis=(0, 1)) / size
    assert miss.max() < 2e-6, dict(zip(("x", "wu", "wl", "th", *SYMBOLS), miss, strict=True))


def test_trajectory_is_the_same_with_sensitivities() -> None:
    t = np.linspace(0.0, 20.0, 101)
    plain = simulate(Rig(), 3.5, 20.0, t_eval=t)
    with_them = simulate(Rig(), 3.5, 20.0, t_eval=t, sensitivity=True)
    assert np.abs(plain.state - with_them.state).max() < 1e-8


def test_stick_forgets_the_velocity() -> None:
    """Row of a stuck disc's velocity is exactly zero: finite-time merging."""
    run = simulate(
        Rig(), 2.0, 30.0, rate=2000.0, initial=np.array([2.0, 1.0, 6.0, 0.0]), sensitivity=True
    )
    held = run.stuck_l
    assert held.sum() > 20
    assert (run.sensitivity[held, 2, :] == 0.0).all()


def test_unused_parameters_have_no_effect() -> None:
    run = simulate(STRIBECK, 1.0, 5.0, initial=SWINGING, sensitivity=True)
    for name in ("T2", "beta2"):
        assert (run.sensitivity[:, :, 4 + SYMBOLS.index(name)] == 0.0).all()


def test_repeated_sample_times_get_the_same_sensitivity() -> None:
    run = simulate(Rig(), 3.5, 2.0, t_eval=np.array([0.5, 0.5, 2.0, 2.0]), sensitivity=True)
    assert (run.sensitivity[0] == run.sensitivity[1]).all()
    assert (run.sensitivity[2] == run.sensitivity[3]).all()


def test_a_disc_stuck_at_the_start_forgets_its_initial_velocity() -> None:
    """A stuck disc shrugs a small push off, so d/d(omega_l0) is zero from rest."""
    t = np.array([0.1, 0.3, 2.0])
    run = simulate(Rig(), 3.5, 2.0, t_eval=t, sensitivity=True)
    push = np.array([0.0, 0.0, 1e-7, 0.0])
    pushed = simulate(Rig(), 3.5, 2.0, t_eval=t, initial=push)
    plain = simulate(Rig(), 3.5, 2.0, t_eval=t)
    assert np.abs(pushed.state - plain.state).max() < 1e-10
    assert np.abs(run.sensitivity[:, :, 2]).max() < 1e-3
