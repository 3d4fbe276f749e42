"""The flow of a rig with effects over one period, for the continuation of its limit cycles."""

from __future__ import annotations

import dataclasses

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation._numbers import with_number
from drill_env.continuation.describe import describe
from drill_env.continuation.extended_cycle import full_state, monodromy
from drill_env.continuation.flow import CycleError, LimitCycle, Shot
from drill_env.integrator import Disc, Kind, Trajectory, simulate, vector_field
from drill_env.parameters import Rig

_RTOL, _ATOL = 1e-11, 1e-13
# Of the parameter and of the state, for differences: the integration errs by 1e-11 and the rates
# by 1e-16, so that both differences err by about as much as they leave out.
_STEP = 1e-6


class ExtendedFlow:
    """The return after a period of a rig with effects under a constant voltage, see `Flow`.

    Args:
        rig: parameters with two inertias, and effects that follow neither time nor an angle.
        parameter: "voltage", or a number as `with_number` takes it.
        volts: voltage when another parameter is continued, V.
    """

    def __init__(self, rig: Rig, parameter: str = "voltage", volts: float = 0.0) -> None:
        self.rig, self.parameter, self.volts = rig, parameter, volts

    def rig_at(self, value: float) -> Rig:
        """The rig with the continued parameter set."""
        if self.parameter == "voltage":
            return self.rig
        return with_number(self.rig, self.parameter, value)

    def voltage_at(self, value: float) -> float:
        """The voltage (V) at a value of the continued parameter."""
        return value if self.parameter == "voltage" else self.volts

    def shoot(self, state: FloatArray, period: float, value: float) -> Shot:
        """Integrate one period and its derivatives, that by the parameter by a difference.

        Raises:
            CycleError: the period is not positive, or the integration failed.
        """
        if not (period > 0.0 and np.isfinite(state).all() and np.isfinite(value)):
            raise CycleError(f"shooting left the range of sense: period {period}, state {state}")
        run = self._run(state, period, value, sensitivity=True)
        near = self._run(state, period, value + _STEP * self._size(value), sensitivity=False)
        end, moved = (full_state(r.final_state, r.final_inner) for r in (run, near))
        by_value = (moved - end) / (_STEP * self._size(value))
        jacobian = np.column_stack([monodromy(run), self.rates(end, value), by_value])
        return Shot(end, jacobian, run.events)

    def _run(
        self, state: FloatArray, period: float, value: float, *, sensitivity: bool
    ) -> Trajectory:
        try:
            return simulate(
                self.rig_at(value), self.voltage_at(value), period,
                initial=np.append(state[:3], 0.0), inner=state[3:], t_eval=np.zeros(0),
                extrema=True, sensitivity=sensitivity, rtol=_RTOL, atol=_ATOL,
            )  # fmt: skip
        except RuntimeError as error:
            raise CycleError(f"integration over one period failed at {value:.9g}") from error

    def _size(self, value: float) -> float:
        """What a step of the parameter is a share of."""
        return 1.0 if self.parameter == "voltage" else max(abs(value), 1e-3)

    def rates(self, state: FloatArray, value: float) -> FloatArray:
        """Rates of (twist, omega_u, omega_l, inner states), both discs turning forward."""
        return self._field(value, state[None])[0]

    def _field(self, value: float, states: FloatArray) -> FloatArray:
        volts = np.full(len(states), self.voltage_at(value))
        return vector_field(self.rig_at(value), volts, states)

    def phase(self, state: FloatArray, value: float) -> tuple[float, FloatArray]:
        """Torque left on the lower disc (Nm), 0 where omega_l is greatest, and its gradient."""
        n, here = len(state), self.rig_at(value).Jl
        steps = _STEP * (1.0 + np.abs(state))
        moves = np.vstack([np.diag(steps), -np.diag(steps), np.zeros(n)])
        pull = here * self._field(value, state + moves)[:, 2]
        by_state = (pull[:n] - pull[n:-1]) / (2.0 * steps)
        step = _STEP * self._size(value)
        ends = [
            self.rig_at(v).Jl * self._field(v, state[None])[0, 2]
            for v in (value + step, value - step)
        ]
        by_value = (ends[0] - ends[1]) / (2.0 * step)
        return float(pull[-1]), np.concatenate([by_state, [0.0, by_value]])

    def describe(self, shot: Shot, z: FloatArray, steps: int) -> LimitCycle:
        """The closed cycle; of a contact only whether the disc sticks is known, not the margin."""
        cycle = describe(shot, self.rig_at(float(z[-1])), z, steps)
        lower = shot.events.where(Disc.LOWER)
        touches = lower.kind[np.isin(lower.kind, (Kind.STICK, Kind.REVERSAL))]
        hits = tuple(1.0 if kind == Kind.STICK else -1.0 for kind in touches)
        return dataclasses.replace(cycle, hits=hits)
