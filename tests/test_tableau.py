"""The unrolled Runge-Kutta pairs hold SciPy's published coefficients."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import DOP853, RK23, RK45

from drill_env._jit import entry
from drill_env.integrator.prepared import Prepared
from drill_env.integrator.records import RUN, new_work
from drill_env.integrator.signatures import call_fill, call_step
from drill_env.integrator.tableau import tableau
from drill_env.parameters import Rig


@entry
def take_step(p, run, work, tab, h):
    error = call_step(tab.step, p, run, work, tab, h)
    call_fill(tab.fill, p, run, work, tab, h)
    return error


def stepped(name: str) -> tuple[float, np.void, float]:
    """Error of one step, its working arrays, and its length."""
    prepared, work, run = Prepared(Rig(), name), new_work(1e-9, 1e-11), np.zeros(1, dtype=RUN)
    run["mode"], work["coefficients"], work["piece"], h = (1, 1, 0), 1, 3.5, 0.05
    work["ys"][0, 0, :4], work["k"][0, 0, :4] = (3.0, 2.5, 0.4, 1.0), (2.1, 0.3, -4.0, 0.4)
    return take_step(prepared.p[0], run[0], work[0], prepared.pair[0], h), work[0], h


@pytest.mark.parametrize(("name", "source"), [("dop853", DOP853), ("dopri5", RK45), ("bs23", RK23)])
def test_unrolled_stages(name: str, source: type[DOP853] | type[RK45] | type[RK23]) -> None:
    """Each stage is the one that the published coefficients make of the rates before it."""
    _, work, h = stepped(name)
    n = source.n_stages
    states, rates = work["ys"], work["k"]
    for i, row in enumerate([*source.A[1:, :], source.B], start=1):
        used = row[:i]
        np.testing.assert_allclose(
            states[i, :3], states[0, :3] + h * used @ rates[:i, :3], rtol=1e-14, err_msg=str(i)
        )
    assert states[n, 3] == pytest.approx(states[0, 3] + h * source.B @ rates[:n, 3], rel=1e-14)


@pytest.mark.parametrize(("name", "source"), [("dopri5", RK45), ("bs23", RK23)])
def test_error_and_dense_output(name: str, source: type[RK45] | type[RK23]) -> None:
    """Of the short pairs: they are what the published coefficients make of the rates."""
    error, work, h = stepped(name)
    n, degree = source.n_stages, source.P.shape[1]
    rates, states = work["k"][: n + 1], work["ys"]
    scale = work["atol"] + work["rtol"] * np.maximum(np.abs(states[0]), np.abs(states[n]))[:3]
    expected = h * (source.E @ rates)[:3] / scale
    assert error == pytest.approx(np.sqrt(np.mean(expected**2)), rel=1e-10)
    np.testing.assert_allclose(work["dense"][:, :degree], h * (rates.T @ source.P), rtol=1e-11)


def test_records_hold_order_conditions() -> None:
    """Independent of SciPy: quadrature conditions sum b c^k = 1/(k+1) up to the order."""
    pairs = ((tableau("dop853"), 8), (tableau("dopri5"), 5), (tableau("bs23"), 3))
    for (tab,), order in pairs:
        n = int(tab["stages"])
        weights, nodes = tab["a"][n, :n], tab["c"][:n]
        for k in range(order):
            assert abs(weights @ nodes**k - 1.0 / (k + 1)) < 1e-13
