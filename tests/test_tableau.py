"""The unrolled Runge-Kutta pairs hold SciPy's published coefficients."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import DOP853, RK23, RK45

from drill_env.integrator import _bs23, _dop853, _dopri5
from drill_env.integrator.tableau import tableau


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


@pytest.mark.parametrize(("pair", "source"), [(_dopri5, RK45), (_bs23, RK23)])
def test_short_pairs(pair: object, source: type[RK45] | type[RK23]) -> None:
    n, degree = source.n_stages, source.P.shape[1]
    weights = constants(pair, "A{i}{j}", *source.A.shape)
    np.testing.assert_allclose(weights, source.A, rtol=1e-15)
    last = np.array([getattr(pair, f"B{j}", 0.0) for j in range(n)])
    np.testing.assert_allclose(last, source.B, rtol=1e-15)
    error = np.array([getattr(pair, f"E{j}", 0.0) for j in range(n + 1)])
    np.testing.assert_allclose(error, source.E, rtol=1e-13)
    dense = constants(pair, "P{i}{j}", n + 1, degree)
    dense[0, 0] = 1.0
    np.testing.assert_allclose(dense, source.P, rtol=1e-15, atol=1e-15)


def test_records_hold_order_conditions() -> None:
    """Independent of SciPy: quadrature conditions sum b c^k = 1/(k+1) up to the order."""
    pairs = ((tableau("dop853"), 8), (tableau("dopri5"), 5), (tableau("bs23"), 3))
    for (tab,), order in pairs:
        n = int(tab["stages"])
        weights, nodes = tab["a"][n, :n], tab["c"][:n]
        for k in range(order):
            assert abs(weights @ nodes**k - 1.0 / (k + 1)) < 1e-13
