"""The unrolled Runge-Kutta pairs hold SciPy's published coefficients."""

from __future__ import annotations

import numpy as np
from scipy.integrate import DOP853, RK45

from drill_env.integrator import _dop853, _dopri5
from drill_env.integrator._tableau import TABLEAUX


def constants(module: object, name: str, rows: int, columns: int) -> np.ndarray:
    found = np.zeros((rows, columns))
    for i in range(rows):
        for j in range(columns):
            found[i, j] = getattr(module, name.format(i=i, j=j), 0.0)
    return found


def test_dop853() -> None:
    weights = constants(_dop853, "A{i}_{j}", 13, 12)
    np.testing.assert_array_equal(weights[:12], DOP853.A)
    np.testing.assert_array_equal(weights[12], DOP853.B)


def test_dopri5() -> None:
    weights = constants(_dopri5, "A{i}{j}", 6, 5)
    np.testing.assert_allclose(weights, RK45.A, rtol=1e-15)
    last = np.array([getattr(_dopri5, f"B{j}", 0.0) for j in range(6)])
    np.testing.assert_allclose(last, RK45.B, rtol=1e-15)
    error = np.array([getattr(_dopri5, f"E{j}", 0.0) for j in range(7)])
    np.testing.assert_allclose(error, RK45.E, rtol=1e-13)
    dense = constants(_dopri5, "P{i}{j}", 7, 4)
    dense[0, 0] = 1.0
    np.testing.assert_allclose(dense, RK45.P, rtol=1e-15, atol=1e-15)


def test_records_hold_order_conditions() -> None:
    """Independent of SciPy: quadrature conditions sum b c^k = 1/(k+1) up to the order."""
    for name, order in (("dop853", 8), ("dopri5", 5)):
        tab = TABLEAUX[name][0]
        n = int(tab["stages"])
        weights, nodes = tab["a"][n, :n], tab["c"][:n]
        for k in range(order):
            assert abs(weights @ nodes**k - 1.0 / (k + 1)) < 1e-13
