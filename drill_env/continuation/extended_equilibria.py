"""Turning equilibria and Hopf points of a rig with effects, by differences of its rates."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from drill_env._errors import InputError
from drill_env._types import ComplexArray, FloatArray
from drill_env.continuation.equilibria import EquilibriumBranch
from drill_env.continuation.hopf import HopfPoint, eigenpairs, solve_complex
from drill_env.dynamics import equilibrium_voltage
from drill_env.effects.steady import cornered, steady_torques
from drill_env.friction import lower_curve
from drill_env.parameters import Rig

_NEWTON, _CLOSED = 40, 1e-11
# Of central differences: first derivatives, and second and third ones along a unit vector.
_STEP, _CURVED = 1e-6, 3e-3


def rates(rig: Rig, volts: FloatArray, states: FloatArray) -> FloatArray:
    """Rates of (twist, omega_u, omega_l), equation (4) with effects, both discs turning forward.

    Args:
        rig: parameters and effects.
        volts: V, shape (n,).
        states: twist (rad), omega_u, omega_l (rad/s) > 0, shape (n, 3).

    Returns:
        Shape (n, 3).
    """
    twist, upper, lower = states.T
    torques = steady_torques(rig, volts, states)
    friction = rig.Tsu + rig.dTsu + (rig.bu + rig.dbu) * upper
    pull = rig.ktheta * twist
    return np.column_stack(
        [
            upper - lower,
            (rig.km * volts - pull - friction + torques[:, 0]) / rig.Ju,
            (pull - lower_curve(rig, lower) + torques[:, 1]) / rig.Jl,
        ]
    )


def equilibria(rig: Rig, omega: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Voltages and twists at which both discs turn at given speeds.

    Args:
        rig: parameters and effects.
        omega: rad/s > 0, shape (n,).

    Returns:
        V and rad, each of shape (n,); NaN where no voltage keeps the speed.
    """
    volts = np.array(equilibrium_voltage(rig, omega), dtype=np.float64)
    twist = np.asarray(lower_curve(rig, omega), dtype=float) / rig.ktheta
    sizes = np.array([1.0 / rig.Ju, 1.0 / rig.Jl])
    gap = np.full((len(omega), 2), np.inf)
    for _ in range(_NEWTON):
        gap = _unbalance(rig, volts, twist, omega) / sizes
        by_volts = (_unbalance(rig, volts + _STEP, twist, omega) / sizes - gap) / _STEP
        by_twist = (_unbalance(rig, volts, twist + _STEP, omega) / sizes - gap) / _STEP
        matrices = np.stack([by_volts, by_twist], axis=2)
        singular = np.abs(np.linalg.det(matrices)) < 1e-14
        matrices[singular] = np.eye(2)
        move = np.linalg.solve(matrices, gap[:, :, np.newaxis])[:, :, 0]
        move[singular] = 0.0
        volts = np.asarray(volts - move[:, 0], dtype=np.float64)
        twist = np.asarray(twist - move[:, 1], dtype=np.float64)
        if np.abs(gap[~singular]).max(initial=0.0) < _CLOSED:
            break
    lost = np.abs(gap).max(axis=1) > 1e-8
    return np.where(lost, np.nan, volts), np.where(lost, np.nan, twist)


def _unbalance(rig: Rig, volts: FloatArray, twist: FloatArray, omega: FloatArray) -> FloatArray:
    return rates(rig, volts, np.column_stack([twist, omega, omega]))[:, 1:]


def jacobians(rig: Rig, volts: FloatArray, states: FloatArray) -> FloatArray:
    """Linearisations around states, shape (n, 3, 3)."""
    columns = []
    for i in range(3):
        step = _STEP * np.eye(3)[i]
        ahead, behind = rates(rig, volts, states + step), rates(rig, volts, states - step)
        columns.append((ahead - behind) / (2.0 * _STEP))
    return np.stack(columns, axis=2)


def extended_branch(rig: Rig, omega: FloatArray) -> EquilibriumBranch:
    """The turning equilibria of a rig with effects at the speeds that a voltage keeps.

    Args:
        rig: parameters and effects, none of which `drill_env.effects.steady.unsteady` names.
        omega: rad/s, greater than the step of the differences, ascending, shape (n,).
    """
    volts, twist = equilibria(rig, omega)
    kept = np.isfinite(volts)
    volts, twist, omega = volts[kept], twist[kept], omega[kept]
    matrices = jacobians(rig, volts, np.column_stack([twist, omega, omega]))
    eigenvalues = np.asarray(np.linalg.eigvals(matrices), dtype=np.complex128)
    stable = np.asarray((eigenvalues.real < 0.0).all(axis=1))
    return EquilibriumBranch(volts, omega, twist, -rig.Jl * matrices[:, 2, 2], eigenvalues, stable)


