"""The flow of a rig with effects over one period, for the continuation of its limit cycles."""

from __future__ import annotations

import dataclasses

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.describe import describe
from drill_env.continuation.extended_cycle import full_state, monodromy
from drill_env.continuation.flow import CycleError, LimitCycle, Shot
from drill_env.integrator import Disc, Kind, Trajectory, simulate, vector_field
from drill_env.parameters import Rig

_RTOL, _ATOL = 1e-11, 1e-13
# Of the voltage (V) and of the state, for differences: the integration errs by 1e-11 and the rates
# by 1e-16, so that both differences err by about as much as they leave out.
_VOLTS, _STATE = 1e-6, 1e-6


class ExtendedFlow:
    """The return after a period of a rig with effects under a constant voltage, see `Flow`.

    Args:
        rig: parameters with two inertias, and effects that follow neither time nor an angle.
    """

    def __init__(self, rig: Rig) -> None:
        self.rig = rig

    def rig_at(self, value: float) -> Rig:
        """The rig, whatever the voltage."""
        return self.rig

    def shoot(self, state: FloatArray, period: float, value: float) -> Shot:
        """Integrate one period and its derivatives, that by the voltage by a difference.

        Raises:
            CycleError: the period is not positive, or the integration failed.
        """
        if not (period > 0.0 and np.isfinite(state).all() and np.isfinite(value)):
            raise CycleError(f"shooting left the range of sense: period {period}, state {state}")
        run = self._run(state, period, value, sensitivity=True)
        near = self._run(state, period, value + _VOLTS, sensitivity=False)
        end, moved = (full_state(r.final_state, r.final_inner) for r in (run, near))
        by_volts = (moved - end) / _VOLTS
        jacobian = np.column_stack([monodromy(run), self.rates(end, value), by_volts])
        return Shot(end, jacobian, run.events)

    def _run(
        self, state: FloatArray, period: float, volts: float, *, sensitivity: bool
    ) -> Trajectory:
        try:
            return simulate(
                self.rig, volts, period, initial=np.append(state[:3], 0.0), inner=state[3:],
                t_eval=np.zeros(0), extrema=True, sensitivity=sensitivity, rtol=_RTOL, atol=_ATOL,
            )  # fmt: skip
        except RuntimeError as error:
            raise CycleError(f"integration over one period failed at {volts:.9g} V") from error

    def rates(self, state: FloatArray, volts: float) -> FloatArray:
        """Rates of (twist, omega_u, omega_l, inner states), both discs turning forward."""
        return vector_field(self.rig, np.array([volts]), state[None])[0]

    def phase(self, state: FloatArray, value: float) -> tuple[float, FloatArray]:
        """Torque left on the lower disc (Nm), 0 where omega_l is greatest, and its gradient."""
        n = len(state)
        steps = _STATE * (1.0 + np.abs(np.append(state, value)))
        moves = np.vstack([np.diag(steps), -np.diag(steps), np.zeros(n + 1)])
        near = np.append(state, value) + moves
        pull = self.rig.Jl * vector_field(self.rig, near[:, n], near[:, :n])[:, 2]
        slopes = (pull[: n + 1] - pull[n + 1 : -1]) / (2.0 * steps)
        return float(pull[-1]), np.concatenate([slopes[:n], [0.0], slopes[n:]])

    def describe(self, shot: Shot, z: FloatArray, steps: int) -> LimitCycle:
        """The closed cycle; of a contact only whether the disc sticks is known, not the margin."""
        cycle = describe(shot, self.rig, z, steps)
        lower = shot.events.where(Disc.LOWER)
        touches = lower.kind[np.isin(lower.kind, (Kind.STICK, Kind.REVERSAL))]
        hits = tuple(1.0 if kind == Kind.STICK else -1.0 for kind in touches)
        return dataclasses.replace(cycle, hits=hits)
