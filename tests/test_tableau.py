"""The unrolled Runge-Kutta pairs hold SciPy's published coefficients."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import DOP853, RK23, RK45

from drill_env._jit import entry
from drill_env.integrator import _bs23, _dopri5
from drill_env.integrator.prepared import Prepared
from drill_env.integrator.records import RUN, new_work
from drill_env.integrator.signatures import call_step
from drill_env.integrator.tableau import tableau
from drill_env.parameters import Rig


def constants(module: object, name: str, rows: int, columns: int) -> np.ndarray:
    found = np.zeros((rows, columns))
    for i in range(rows):
        for j in range(columns):
            found[i, j] = getattr(module, name.format(i=i, j=j), 0.0)
    return found


@entry
def take_step(p, run, work, tab, h):
    call_step(tab.step, p, run, work, tab, h)


@pytest.mark.parametrize(("name", "source"), [("dop853", DOP853), ("dopri5", RK45), ("bs23", RK23)])
def test_unrolled_stages(name: str, source: type[DOP853] | type[RK45] | type[RK23]) -> None:
    """Each stage is the one that the published coefficients make of the rates before it."""
    prepared, work, run = Prepared(Rig(), name), new_work(1e-9, 1e-11), np.zeros(1, dtype=RUN)
    run["mode"], work["coefficients"], work["piece"], h, n = (
        (1, 1, 0),
        1,
        3.5,
        0.05,
        source.n_stages,
    )
    work["ys"][0, 0], work["k"][0, 0] = (3.0, 2.5, 0.4, 1.0), (2.1, 0.3, -4.0, 0.4)
    take_step(prepared.p[0], run[0], work[0], prepared.pair[0], h)
    states, rates = work["ys"][0], work["k"][0]
    for i, row in enumerate([*source.A[1:, :], source.B], start=1):
        used = row[:i]
        np.testing.assert_allclose(
            states[i, :3], states[0, :3] + h * used @ rates[:i, :3], rtol=1e-14, err_msg=str(i)
        )
    assert states[n, 3] == pytest.approx(states[0, 3] + h * source.B @ rates[:n, 3], rel=1e-14)


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
