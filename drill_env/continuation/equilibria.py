"""Equilibria over the voltage: the sticking set, the turning branch and its stability."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._types import BoolArray, ComplexArray, FloatArray
from drill_env.dynamics import equilibrium_voltage
from drill_env.friction import lower_curve, lower_curve_slope
from drill_env.parameters import Rig


@dataclass(frozen=True, slots=True)
class StickingSet:
    """The equilibrium set E of equation (10) at one voltage.

    Attributes:
        voltage: V.
        twist: smallest and largest twist in E, rad.
        attractive: locally asymptotically stable; (10) is so by Lyapunov's theory for
            dissipative friction (Van de Wouw and Leine 2003), which holds near rest as
            soon as T_l > 0 there.
    """

    voltage: float
    twist: tuple[float, float]
    attractive: bool


def sticking_set(rig: Rig, volts: float) -> StickingSet | None:
    """Equation (10), or None where no state at rest is in balance.

    Args:
        rig: parameters with two inertias.
        volts: constant voltage, V.
    """
    drive = rig.km * volts - rig.dTsu
    low = max(-rig.Tsl, drive - rig.Tsu) / rig.ktheta
    high = min(rig.Tsl, drive + rig.Tsu) / rig.ktheta
    if low > high:
        return None
    return StickingSet(volts, (low, high), rig.Tsl > 0.0)


def jacobian(rig: Rig, omega: float) -> FloatArray:
    """Linearisation of (4) around the equilibrium at `omega` > 0 (rad/s), shape (3, 3)."""
    slope = float(lower_curve_slope(rig, omega))
    return np.array(
        [
            [0.0, 1.0, -1.0],
            [-rig.ktheta / rig.Ju, -(rig.bu + rig.dbu) / rig.Ju, 0.0],
            [rig.ktheta / rig.Jl, 0.0, -slope / rig.Jl],
        ]
    )


def routh_hurwitz(rig: Rig, slope: float) -> tuple[float, float, float, float]:
    """a2, a1, a0 of the characteristic polynomial and a2 a1 - a0, for friction slope d_l.

    All four are positive exactly where the equilibrium is stable.
    """
    b, k, ju, jl = rig.bu + rig.dbu, rig.ktheta, rig.Ju, rig.Jl
    a2 = b / ju + slope / jl
    a1 = k / ju + k / jl + b * slope / (ju * jl)
    a0 = k * (b + slope) / (ju * jl)
    return a2, a1, a0, a2 * a1 - a0


def critical_slope(rig: Rig) -> float:
    """The friction slope d_l (Nm s/rad) above which equilibria are stable, equation (12).

    It is the largest root of a2 a1 = a0, a quadratic in d_l: -0.00114 for the paper's rig.

    Raises:
        InputError: no slope makes the equilibrium lose its stability by a Hopf point.
    """
    b, k, ju, jl = rig.bu + rig.dbu, rig.ktheta, rig.Ju, rig.Jl
    quadratic = b / (ju * jl * jl)
    linear = k / jl**2 + b * b / (ju * ju * jl)
    constant = b * k / ju**2
    if quadratic == 0.0:
        return -constant / linear
    root = linear * linear - 4.0 * quadratic * constant
    if root < 0.0:
        raise InputError("no friction slope makes the equilibrium of this rig lose its stability")
    # The larger root without cancellation: linear is positive.
    return -2.0 * constant / (linear + math.sqrt(root))


@dataclass(frozen=True, slots=True)
class EquilibriumBranch:
    """The turning equilibria (11), ordered by speed.

    Attributes:
        voltage: V, shape (n,).
        omega: rad/s, shape (n,).
        twist: rad, shape (n,).
        slope: d_l, Nm s/rad, shape (n,).
        eigenvalues: 1/s, shape (n, 3).
        stable: all real parts negative, shape (n,).
    """

    voltage: FloatArray
    omega: FloatArray
    twist: FloatArray
    slope: FloatArray
    eigenvalues: ComplexArray
    stable: BoolArray


def equilibrium_branch(rig: Rig, omega: FloatArray) -> EquilibriumBranch:
    """The branch (11) at the speeds `omega` > 0 (rad/s), shape (n,)."""
    omega = np.asarray(omega, dtype=float)
    slope = lower_curve_slope(rig, omega)
    matrices = np.empty((len(omega), 3, 3))
    if len(omega):
        # Only the last entry depends on the speed.
        matrices[:] = jacobian(rig, float(omega[0]))
        matrices[:, 2, 2] = -slope / rig.Jl
    eigenvalues = np.asarray(np.linalg.eigvals(matrices), dtype=np.complex128)
    return EquilibriumBranch(
        voltage=equilibrium_voltage(rig, omega),
        omega=omega,
        twist=lower_curve(rig, omega) / rig.ktheta,
        slope=slope,
        eigenvalues=eigenvalues,
        stable=np.asarray((eigenvalues.real < 0.0).all(axis=1)),
    )


def speed_at(rig: Rig, volts: float) -> float:
    """A speed (rad/s) beyond every equilibrium up to `volts`, as a bound for searches."""
    top = 1.0
    while float(equilibrium_voltage(rig, top)) < volts:
        top *= 2.0
        if top > 1e6:
            raise InputError(f"no equilibrium reaches {volts} V: the friction falls without end")
    return top
