"""The tabulated bend of the friction law against exact decimal arithmetic."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np

from drill_env._jit import entry
from drill_env.friction._tanh_half import tanh_half


@entry
def fill(x, out):
    for i in range(x.size):
        out[i] = tanh_half(x[i])


def tabulated(x: np.ndarray) -> np.ndarray:
    out = np.empty_like(x)
    fill(x, out)
    return out


def exact(x: float) -> Decimal:
    power = (-Decimal(x)).exp()
    return (1 - power) / (1 + power)


def test_every_interval_to_the_last_digit() -> None:
    rng = np.random.default_rng(0)
    # Eight in each interval, its ends among them, and small ones of all sizes.
    ends = (np.arange(620) + 0.5) / 16
    inside = rng.uniform(-0.5, 0.5, (6, 620)) / 16 + np.arange(620) / 16
    x = np.concatenate([ends, np.nextafter(ends, 0.0), np.abs(inside.ravel())])
    x = np.concatenate([x, 10.0 ** rng.uniform(-15.0, 0.0, 500)])
    with localcontext() as context:
        context.prec = 50
        errors = [
            abs(Decimal(float(s)) / exact(float(v)) - 1)
            for v, s in zip(x, tabulated(x), strict=True)
        ]
    assert max(errors) < Decimal("4e-16")


def test_limits_and_signs() -> None:
    x = np.array([0.0, 1e-300, 38.25, 1e300, np.inf])
    np.testing.assert_array_equal(tabulated(x), [0.0, 5e-301, 1.0, 1.0, 1.0])
    x = np.linspace(0.01, 40.0, 997)
    np.testing.assert_array_equal(tabulated(-x), -tabulated(x))


def test_no_jump_where_two_intervals_meet() -> None:
    ends = (np.arange(620) + 0.5) / 16
    below, above = tabulated(np.nextafter(ends, 0.0)), tabulated(np.nextafter(ends, 40.0))
    assert np.abs(above - below).max() < 4e-16
