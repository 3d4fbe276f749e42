"""Limit cycles by shooting, with the variational equations through every event."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.describe import describe
from drill_env.continuation.flow import Character, CycleError, LimitCycle, Shot
from drill_env.friction import kernel_record
from drill_env.friction.kernels import map_lower
from drill_env.integrator.advance import DONE, advance
from drill_env.integrator.modes import start_mode
from drill_env.integrator.records import EVENT, FIRST_PARAMETER, N_STATE, RUN, new_work
from drill_env.integrator.tableau import tableau
from drill_env.integrator.trajectory import Events
from drill_env.parameters import SYMBOLS, Rig

__all__ = ["Character", "CycleError", "LimitCycle", "PeriodMap", "Shot"]


class PeriodMap:
    """The flow over one period as a function of state, period and one parameter.

    Args:
        rig: parameters.
        parameter: "voltage" or a symbol of the rig.
        volts: voltage when another parameter is continued, V.
        rtol: relative tolerance of a step.
    """

    def __init__(
        self, rig: Rig, parameter: str = "voltage", volts: float = 0.0, rtol: float = 1e-11
    ) -> None:
        self.rig, self.parameter, self.volts = rig, parameter, volts
        self._p = kernel_record(rig)
        self._set_value = float("nan")
        self._speed, self._torque, self._slope = np.zeros(1), np.zeros(1), np.zeros(1)
        self._work = new_work(
            rtol, 0.1 * rtol, rig.natural_period / 12.0, extrema=True, sensitivity=True
        )
        self._run = np.zeros(1, dtype=RUN)
        self._log = np.zeros(256, dtype=EVENT)
        self._breaks, self._piece = np.zeros(2), np.zeros((1, 1))
        self._out, self._modes = np.zeros((0, N_STATE)), np.zeros((0, 2), dtype=np.int64)
        self._times, self._sens = np.zeros(0), np.zeros((0, N_STATE, 1))

    def rig_at(self, value: float) -> Rig:
        """The rig with the continued parameter set."""
        if self.parameter == "voltage":
            return self.rig
        return self.rig.replace(**{self.parameter: value})

    def voltage_at(self, value: float) -> float:
        """The voltage (V) at a value of the continued parameter."""
        return value if self.parameter == "voltage" else self.volts

    def shoot(self, state: FloatArray, period: float, value: float) -> Shot:
        """Integrate one period and its derivatives.

        Raises:
            CycleError: the period is not positive or the integration failed.
        """
        if not (period > 0.0 and np.isfinite(state).all() and np.isfinite(value)):
            raise CycleError(f"shooting left the range of sense: period {period}, state {state}")
        self._set(value)
        run, work, volts = self._run, self._work, self.voltage_at(value)
        run[:] = np.zeros(1, dtype=RUN)
        run["y"][0, :3] = state
        run["h"] = 1e-2
        start_mode(self._p[0], run[0], volts)
        work["sens"] = 0.0
        work["sens"][0, :, :N_STATE] = np.eye(N_STATE)
        self._breaks[1], self._piece[0, 0] = period, volts
        status = advance(
            self._p[0], run[0], work[0], tableau("dop853", sensitivity=True)[0], self._breaks,
            self._piece, self._times, self._out, self._modes, self._log, self._sens,
        )  # fmt: skip
        if status != DONE:
            raise CycleError(f"integration over one period failed (status {status}) at {value}")
        end = run["y"][0, :3].copy()
        events = Events.from_log(self._log[: int(run["logged"][0])].copy())
        return Shot(end, self._jacobian(end, volts), events)

    def describe(self, shot: Shot, z: FloatArray, steps: int) -> LimitCycle:
        """Everything about the closed cycle of `z`."""
        return describe(shot, self.rig_at(float(z[4])), z, steps)

    def _jacobian(self, end: FloatArray, volts: float) -> FloatArray:
        sens, p = self._work["sens"][0], self._p[0]
        out = np.empty((3, 5))
        out[:, :3] = sens[:3, :3]
        out[:, 3] = self.rates(end, volts)
        if self.parameter == "voltage":
            # The voltage acts through km u alone; where u is 0 the column is not needed.
            out[:, 4] = sens[:3, FIRST_PARAMETER] * p["km"] / volts if volts else 0.0
        else:
            out[:, 4] = sens[:3, FIRST_PARAMETER + SYMBOLS.index(self.parameter)]
        return out

    def rates(self, state: FloatArray, volts: float) -> FloatArray:
        """Rates of (twist, omega_u, omega_l) with the upper disc turning forward, shape (3,)."""
        p = self._p[0]
        upper = (p["Tsu"] + p["dTsu"]) + (p["bu"] + p["dbu"]) * state[1]
        lower = (-1.0 if state[2] < 0.0 else 1.0) * self._friction(state[2])[0]
        return np.array(
            [
                state[1] - state[2],
                (p["km"] * volts - p["ktheta"] * state[0] - upper) / p["Ju"],
                (p["ktheta"] * state[0] - lower) / p["Jl"],
            ]
        )

    def phase(self, state: FloatArray, value: float) -> tuple[float, FloatArray]:
        """Section condition ktheta twist = T_l(omega_l), and its gradient by (state, T, value)."""
        gradient = np.zeros(5)
        if self.parameter != "voltage":
            step = 1e-7 * max(abs(value), 1e-3)
            margins = []
            for near in (value - step, value + step):
                self._set(near)
                margins.append(self._p["ktheta"][0] * state[0] - self._friction(state[2])[0])
            gradient[4] = (margins[1] - margins[0]) / (2.0 * step)
        self._set(value)
        torque, slope = self._friction(state[2])
        ktheta = float(self._p["ktheta"][0])
        gradient[0], gradient[2] = ktheta, -slope
        return ktheta * state[0] - torque, gradient

    def _set(self, value: float) -> None:
        """Write the continued parameter into the kernels' record."""
        if self.parameter != "voltage" and value != self._set_value:
            self._p = kernel_record(self.rig_at(value))
            self._set_value = value

    def _friction(self, omega: float) -> tuple[float, float]:
        """T_l and its slope at one speed, past the array interface of `drill_env.friction`."""
        self._speed[0] = abs(omega)
        map_lower(self._p[0], self._speed, False, self._torque)
        map_lower(self._p[0], self._speed, True, self._slope)
        if self.rig.clamp and self._torque[0] < 0.0:
            return 0.0, 0.0
        return float(self._torque[0]), float(self._slope[0])
