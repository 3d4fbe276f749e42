"""Turning equilibria and Hopf points of a rig with effects, by differences of its rates."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import brentq

from drill_env._errors import InputError
from drill_env._types import ComplexArray, FloatArray
from drill_env.continuation.equilibria import EquilibriumBranch, speed_at
from drill_env.continuation.hopf import HopfPoint, eigenpairs, solve_complex
from drill_env.continuation.special import SpecialPoint
from drill_env.dynamics import equilibrium_voltage
from drill_env.effects.steady import cornered
from drill_env.friction import lower_curve
from drill_env.integrator import first_inner, vector_field
from drill_env.parameters import Rig

_NEWTON, _CLOSED = 40, 1e-11
# Of central differences: first derivatives, and second and third ones along a unit vector.
_STEP, _CURVED = 1e-6, 3e-3
_SPEEDS = 400
# Drag may be missing or added: speeds are looked at up to so many times those without effects.
_FURTHER = 2.0
_SLOWEST = 1e-3
# An equilibrium at a voltage lies between two of the branch, which goes on so far.
_BEYOND = 1.1


def equilibria(rig: Rig, omega: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Voltages and states at which both discs turn at given speeds.

    Args:
        rig: parameters and effects.
        omega: rad/s > 0, shape (n,).

    Returns:
        V, shape (n,), and twist, omega_u, omega_l and the effects' inner states, shape (n, 3 + m);
        NaN where no voltage keeps the speed.
    """
    volts = np.array(equilibrium_voltage(rig, omega), dtype=np.float64)
    twist = np.asarray(lower_curve(rig, omega), dtype=float) / rig.ktheta
    plain = np.column_stack([twist, omega, omega, np.zeros(len(omega))])
    inner = [first_inner(rig, v, y) for v, y in zip(volts.tolist(), plain, strict=True)]
    states = np.column_stack([plain[:, :3], np.array(inner).reshape(len(omega), -1)])
    free = [0, *range(3, states.shape[1])]
    gap = np.full((len(omega), len(free) + 1), np.inf)
    for _ in range(_NEWTON):
        gap = vector_field(rig, volts, states)[:, 1:]
        columns = [(vector_field(rig, volts + _STEP, states)[:, 1:] - gap) / _STEP]
        for place in free:
            moved = states.copy()
            moved[:, place] += _STEP
            columns.append((vector_field(rig, volts, moved)[:, 1:] - gap) / _STEP)
        matrices = np.stack(columns, axis=2)
        singular = ~(np.linalg.cond(matrices) < 1e12)
        matrices[singular] = np.eye(len(free) + 1)
        move = np.linalg.solve(matrices, gap[:, :, np.newaxis])[:, :, 0]
        move[singular] = 0.0
        volts = np.asarray(volts - move[:, 0], dtype=np.float64)
        states[:, free] -= move[:, 1:]
        if np.abs(gap[~singular]).max(initial=0.0) < _CLOSED:
            break
    lost = ~(np.abs(gap).max(axis=1) < 1e-8)
    return np.where(lost, np.nan, volts), np.where(lost[:, np.newaxis], np.nan, states)


def jacobians(rig: Rig, volts: FloatArray, states: FloatArray) -> FloatArray:
    """Linearisations around states, shape (n, 3 + m, 3 + m)."""
    columns = []
    for step in _STEP * np.eye(states.shape[1]):
        ahead = vector_field(rig, volts, states + step)
        columns.append((ahead - vector_field(rig, volts, states - step)) / (2.0 * _STEP))
    return np.stack(columns, axis=2)


def extended_branch(rig: Rig, omega: FloatArray) -> EquilibriumBranch:
    """The turning equilibria of a rig with effects at the speeds that a voltage keeps.

    Args:
        rig: parameters and effects, none of which `drill_env.effects.steady.unsteady` names.
        omega: rad/s, greater than the step of the differences, ascending, shape (n,).
    """
    volts, states = equilibria(rig, omega)
    kept = np.isfinite(volts)
    volts, states, omega = volts[kept], states[kept], omega[kept]
    matrices = jacobians(rig, volts, states)
    eigenvalues = np.asarray(np.linalg.eigvals(matrices), dtype=np.complex128)
    stable = np.asarray((eigenvalues.real < 0.0).all(axis=1))
    return EquilibriumBranch(
        volts, omega, states[:, 0], -rig.Jl * matrices[:, 2, 2], eigenvalues, stable
    )


def turning_branch(rig: Rig, to_volts: float) -> EquilibriumBranch:
    """All turning equilibria of a rig with effects from 0 to `to_volts` (V)."""
    top = _FURTHER * speed_at(rig.replace(effects=()), to_volts)
    grid = np.concatenate(
        [np.geomspace(_SLOWEST, top, _SPEEDS), np.linspace(_SLOWEST, top, _SPEEDS)]
    )
    found = extended_branch(rig, np.unique(grid))
    kept = (found.voltage >= 0.0) & (found.voltage <= to_volts)
    return EquilibriumBranch(
        found.voltage[kept], found.omega[kept], found.twist[kept], found.slope[kept],
        found.eigenvalues[kept], found.stable[kept],
    )  # fmt: skip


