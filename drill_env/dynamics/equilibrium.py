"""Equilibria with turning discs, equation (11)."""

from __future__ import annotations

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.friction import lower_curve
from drill_env.parameters import Rig


def equilibrium_voltage(rig: Rig, omega: FloatArray | float) -> FloatArray:
    """Constant voltage (V) at which both discs turn at `omega` > 0 (rad/s), equation (11).

    Args:
        rig: parameters.
        omega: velocity in rad/s, greater than 0, any shape.

    Raises:
        InputError: a velocity is not greater than 0.
    """
    omega = np.asarray(omega, dtype=float)
    if not (omega > 0).all():
        raise InputError("equilibrium velocity must be greater than 0 rad/s")
    upper = rig.Tsu + rig.dTsu + (rig.bu + rig.dbu) * omega
    lower = 0.0 if rig.inertias == 1 else lower_curve(rig, omega)
    return (upper + lower) / rig.km


def equilibrium_state(rig: Rig, omega: float) -> FloatArray:
    """State (twist, omega_u, omega_l, theta_l) turning steadily at `omega` > 0 (rad/s)."""
    twist = 0.0 if rig.inertias == 1 else float(lower_curve(rig, omega)) / rig.ktheta
    return np.array([twist, omega, 0.0 if rig.inertias == 1 else omega, 0.0])


def equilibrium_speed(rig: Rig, volts: float) -> float:
    """Largest steady velocity (rad/s) at a constant voltage; 0 at or below u_c1.

    Where friction falls fast enough for several equilibria the fastest one is given.
    """
    if volts <= rig.breakaway_voltage:
        return 0.0
    from scipy.optimize import brentq

    top = 1.0 + rig.km * volts / max(rig.bu + rig.dbu, 1e-9)
    grid = np.linspace(1e-9, 4.0 * top, 4001)
    excess = equilibrium_voltage(rig, grid) - volts
    turns = np.flatnonzero((excess[:-1] <= 0) & (excess[1:] > 0))
    if len(turns) == 0:
        raise InputError(f"no equilibrium at {volts} V below {4 * top:.3g} rad/s")
    i = int(turns[-1])
    return float(brentq(lambda w: float(equilibrium_voltage(rig, w)) - volts, grid[i], grid[i + 1]))