def extended_hopf_points(rig: Rig, branch: EquilibriumBranch, to_volts: float) -> list[HopfPoint]:
    """Hopf points of a branch up to `to_volts`, ordered by speed.

    The first Lyapunov coefficient follows from differences too; it is NaN where an effect is a
    table, which has corners.
    """
    margins = np.array([_margin(rig, w) for w in branch.omega.tolist()])
    found = []
    for i in np.flatnonzero(margins[:-1] * margins[1:] < 0.0).tolist():
        low, high = float(branch.omega[i]), float(branch.omega[i + 1])
        omega = float(brentq(lambda w: _margin(rig, w), low, high, xtol=1e-12, rtol=1e-14))
        matrix, volts, _ = _at(rig, omega)
        # Two real eigenvalues of equal size are a neutral saddle, not an oscillation.
        if volts <= to_volts and _polynomial(matrix)[1] > 0.0:
            found.append(_hopf_point(rig, omega))
    return found


def _at(rig: Rig, omega: float) -> tuple[FloatArray, float, FloatArray]:
    """Linearisation, voltage and state of the equilibrium at a speed.

    Raises:
        InputError: no voltage keeps the speed.
    """
    volts, twist = equilibria(rig, np.array([omega]))
    if not np.isfinite(volts[0]):
        raise InputError(f"no voltage keeps {omega:.4g} rad/s: an effect takes what is asked for")
    state = np.array([twist[0], omega, omega])
    return jacobians(rig, volts, state[np.newaxis])[0], float(volts[0]), state


def _polynomial(matrix: FloatArray) -> tuple[float, float, float]:
    """a2, a1, a0 of the characteristic polynomial."""
    trace = float(np.trace(matrix))
    minors = 0.5 * (trace**2 - float(np.trace(matrix @ matrix)))
    return -trace, minors, -float(np.linalg.det(matrix))


def _margin(rig: Rig, omega: float) -> float:
    """a2 a1 - a0, which changes sign where a pair of eigenvalues crosses the imaginary axis."""
    a2, a1, a0 = _polynomial(_at(rig, omega)[0])
    return a2 * a1 - a0


def _hopf_point(rig: Rig, omega: float) -> HopfPoint:
    matrix, volts, state = _at(rig, omega)
    values, vectors = eigenpairs(matrix)
    i = int(np.argmax(values.imag))
    right = vectors[:, i] / vectors[2, i]
    left_values, left_vectors = eigenpairs(matrix.T)
    left = left_vectors[:, int(np.argmin(np.abs(left_values - values[i].conjugate())))]
    left = left / np.vdot(left, right).conjugate()
    size = float(np.linalg.norm(right))
    lyapunov = float("nan")
    if not cornered(rig):
        lyapunov = _lyapunov(rig, volts, state, matrix, values[i].imag, right / size, left * size)
    return HopfPoint(
        volts, omega, state, -rig.Jl * float(matrix[2, 2]), float(values[i].imag), lyapunov,
        _crossing(rig, omega), right,
    )  # fmt: skip


def _crossing(rig: Rig, omega: float) -> float:
    """By how much the pair's growth rate rises with the voltage, 1/(V s)."""
    near = [_at(rig, omega * (1.0 + side * 1e-4)) for side in (-1.0, 1.0)]
    pairs = [np.linalg.eigvals(matrix) for matrix, _, _ in near]
    real = [float(v[np.argmax(v.imag)].real) for v in pairs]
    return (real[1] - real[0]) / (near[1][1] - near[0][1])


def _lyapunov(
    rig: Rig, volts: float, state: FloatArray, matrix: FloatArray, frequency: float,
    q: ComplexArray, p: ComplexArray,
) -> float:  # fmt: skip
    """First Lyapunov coefficient (Kuznetsov, Elements of Applied Bifurcation Theory, 10.2)."""

    def along(v: FloatArray, steps: FloatArray, weights: FloatArray) -> FloatArray:
        places = state + _CURVED * steps[:, np.newaxis] * v
        return weights @ rates(rig, np.full(len(steps), volts), places)

    def second(v: FloatArray) -> FloatArray:
        return along(v, np.array([-1.0, 0.0, 1.0]), np.array([1.0, -2.0, 1.0])) / _CURVED**2

    def third(v: FloatArray) -> FloatArray:
        weights = np.array([-1.0, 3.0, -3.0, 1.0]) / 8.0
        return along(v, np.array([-3.0, -1.0, 1.0, 3.0]), weights) / _CURVED**3

    def quadratic(x: ComplexArray, y: ComplexArray) -> ComplexArray:
        def mixed(a: FloatArray, b: FloatArray) -> FloatArray:
            return 0.25 * (second(a + b) - second(a - b))

        real = mixed(x.real, y.real) - mixed(x.imag, y.imag)
        return real + 1j * (mixed(x.real, y.imag) + mixed(x.imag, y.real))

    r, i = q.real, q.imag
    cubic = third(r) + (third(i + r) - third(i - r)) / 6.0 - third(r) / 3.0
    turned = third(i) + (third(r + i) - third(r - i)) / 6.0 - third(i) / 3.0
    shifted = np.asarray(2j * frequency * np.eye(3) - matrix, dtype=np.complex128)
    mean = solve_complex(matrix, quadratic(q, q.conj()))
    double = solve_complex(shifted, quadratic(q, q))
    total = cubic + 1j * turned - 2.0 * quadratic(q, mean) + quadratic(q.conj(), double)
    return float(np.vdot(p, total).real / (2.0 * frequency))