def turning_at(rig: Rig, volts: float) -> list[tuple[FloatArray, bool]]:
    """The turning equilibria at a voltage (V), by speed.

    Returns:
        For each twist, omega_u, omega_l and the effects' inner states, shape (3 + m,), and whether
        it is stable.
    """
    branch = turning_branch(rig, _BEYOND * volts)
    off, found = branch.voltage - volts, []
    for i in np.flatnonzero((off[:-1] < 0.0) != (off[1:] < 0.0)).tolist():
        ends = float(branch.omega[i]), float(branch.omega[i + 1])
        omega = float(brentq(lambda w: _at(rig, w)[1] - volts, *ends, xtol=1e-13, rtol=1e-14))
        matrix, _, state = _at(rig, omega)
        found.append((state, bool((np.linalg.eigvals(matrix).real < 0.0).all())))
    return found


def extended_hopf_points(rig: Rig, branch: EquilibriumBranch, to_volts: float) -> list[HopfPoint]:
    """Hopf points of a branch up to `to_volts`, ordered by speed.

    The first Lyapunov coefficient follows from differences too; it is NaN where an effect is a
    table, which has corners.
    """
    margins = np.array([_largest_pair(values) for values in branch.eigenvalues])
    found = []
    for i in np.flatnonzero(margins[:-1] * margins[1:] < 0.0).tolist():
        low, high = float(branch.omega[i]), float(branch.omega[i + 1])
        omega = float(brentq(lambda w: _growth(rig, w), low, high, xtol=1e-12, rtol=1e-14))
        # Where a pair becomes real its growth jumps and is not zero.
        if abs(_growth(rig, omega)) < 1e-6 and _at(rig, omega)[1] <= to_volts:
            found.append(_hopf_point(rig, omega))
    return found


def extended_hopf_entry(point: HopfPoint) -> SpecialPoint:
    """A Hopf point as one of the special points."""
    kind = "supercritical" if point.supercritical else "subcritical"
    remark = f"{kind}: first Lyapunov coefficient {point.lyapunov:.4g}"
    if math.isnan(point.lyapunov):
        remark = "an effect is a table, whose corners hide whether stable cycles arise"
    return SpecialPoint(
        "", "hopf", point.voltage, point.omega, point.omega, point.omega,
        2.0 * math.pi / point.frequency, (), "a2 a1 = a0 of the linearisation with effects",
        1e-6, remark,
    )  # fmt: skip


def _at(rig: Rig, omega: float) -> tuple[FloatArray, float, FloatArray]:
    """Linearisation, voltage and state of the equilibrium at a speed.

    Raises:
        InputError: no voltage keeps the speed.
    """
    volts, states = equilibria(rig, np.array([omega]))
    if not np.isfinite(volts[0]):
        raise InputError(f"no voltage keeps {omega:.4g} rad/s: an effect takes what is asked for")
    return jacobians(rig, volts, states)[0], float(volts[0]), states[0]


def _largest_pair(values: ComplexArray) -> float:
    """Largest growth rate of a pair of complex eigenvalues, 1/s; below 0 where there is none."""
    pairs = values[values.imag > 1e-9]
    return float(pairs.real.max()) if len(pairs) else -np.inf


def _growth(rig: Rig, omega: float) -> float:
    return max(_largest_pair(np.linalg.eigvals(_at(rig, omega)[0]).astype(complex)), -1e3)


def _hopf_point(rig: Rig, omega: float) -> HopfPoint:
    matrix, volts, state = _at(rig, omega)
    values, vectors = eigenpairs(matrix)
    i = _critical(values)
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


def _critical(values: ComplexArray) -> int:
    """Place of the pair's upper eigenvalue that is nearest to the imaginary axis."""
    return int(np.argmin(np.where(values.imag > 1e-9, np.abs(values.real), np.inf)))


def _crossing(rig: Rig, omega: float) -> float:
    """By how much the pair's growth rate rises with the voltage, 1/(V s)."""
    near = [_at(rig, omega * (1.0 + side * 1e-4)) for side in (-1.0, 1.0)]
    pairs = [np.linalg.eigvals(matrix) for matrix, _, _ in near]
    real = [_largest_pair(v.astype(complex)) for v in pairs]
    return (real[1] - real[0]) / (near[1][1] - near[0][1])


def _lyapunov(
    rig: Rig, volts: float, state: FloatArray, matrix: FloatArray, frequency: float,
    q: ComplexArray, p: ComplexArray,
) -> float:  # fmt: skip
    """First Lyapunov coefficient (Kuznetsov, Elements of Applied Bifurcation Theory, 10.2)."""

    def along(v: FloatArray, steps: FloatArray, weights: FloatArray) -> FloatArray:
        places = state + _CURVED * steps[:, np.newaxis] * v
        return weights @ vector_field(rig, np.full(len(steps), volts), places)

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
    shifted = np.asarray(2j * frequency * np.eye(len(matrix)) - matrix, dtype=np.complex128)
    mean = solve_complex(matrix, quadratic(q, q.conj()))
    double = solve_complex(shifted, quadratic(q, q))
    total = cubic + 1j * turned - 2.0 * quadratic(q, mean) + quadratic(q.conj(), double)
    return float(np.vdot(p, total).real / (2.0 * frequency))
