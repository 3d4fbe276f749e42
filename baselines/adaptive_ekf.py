"""Adaptive control from the upper encoder alone: a Kalman filter that learns the plant."""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal, TypeAlias, get_args

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig, View
from drill_env.friction import kernel_record

from . import _adaptive as kernels
from . import _filter as states
from ._surface import sensor_lag
from .linear import noise_levels

Unknown: TypeAlias = Literal["viscous", "offset", "friction", "ktheta", "Jl", "hump", "delay"]
"""What may be unknown of a plant, in the order of the filter's states."""

UNKNOWN: tuple[Unknown, ...] = get_args(Unknown)

# Standard deviations of the widest set, L3: half its width over sqrt(3); factors as logarithms.
_PRIOR = np.array([0.087, 0.093, 0.5, 0.17, 0.115, 0.087, 0.058])
_BOUNDS = np.array(
    [[-0.25, 0.25], [-0.25, 0.25], [-1.5, 1.2], [-0.5, 0.4], [-0.3, 0.3], [-0.25, 0.25], [0.0, 0.2]]
)


class AdaptiveEKF:
    """Extended Kalman filter for the state and the plant, regulator for the plant it believes in.

    The filter carries twist, both speeds (with true stick), the last five omega_u, and of the
    plant: viscous coefficient and torque offset of the upper disc, scale of the lower friction,
    stiffness, lower inertia, T2 and the sensor delay. Each period the regulator takes one step
    of the Riccati recursion for the plant as it is believed to be; the cost is that of `LQR`.
    Where the innovations stay larger than the filter expects, it doubts its estimates anew.

    Args:
        config: environment; its rig is where the estimates start.
        effort: weight of volts^2.
        slip: weight of (omega_u - omega_l)^2.
        upper: unmodelled change of omega_u in a period, rad/s.
        lower: likewise of omega_l.
        walk: random walk of factors in a period.
        viscous_walk: that of the viscous factor.
        friction_walk: that of the friction scale.
        offset_walk: that of the torque offset, Nm.
        delay_walk: that of the delay, s.
        blur: measurement noise beyond whole counts, rad/s: what the delay model leaves out.
        doubt: standard deviations the estimates start with, in units of those of L3.
        spread: how far from the measured speed the lower disc may be at the start.
        delay: first estimate of the sensor delay, s.
        alarm: mean normalised squared innovation that renews the doubt.
        refill: share of the first variances that is then added to friction and offset.
        refill_plant: likewise for the other unknowns, in units of `refill`.
        refill_state: likewise for twist and speeds, rad^2 and (rad/s)^2.
        headroom: V that the steady voltage keeps from the limit.
        unknown: what is estimated; the rest is taken as nominal.
    """

    view: View = "surface"
    history: int = 0

    def __init__(
        self, config: EnvConfig, *, effort: float = 1.097, slip: float = 0.51, upper: float =
        0.0007458, lower: float = 0.073, walk: float = 2e-05, viscous_walk: float = 6.935e-06,
        friction_walk: float = 7.404e-06, offset_walk: float = 0.00064, delay_walk: float =
        2.493e-08, blur: float = 0.01, doubt: float = 0.1851, spread: float = 0.4754, delay:
        float = 0.03776, alarm: float = 3.458, refill: float = 0.01078, refill_plant: float =
        2.097, refill_state: float = 0.1679, headroom: float = 0.01, unknown:
        Collection[Unknown] = UNKNOWN,
    ) -> None:  # fmt: skip
        strange = sorted(set(unknown) - set(UNKNOWN))
        if strange:
            raise InputError(f"unknown holds {strange[0]!r}: give some of {', '.join(UNKNOWN)}")
        self.config = config
        self._nominal = kernel_record(config.rig)
        self._work = self._nominal.copy()
        free = np.array([name in unknown for name in UNKNOWN])
        self._prior = np.column_stack([np.zeros(len(free)), doubt * _PRIOR * free])
        self._prior[-1, 0] = delay if free[-1] else 0.0
        walks = [viscous_walk, offset_walk, friction_walk, walk, walk, walk, delay_walk]
        self._process = np.zeros(states.N)
        self._process[[states.OMEGA_U, states.OMEGA_L]] = upper**2, lower**2
        self._process[states.FREE :] = np.square(walks) * free
        self._knobs = kernels.Knobs(
            effort, slip, float(noise_levels(config)[1]) ** 2 + blur**2, config.control_period,
            sensor_lag(config), spread, alarm, refill, refill_plant, refill_state, headroom,
            config.voltage_limit,
        )  # fmt: skip
        self._scratch = kernels.new_scratch()
        self._told: FloatArray | None = None
        self.reset(0)

    def reset(self, n: int) -> None:
        """Forget every estimate."""
        self.x, self.covariance = np.zeros((n, states.N)), np.zeros((n, states.N, states.N))
        self._value = np.tile(10.0 * np.eye(3), (n, 1, 1))
        self._nis, self._fresh = np.ones(n), True

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltage (V) from omega_u, the set point and the last voltage."""
        seen, setpoint, last = np.ascontiguousarray(observation[:, :3].T)
        told = np.full(len(seen), np.nan) if self._told is None else self._told
        volts = np.empty(len(seen))
        kernels.adapt_rigs(
            self._fresh, seen, last, setpoint, self.x, self.covariance, self._value, self._nis,
            self._nominal[0], self._work[0], self._process, self._prior, _BOUNDS, told,
            self._knobs, self._scratch, volts,
        )  # fmt: skip
        self._fresh = False
        return volts

    def believed(self) -> dict[str, FloatArray]:
        """Estimates of the unknown by name, shape (n,) each: factors, offset in Nm, delay in s."""
        found = {name: self.x[:, states.FREE + k] for k, name in enumerate(UNKNOWN)}
        kept = ("offset", "delay")
        return {name: v.copy() if name in kept else np.exp(v) for name, v in found.items()}


class ToldDelayEKF(AdaptiveEKF):
    """`AdaptiveEKF` that is told each rig's sensor delay, which no agent sees."""

    def __init__(self, config: EnvConfig, **options: object) -> None:
        known = [name for name in UNKNOWN if name != "delay"]
        super().__init__(config, **{"unknown": known, **options})  # pyright: ignore

    def tell_delays(self, delays: FloatArray) -> None:
        """Sensor delays (s) of the rigs that follow, shape (n,)."""
        self._told = np.asarray(delays, dtype=float)
