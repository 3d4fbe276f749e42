"""Compiled tanh(x / 2), the bend of the humped friction law, from a table.

A stage of the integrator waits for its friction law. The powers of a polynomial are taken side by
side (Estrin's scheme), which is done in half the time of an exponential and a division.
"""

from __future__ import annotations

from math import copysign

import numpy as np
from numpy.polynomial import chebyshev

from drill_env._intrinsics import bits_of, fma
from drill_env._jit import inlined
from drill_env._types import FloatArray

# Intervals of 1/16 about multiples of it: a polynomial of degree 7 then errs by 1e-17 of the value,
# since the nearest singularities lie at +-i pi.
_PER_ONE, _DEGREE = 16, 7
# From here on it is 1 to the last digit: 1 - tanh(x / 2) < 2 exp(-x) < 2^-54.
_TOP = 38.25
# The sum with this is rounded to multiples of 1/16, and counts them in its last bits.
_COUNTING = 1.5 * 2.0**52 / _PER_ONE
_COUNT = 0xFFFF
# Of the Taylor series at a centre before its last terms are spread over the lower ones.
_TERMS = 12


def _table() -> FloatArray:
    """Coefficients of the powers of x less the centre, shape (n, 8)."""
    # Digits beyond those of a double where the machine has them.
    centres = np.arange(int(_TOP * _PER_ONE) + 1).astype(np.longdouble) / _PER_ONE
    series = np.zeros((_TERMS, centres.size), dtype=np.longdouble)
    series[0] = np.tanh(centres / 2)
    for k in range(_TERMS - 1):
        # s' = (1 - s^2) / 2.
        square = (series[: k + 1] * series[k::-1]).sum(axis=0)
        series[k + 1] = ((k == 0) - square) / (2 * (k + 1))
    width = (np.longdouble(0.5) / _PER_ONE) ** np.arange(_TERMS)[:, None]
    series *= width
    for k in range(_TERMS - 1, _DEGREE, -1):
        # Lanczos' economisation: the Chebyshev polynomial is what the power costs least without.
        shape = chebyshev.cheb2poly([0.0] * k + [1.0])[:, None]
        series[: k + 1] -= series[k] / shape[k] * shape
    return np.ascontiguousarray((series / width)[: _DEGREE + 1].T, dtype=float)


_TABLE = _table()


@inlined
def tanh_half(x):
    """tanh(x / 2), with an error of at most 4e-16 of it."""
    size = abs(x)
    # In this order a NaN finds an entry too; the speed itself carries it on.
    size = size if size < _TOP else _TOP
    counted = size + _COUNTING
    c = _TABLE[bits_of(counted) & _COUNT]
    d = size - (counted - _COUNTING)
    d2 = d * d
    low = fma(fma(c[3], d, c[2]), d2, fma(c[1], d, c[0]))
    high = fma(fma(c[7], d, c[6]), d2, fma(c[5], d, c[4]))
    return copysign(fma(high, d2 * d2, low), x)
