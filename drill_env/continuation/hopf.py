"""Hopf points of the turning equilibria, with their first Lyapunov coefficient."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from drill_env._errors import InputError
from drill_env._types import ComplexArray, FloatArray
from drill_env.continuation.equilibria import critical_slope, jacobian, routh_hurwitz, speed_at
from drill_env.dynamics import equilibrium_state, equilibrium_voltage
from drill_env.friction import lower_curve_derivatives, lower_curve_slope
from drill_env.parameters import Rig


@dataclass(frozen=True, slots=True)
class HopfPoint:
    """Where a pair of eigenvalues crosses the imaginary axis.

    Attributes:
        voltage: V.
        omega: speed of both discs, rad/s.
        state: (twist, omega_u, omega_l), shape (3,).
        slope: friction slope d_l there, Nm s/rad.
        frequency: of the oscillation born there, rad/s.
        lyapunov: first Lyapunov coefficient; negative is supercritical (stable cycles).
        crossing: d Re(eigenvalue) / d voltage, 1/(V s).
        mode: complex eigenvector (twist, omega_u, omega_l), omega_l = 1; shape (3,).
    """

    voltage: float
    omega: float
    state: FloatArray
    slope: float
    frequency: float
    lyapunov: float
    crossing: float
    mode: ComplexArray

    @property
    def supercritical(self) -> bool:
        """Whether stable cycles arise."""
        return self.lyapunov < 0.0


def hopf_points(rig: Rig, to_volts: float) -> list[HopfPoint]:
    """All Hopf points with turning discs up to `to_volts`, ordered by speed.

    At a Hopf point T_l' equals the critical slope of Routh and Hurwitz, so the search is
    one for the roots of a function of the speed alone, to rounding.

    Args:
        rig: parameters.
        to_volts: end of the range, V.
    """
    try:
        slope = critical_slope(rig)
    except InputError:
        return []
    if routh_hurwitz(rig, slope)[1] <= 0.0:
        # Two real eigenvalues of equal size: a neutral saddle, not an oscillation.
        return []
    top = speed_at(rig, to_volts)
    grid = np.concatenate([np.geomspace(1e-6, top, 4000), np.linspace(1e-6, top, 4000)])
    grid.sort()
    excess = lower_curve_slope(rig, grid) - slope
    found = []
    for i in np.flatnonzero(excess[:-1] * excess[1:] < 0.0).tolist():
        omega = float(
            brentq(
                lambda w: float(lower_curve_slope(rig, w)) - slope,
                grid[i],
                grid[i + 1],
                xtol=1e-14,
                rtol=8.9e-16,
            )  # fmt: skip
        )
        if float(equilibrium_voltage(rig, omega)) <= to_volts:
            found.append(_hopf_point(rig, omega))
    return found


def _hopf_point(rig: Rig, omega: float) -> HopfPoint:
    matrix = jacobian(rig, omega)
    values, vectors = eigenpairs(matrix)
    i = int(np.argmax(values.imag))
    frequency = float(values[i].imag)
    right = vectors[:, i] / vectors[2, i]
    left_values, left_vectors = eigenpairs(matrix.T)
    left = left_vectors[:, int(np.argmin(np.abs(left_values - values[i].conjugate())))]
    left = left / np.vdot(left, right).conjugate()
    return HopfPoint(
        voltage=float(equilibrium_voltage(rig, omega)),
        omega=omega,
        state=equilibrium_state(rig, omega)[:3],
        slope=float(lower_curve_slope(rig, omega)),
        frequency=frequency,
        lyapunov=_lyapunov(rig, omega, matrix, frequency, right, left),
        crossing=_crossing(rig, omega, right, left),
        mode=right,
    )


def eigenpairs(matrix: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Eigenvalues and eigenvectors, complex whatever the matrix."""
    values, vectors = np.linalg.eig(matrix.astype(np.complex128))
    return np.asarray(values, dtype=np.complex128), np.asarray(vectors, dtype=np.complex128)


def solve_complex(matrix: FloatArray | ComplexArray, right: ComplexArray) -> ComplexArray:
    """The solution of a linear system, complex whatever the matrix."""
    return np.asarray(np.linalg.solve(matrix.astype(np.complex128), right), dtype=np.complex128)


def _lyapunov(
    rig: Rig, omega: float, matrix: FloatArray, frequency: float, q: ComplexArray, p: ComplexArray
) -> float:
    """First Lyapunov coefficient, Kuznetsov's formula, with |q| = 1 and <p, q> = 1.

    The only nonlinearity is T_l in the third equation.
    """
    size = float(np.linalg.norm(q))
    q, p = q / size, p * size
    _, second, third = lower_curve_derivatives(rig, omega)

    def quadratic(x: ComplexArray, y: ComplexArray) -> ComplexArray:
        return np.array([0.0, 0.0, -second * x[2] * y[2] / rig.Jl], dtype=np.complex128)

    cubic = np.array([0.0, 0.0, -third * q[2] * q[2] * q[2].conjugate() / rig.Jl])
    shifted = np.asarray(2j * frequency * np.eye(3) - matrix, dtype=np.complex128)
    mean = solve_complex(matrix, quadratic(q, q.conj()))
    double = solve_complex(shifted, quadratic(q, q))
    total = cubic - 2.0 * quadratic(q, mean) + quadratic(q.conj(), double)
    return float(np.vdot(p, total).real / (2.0 * frequency))


def _crossing(rig: Rig, omega: float, q: ComplexArray, p: ComplexArray) -> float:
    _, second, _ = lower_curve_derivatives(rig, omega)
    slope = float(lower_curve_slope(rig, omega))
    volts_per_omega = (rig.bu + rig.dbu + slope) / rig.km
    change = p[2].conjugate() * (-second / rig.Jl) * q[2]
    return float(change.real / volts_per_omega)
