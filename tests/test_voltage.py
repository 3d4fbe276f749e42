"""Voltages: every accepted form against its own definition and against each other."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import InputError, Rig
from drill_env.integrator import (
    as_voltage,
    constant_voltage,
    function_voltage,
    sampled_voltage,
    simulate,
)

T = np.linspace(0.0, 10.0, 4001)[:-1]


def test_functions_are_followed_to_rounding() -> None:
    def volts(t: float) -> float:
        return 2.0 + np.sin(3.0 * t) * np.exp(-0.1 * t)

    drive = function_voltage(volts, 0.0, 10.0)
    np.testing.assert_allclose(drive(T), [volts(t) for t in T], atol=1e-10)
    assert len(drive.pieces) < 200


def test_jumps_of_a_function_are_found() -> None:
    drive = function_voltage(lambda t: 3.0 if t < 4.321 else -1.0, 0.0, 10.0)
    assert drive(4.321 - 1e-8) == pytest.approx(3.0)
    assert drive(4.321 + 1e-8) == pytest.approx(-1.0)
    exact = sampled_voltage(np.array([0.0, 4.321]), np.array([3.0, -1.0]), t_end=10.0)
    a, b = simulate(Rig(), drive, 10.0), simulate(Rig(), exact, 10.0)
    assert np.abs(a.state - b.state).max() < 1e-7


def test_noise_is_refused_instead_of_refined_for_ever() -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(InputError, match="too rough"):
        function_voltage(lambda _: float(rng.normal()), 0.0, 1.0)


def test_hold_keeps_each_value_until_the_next() -> None:
    drive = sampled_voltage(np.array([0.0, 1.0, 1.5]), np.array([1.0, 1.0, 2.0]))
    assert drive.breaks.tolist() == [0.0, 1.5, 2.25]
    assert drive(np.array([0.0, 0.99, 1.49, 1.5, 2.2])).tolist() == [1.0, 1.0, 1.0, 2.0, 2.0]


def test_part_of_a_voltage_is_that_voltage() -> None:
    whole = function_voltage(np.sin, 0.0, 10.0)
    part = as_voltage(whole, 2.3, 7.7)
    inner = T[(T > 2.3) & (T < 7.7)]
    np.testing.assert_allclose(part(inner), np.sin(inner), atol=1e-10)
    with pytest.raises(InputError, match="covers 0 to 10"):
        as_voltage(whole, 2.0, 11.0)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: constant_voltage(float("nan"), 0.0, 1.0), "finite"),
        (lambda: sampled_voltage(np.array([0.0, 0.0]), np.array([1.0, 2.0])), "ascend"),
        (lambda: sampled_voltage(np.arange(3.0), np.array([1.0, np.nan, 2.0])), "NaN"),
        (lambda: sampled_voltage(np.arange(5.0), np.arange(3.0)), "shape"),
        (lambda: function_voltage(lambda _: float("inf"), 0.0, 1.0), "finite"),
    ],
)
def test_bad_voltages_name_the_remedy(make: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make()  # pyright: ignore


def test_one_inertia_never_moves_its_lower_disc() -> None:
    rig = Rig.one_inertia(km=3.5, Ju=0.48, Tsu=0.3, bu=2.0)
    run = simulate(rig, 3.0, 5.0, initial=np.array([1.0, 0.5, 2.0, 0.0]))
    assert (run.omega_l == 0.0).all() and (run.theta_l == 0.0).all()
    # First-order response of one inertia under viscous and Coulomb friction.
    final = (3.5 * 3.0 - 0.3) / 2.0
    expected = final + (0.5 - final) * np.exp(-2.0 / 0.48 * run.t)
    np.testing.assert_allclose(run.omega_u, expected, atol=1e-9)
    with pytest.raises(InputError, match="one_inertia"):
        Rig(inertias=1)
