"""Runge-Kutta coefficients, taken from SciPy's published pairs."""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import polynomial as poly
from scipy.integrate import DOP853, RK45

from drill_env._types import FloatArray, Method


class Tableau(NamedTuple):
    """One explicit pair with dense output.

    Attributes:
        stages: number of stages before the derivative at the step's end.
        extra: stages only the dense output needs.
        order: exponent of the step-size rule.
        a: stage weights, row `stages` holds the solution's, shape (16, 16).
        c: stage times, as shares of the step.
        error_high: weights of the error estimate, one per stage and the end.
        error_low: weights of the second estimate that rescales it (zero if none).
        dense: monomial weights, y(s) = y0 + h * sum_jm dense[j, m] K_j s^(m+1).
    """

    stages: int
    extra: int
    order: int
    a: FloatArray
    c: FloatArray
    error_high: FloatArray
    error_low: FloatArray
    dense: FloatArray


def _dop853_dense() -> FloatArray:
    """SciPy's nested interpolant, expanded to monomials once and for all."""
    n = DOP853.n_stages
    step = np.zeros(16)
    step[:n] = DOP853.B
    start, end = np.zeros(16), np.zeros(16)
    start[0] = end[n] = 1.0
    rows = [step, start - step, 2.0 * step - (end + start), *DOP853.D]
    dense = np.zeros((16, len(rows)))
    basis = np.array([1.0])
    for i, row in enumerate(rows):
        basis = poly.polymul(basis, [0.0, 1.0] if i % 2 == 0 else [1.0, -1.0])
        dense += np.outer(row, np.pad(basis[1:], (0, len(rows) - len(basis) + 1)))
    return dense


def _dop853() -> Tableau:
    n = DOP853.n_stages
    a = np.zeros((16, 16))
    a[:n, :n] = DOP853.A
    a[n, :n] = DOP853.B
    a[n + 1 :, :] = DOP853.A_EXTRA
    c = np.concatenate([DOP853.C, [1.0], DOP853.C_EXTRA])
    e5, e3 = np.array(DOP853.E5), np.array(DOP853.E3)
    return Tableau(n, 3, 8, a, c, e5, e3, _dop853_dense())


def _dopri5() -> Tableau:
    n = RK45.n_stages
    a = np.zeros((16, 16))
    a[:n, : RK45.A.shape[1]] = RK45.A
    a[n, :n] = RK45.B
    c = np.concatenate([RK45.C, [1.0]])
    return Tableau(n, 0, 5, a, c, np.array(RK45.E), np.zeros(n + 1), np.array(RK45.P))


TABLEAUX: dict[Method, Tableau] = {"dop853": _dop853(), "dopri5": _dopri5()}
