"""Runge-Kutta coefficients, taken from SciPy's published pairs."""

import numpy as np
from numpy.polynomial import polynomial as poly
from scipy import integrate

from drill_env._types import FloatArray, Method
from drill_env.integrator._records import BS23, DOP853, DOPRI5, MAX_STAGES, TABLEAU


def _dop853_dense() -> FloatArray:
    """SciPy's nested interpolant, expanded to monomials once and for all."""
    n = integrate.DOP853.n_stages
    step = np.zeros(MAX_STAGES)
    step[:n] = integrate.DOP853.B
    start, end = np.zeros(MAX_STAGES), np.zeros(MAX_STAGES)
    start[0] = end[n] = 1.0
    rows = [step, start - step, 2.0 * step - (end + start), *integrate.DOP853.D]
    dense = np.zeros((MAX_STAGES, len(rows)))
    basis = np.array([1.0])
    for i, row in enumerate(rows):
        basis = poly.polymul(basis, [0.0, 1.0] if i % 2 == 0 else [1.0, -1.0])
        dense += np.outer(row, np.pad(basis[1:], (0, len(rows) - len(basis) + 1)))
    return dense


def _dop853() -> np.ndarray:
    n = integrate.DOP853.n_stages
    out = np.zeros(1, dtype=TABLEAU)
    out["pair"], out["stages"], out["extra"] = DOP853, n, 3
    out["order"], out["degree"] = 8, 7
    a = out["a"][0]
    a[:n, :n] = integrate.DOP853.A
    a[n, :n] = integrate.DOP853.B
    a[n + 1 :, :] = integrate.DOP853.A_EXTRA
    out["c"][0] = np.concatenate([integrate.DOP853.C, [1.0], integrate.DOP853.C_EXTRA])
    out["error_high"][0, : n + 1] = integrate.DOP853.E5
    out["error_low"][0, : n + 1] = integrate.DOP853.E3
    out["dense"][0] = _dop853_dense()
    return out


def _short(pair: int, source: type[integrate.RK45] | type[integrate.RK23]) -> np.ndarray:
    n = source.n_stages
    out = np.zeros(1, dtype=TABLEAU)
    out["pair"], out["stages"] = pair, n
    out["order"], out["degree"] = source.order, source.P.shape[1]
    a = out["a"][0]
    a[:n, : source.A.shape[1]] = source.A
    a[n, :n] = source.B
    out["c"][0, : n + 1] = np.concatenate([source.C, [1.0]])
    out["error_high"][0, : n + 1] = source.E
    out["dense"][0, : n + 1, : source.P.shape[1]] = source.P
    return out


TABLEAUX: dict[Method, np.ndarray] = {
    "dop853": _dop853(),
    "dopri5": _short(DOPRI5, integrate.RK45),
}
"""The pairs as records, shape (1,)."""

SHORT_STEP = _short(BS23, integrate.RK23)
"""A pair of order 3, likewise, for steps that are short beside the motion."""
