"""One control period of a sampled loop, with its derivatives."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.continuation._plain import require_plain
from drill_env.continuation.flow import CycleError
from drill_env.continuation.loop_law import ControlLaw
from drill_env.controllers import Controller
from drill_env.dynamics import equilibrium_state, equilibrium_voltage
from drill_env.dynamics.kernels import rates_at
from drill_env.environment.config import EnvConfig
from drill_env.friction import kernel_record
from drill_env.integrator import NegativeFrictionWarning, Trajectory, simulate
from drill_env.parameters import SYMBOLS
from drill_env.sensors.kernels import filter_sample

# The voltage acts on the upper disc as dTsu does, but for its sign and km.
_DRIVE = 4 + SYMBOLS.index("dTsu")
_RIG = 3


@dataclass(frozen=True, slots=True)
class ControlPeriod:
    """One control period.

    Attributes:
        state: of the loop at its end, shape (n,).
        jacobian: d state / d (state before, duration, set point), shape (n, n + 2), or empty.
        volts: held during the period, V.
        run: the rig's motion; its times begin at 0.
    """

    state: FloatArray
    jacobian: FloatArray
    volts: float
    run: Trajectory


class SampledLoop:
    """The rig under a sampled controller, as a map from one sample instant to the next.

    The state holds (twist, omega_u, omega_l), then (velocity, two memories) of each velocity
    filter, the voltage held last, past frames, newest first, and the controller's memory.
    Encoders are exact: neither quantised nor noisy.

    Args:
        controller: its memory must be readable if it has any, see
            `drill_env.controllers.Remembering`.
        config: rig, control period, encoder rate and filter, voltage limit.
        filtered: velocities come from the configured filter; else they are exact.
        rtol: relative tolerance of a step.

    Raises:
        InputError: the rig has effects, the encoders are late, or the controller's memory cannot
            be read.
    """

    def __init__(
        self, controller: Controller, config: EnvConfig, filtered: bool = True, rtol: float = 1e-11
    ) -> None:
        require_plain(config.rig)
        if config.encoder.delay_s > 0.0:
            raise InputError("a loop with delayed encoders cannot be continued: set delay_s to 0")
        self.config, self.rig, self._rtol = config, config.rig, rtol
        self._p = kernel_record(config.rig)[0]
        self._discs = (0,) if controller.view == "surface" else (0, 1)
        self._filter = _filter_matrix(config) if filtered and controller.view != "state" else None
        stride = 0 if self._filter is None else 3
        speeds = [_RIG + stride * i if stride else 1 + i for i in self._discs]
        self._measured = speeds if controller.view == "surface" else [0, *speeds]
        self.voltage = _RIG + stride * len(self._discs)
        frame = len(self._measured) + 1
        self._past = slice(self.voltage + 1, self.voltage + 1 + frame * controller.history)
        self.law = ControlLaw(controller, frame * (controller.history + 1) + 1)
        self.size = self._past.stop + self.law.size
        past, memory = range(self.voltage + 1, self._past.stop), range(self._past.stop, self.size)
        # The set point stands among the observations and is no part of the state.
        order = [*self._measured, self.size, self.voltage, *past, *memory]
        self._reads = np.eye(self.size + 1)[order]

    @property
    def tolerance(self) -> float:
        """Relative gap below which a motion is closed: single precision leaves a larger one."""
        return 1e-5 if self.law.rounded else 1e-10

    def steady(self, omega: float) -> FloatArray:
        """A state that turns steadily at the set point `omega` (rad/s), or nearly so, (n,)."""
        rig = equilibrium_state(self.rig, omega)
        volts = float(equilibrium_voltage(self.rig, omega))
        state = self.settled_state(rig, omega, volts)
        seen = (self._reads @ np.append(state, omega))[: self.law.entries]
        state[self._past.stop :] = self.law.resting(seen, volts)
        return state

    def settled_state(self, rig: FloatArray, setpoint: float, volts: float) -> FloatArray:
        """State whose filters have seen the present velocities for long, shape (n,).

        Args:
            rig: twist, omega_u, omega_l and more, rad and rad/s.
            setpoint: rad/s.
            volts: held last, V.
        """
        state = np.zeros(self.size)
        state[:_RIG] = rig[:_RIG]
        if self._filter is not None:
            rest = _filter_rest(self.config)
            for i in self._discs:
                state[_RIG + 3 * i : _RIG + 3 * i + 3] = rest * rig[1 + i]
        state[self.voltage] = volts
        frame = [*state[self._measured], volts]
        state[self._past] = frame * ((self._past.stop - self._past.start) // len(frame))
        state[self._past.stop :] = self.law.fresh(self._reads @ np.append(state, setpoint))
        return state

    def advance(
        self, state: FloatArray, duration: float, setpoint: float, modes: IntArray | None = None,
        sensitivity: bool = True,
    ) -> ControlPeriod:  # fmt: skip
        """One control period of `duration` s, its encoder samples spread evenly over it.

        Raises:
            CycleError: the integration or the controller failed.
        """
        rows = self._blank(state, sensitivity)
        acted = self._act(state, setpoint, rows.shape[1], sensitivity)
        if not np.isfinite(acted).all():
            raise CycleError(f"the controller returns no finite voltage at {setpoint:.9g} rad/s")
        limit = self.config.voltage_limit
        if abs(acted[0, 0]) > limit:
            acted[0] = np.sign(acted[0, 0]) * limit * np.eye(1, acted.shape[1])[0]
        run = self._move(state, float(acted[0, 0]), duration, modes, sensitivity)
        return self._collect(rows, acted, run, duration, sensitivity)

    def _act(self, state: FloatArray, setpoint: float, width: int, sens: bool) -> FloatArray:
        """Voltage and new memory, each followed by its derivatives, shape (1 + m, width)."""
        inputs = self._reads @ np.append(state, setpoint)
        if not sens:
            return self.law(inputs[None]).T
        out = np.zeros((1 + self.law.size, width))
        values, slopes = self.law.differentiate(inputs)
        by_reads = slopes @ self._reads
        # Behind the state stands the duration, which the controller does not see.
        out[:, 0], out[:, 1:-2], out[:, -1] = values, by_reads[:, :-1], by_reads[:, -1]
        return out

    def _blank(self, state: FloatArray, sensitivity: bool) -> FloatArray:
        """The state before, each entry followed by its derivatives, shape (n, 1 [+ n + 2])."""
        if not sensitivity:
            return state[:, None]
        return np.hstack([state[:, None], np.eye(self.size), np.zeros((self.size, 2))])

    def _move(
        self, state: FloatArray, volts: float, duration: float, modes: IntArray | None, sens: bool
    ) -> Trajectory:
        samples = self.config.samples if self._filter is not None else 1
        times = duration * np.arange(1, samples + 1) / samples
        times[-1] = duration
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", NegativeFrictionWarning)
                return simulate(
                    self.rig, volts, duration, initial=np.append(state[:_RIG], 0.0), modes=modes,
                    t_eval=times, rtol=self._rtol, atol=0.1 * self._rtol, extrema=True,
                    sensitivity=sens,
                )  # fmt: skip
        except (RuntimeError, InputError) as error:
            raise CycleError(f"a control period failed at {volts:.6g} V: {error}") from error

    def _collect(
        self, rows: FloatArray, acted: FloatArray, run: Trajectory, duration: float, sens: bool
    ) -> ControlPeriod:
        """The loop's state at the end; values and derivatives pass what is linear together."""
        moved = self._samples(rows, acted[0], run, duration, sens)
        new = np.empty_like(rows)
        new[:_RIG] = moved[-1, :_RIG]
        if self._filter is not None:
            start = rows[0], np.zeros(rows.shape[1])
            for i in self._discs:
                # Angles since the start of the period; the upper one is twist + theta_l.
                angles = moved[:, 3] + moved[:, 0] if i == 0 else moved[:, 3]
                steps = np.diff(np.vstack([start[i], angles]), axis=0)
                at = slice(_RIG + 3 * i, _RIG + 3 * i + 3)
                rate = len(angles) / duration
                new[at] = self._filter @ np.vstack([rows[at][1:], _rated(steps, rate, duration)])
        new[self.voltage] = acted[0]
        frame = np.vstack([rows[self._measured], rows[self.voltage]])
        new[self._past] = np.vstack([frame, rows[self._past]])[: self._past.stop - self._past.start]
        new[self._past.stop :] = acted[1:]
        return ControlPeriod(new[:, 0].copy(), new[:, 1:].copy(), float(acted[0, 0]), run)

    def _samples(
        self, rows: FloatArray, acted: FloatArray, run: Trajectory, duration: float, sens: bool
    ) -> FloatArray:
        """Rig states at the encoder samples with their derivatives, (samples, 4, ...)."""
        out = np.zeros((len(run.t), 4, rows.shape[1]))
        out[:, :, 0] = run.state
        if not sens:
            return out
        drive = -self.rig.km * run.sensitivity[:, :, _DRIVE]
        out[:, :, 1:] = run.sensitivity[:, :, :_RIG] @ rows[:_RIG, 1:]
        out[:, :, 1:] += drive[:, :, None] * acted[None, None, 1:]
        rates = np.zeros((len(run.t), 4))
        rates[:, 0], rates[:, 3] = run.omega_u - run.omega_l, run.omega_l
        twist, upper, lower, _ = run.final_state
        mode = run.final_modes
        rates[-1, 1:3] = rates_at(self._p, mode, twist, upper, lower, float(acted[0]))
        out[:, :, -2] += rates * (run.t / duration)[:, None]
        return out


def _rated(steps: FloatArray, rate: float, duration: float) -> FloatArray:
    """Differences of angles as velocities, with their derivatives."""
    velocities = steps * rate
    if velocities.shape[1] > 1:
        velocities[:, -2] -= velocities[:, 0] / duration
    return velocities


def _filter_matrix(config: EnvConfig) -> FloatArray:
    """(velocity, memories) after one period, of the memories before and its differences."""
    b, a = config.encoder.coefficients()
    count = 2 + config.samples
    out = np.zeros((3, count))
    for k, unit in enumerate(np.eye(count)):
        memory, angle, velocity = np.array([0.0, unit[0], unit[1]]), 0.0, 0.0
        for difference in unit[2:].tolist():
            angle += difference
            velocity = float(filter_sample(memory, angle, 1.0, b, a))
        out[:, k] = velocity, memory[1], memory[2]
    return out


def _filter_rest(config: EnvConfig) -> FloatArray:
    """(velocity, memories) of a filter that has seen 1 rad/s for long, shape (3,)."""
    b, a = config.encoder.coefficients()
    second = b[2] - a[2]
    return np.array([1.0, b[1] - a[1] + second, second])
