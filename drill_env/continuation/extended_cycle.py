"""Limit cycles of a rig with effects and their Floquet multipliers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.continuation._plain import returning
from drill_env.integrator import Disc, Kind, Trajectory, simulate
from drill_env.parameters import Rig

# Closed by so much of its size; Newton's steps at most; the tolerances of a step.
_CLOSED, _MOST, _RTOL, _ATOL = 1e-9, 25, 1e-11, 1e-13
_SETTLE = 40.0
# Less swing than such a share of the speed is none.
_STEADY = 1e-3
_NONE = "no limit cycle: at {:g} V the rig turns steadily or rests"


@dataclass(frozen=True, slots=True, eq=False)
class ExtendedCycle:
    """A limit cycle of a rig with effects under a constant voltage.

    Attributes:
        voltage: V.
        period: s.
        start: twist (rad), omega_u, omega_l (rad/s), then the inner states, at a maximum of
            omega_l; shape (3 + m,).
        multipliers: Floquet multipliers by size, the one along the flow left out, shape (2 + m,).
        low: least omega_l, rad/s.
        high: greatest omega_l, rad/s.
        sticks: whether the lower disc comes to rest within the period.
        misses: by how much the cycle does not close, in shares of its size.
    """

    voltage: float
    period: float
    start: FloatArray
    multipliers: NDArray[np.complex128]
    low: float
    high: float
    sticks: bool
    misses: float

    @property
    def stable(self) -> bool:
        """Whether all other multipliers lie within the unit circle."""
        return bool(np.abs(self.multipliers).max(initial=0.0) < 1.0)


def extended_cycle(rig: Rig, volts: float, state: FloatArray | None = None) -> ExtendedCycle:
    """The limit cycle next to what the rig does from a state, by shooting with exact sensitivities.

    Args:
        rig: parameters and effects; those of the encoders, and those of which a constant voltage
            leaves nothing, do not act.
        volts: constant voltage, V.
        state: twist, omega_u, omega_l, theta_l to run from until it nears the cycle, shape (4,);
            rest by default.

    Raises:
        InputError: an effect follows time or an angle or never forgets, the rig has one inertia,
            or it does not vibrate at this voltage.
        RuntimeError: the shooting does not close.
    """
    turning = returning(rig)
    y, period = _near(turning, volts, state)
    misses = math.inf
    for _ in range(_MOST):
        shot = _shoot(turning, volts, y, period)
        missed = full_state(shot.final_state, shot.final_inner) - y
        misses = float((np.abs(missed) / (1.0 + np.abs(y))).max())
        if misses < _CLOSED:
            return _found(turning, volts, y, period, shot, misses)
        y, period = _newton(turning, volts, y, period, shot, missed)
    raise RuntimeError(
        f"the limit cycle at {volts:g} V does not close (by {misses:.1e}); give another state"
    )


def full_state(state: FloatArray, inner: FloatArray) -> FloatArray:
    """Twist, omega_u, omega_l and the inner states, shape (3 + m,)."""
    return np.concatenate([state[:3], inner])


def _near(rig: Rig, volts: float, state: FloatArray | None) -> tuple[FloatArray, float]:
    """A maximum of omega_l of the settled motion, and the time to the next like it."""
    seconds = _SETTLE * rig.natural_period
    first = simulate(rig, volts, seconds, initial=state, rtol=1e-8, atol=1e-10)
    run = simulate(
        rig, volts, 10.0 * rig.natural_period, initial=first.final_state, modes=first.final_modes,
        inner=first.final_inner, extrema=True, rate=1e3, rtol=1e-9, atol=1e-11,
    )  # fmt: skip
    tops = run.events.where(Disc.LOWER, Kind.MAXIMUM)
    speeds = tops.state[:, 2]
    high = speeds > 0.5 * (run.omega_l.min() + run.omega_l.max())
    if _steady(run.omega_l) or high.sum() < 2:
        raise InputError(_NONE.format(volts))
    t, row = tops.t[high], tops.state[high][-2]
    inner = [np.interp(t[-2], run.t, z) for z in run.inner.T]
    return full_state(row, np.array(inner)), float(t[-1] - t[-2])


def _steady(speeds: FloatArray) -> bool:
    return float(np.ptp(speeds)) < _STEADY * (1.0 + float(np.abs(speeds).max()))


def _shoot(rig: Rig, volts: float, y: FloatArray, period: float) -> Trajectory:
    start = np.append(y[:3], 0.0)
    return simulate(
        rig, volts, period, initial=start, inner=y[3:], rate=200.0, sensitivity=True,
        rtol=_RTOL, atol=_ATOL,
    )  # fmt: skip


def _flow(rig: Rig, volts: float, y: FloatArray) -> FloatArray:
    """Rates in a state by a short way on from it, fourth order in its length."""
    h = 1e-4 * rig.natural_period

    def after(seconds: float) -> FloatArray:
        run = simulate(
            rig, volts, seconds, initial=np.append(y[:3], 0.0), inner=y[3:], rate=1.0 / seconds,
            rtol=1e-13, atol=1e-15,
        )  # fmt: skip
        return full_state(run.final_state, run.final_inner) - y

    return (
        48.0 * after(h) - 36.0 * after(2.0 * h) + 16.0 * after(3.0 * h) - 3.0 * after(4.0 * h)
    ) / (12.0 * h)


def monodromy(shot: Trajectory) -> FloatArray:
    """Derivative of (twist, omega_u, omega_l, inner) after one period by those before it."""
    whole, m = shot.final_sensitivity, len(shot.final_inner)
    kept = [0, 1, 2, *range(4, 4 + m)]
    columns = [0, 1, 2, *range(whole.shape[1] - m, whole.shape[1])]
    return whole[np.ix_(kept, columns)]


def _newton(
    rig: Rig, volts: float, y: FloatArray, period: float, shot: Trajectory, missed: FloatArray
) -> tuple[FloatArray, float]:
    """A step that moves across the flow only: where on the cycle it begins is free."""
    n, flow = len(y), _flow(rig, volts, y)
    after = _flow(rig, volts, full_state(shot.final_state, shot.final_inner))
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = monodromy(shot) - np.eye(n)
    system[:n, n], system[n, :n] = after, flow
    step = np.linalg.solve(system, np.append(-missed, 0.0))
    return y + step[:n], period + float(step[n])


def _found(
    rig: Rig, volts: float, y: FloatArray, period: float, shot: Trajectory, misses: float
) -> ExtendedCycle:
    values: Any = np.linalg.eigvals(monodromy(shot))
    values = np.delete(values, np.abs(values - 1.0).argmin())
    run = simulate(rig, volts, period, initial=np.append(y[:3], 0.0), inner=y[3:], rate=2e3)
    speeds = run.omega_l
    if _steady(speeds):
        # A motion that dies out slowly closes on the equilibrium, with any period.
        raise InputError(_NONE.format(volts))
    return ExtendedCycle(
        volts, period, y, values[np.argsort(-np.abs(values))], float(speeds.min()),
        float(speeds.max()), bool(run.stuck_l.any()), misses,
    )  # fmt: skip
