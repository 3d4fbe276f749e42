"""The environments behind both the scalar and the vector interface, one per row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.dynamics import equilibrium_state, equilibrium_voltage
from drill_env.environment import _layout as at
from drill_env.environment._kernel import (
    Arrays,
    Setting,
    new_work,
    settle_on_cycle,
    start_row,
    step_rows,
)
from drill_env.environment.config import (
    SETPOINT_BOUND,
    SPEED_BOUND,
    TWIST_BOUND,
    EnvConfig,
    Start,
    check_setpoint,
)
from drill_env.integrator._tableau import TABLEAUX
from drill_env.parameters import Rig, uncertainty
from drill_env.parameters.uncertainty import perturb_vector

_NEVER = -1
_NOISE_ROWS = 128
_SETTLE_S, _WATCH_S = 30.0, 14.0
_RESET_KEYS = {"setpoint", "schedule", "start", "state", "phase", "rig", "delay_s", "friction_step"}


class EnvCore:
    """Arrays of `n` environments and the compiled functions that move them.

    Args:
        config: options, the same for all rows.
        n: number of environments.
    """

    def __init__(self, config: EnvConfig, n: int) -> None:
        self.config = config
        self.n = n
        self.nominal = config.rig.vector()
        self.spread = uncertainty(config.uncertainty)
        self.low, self.high = self._bounds()
        slots = max(1, len(config.schedule))
        ring = round(self._largest_delay() * config.encoder.rate_hz) + 1
        noisy = _NOISE_ROWS if config.encoder.is_random else 0
        self.arrays = Arrays(
            p=np.tile(self.nominal, (n, 1)),
            floats=np.zeros((n, at.N_FLOATS)),
            ints=np.zeros((n, at.N_INTS), dtype=np.int64),
            history=np.zeros((n, ring, 2)),
            schedule_steps=np.full((n, slots), _NEVER, dtype=np.int64),
            schedule_values=np.zeros((n, slots)),
            noise=np.zeros((n, noisy, config.samples, 4)),
            reward=np.zeros(n),
            info=np.zeros((n, len(at.INFO))),
            observation=np.zeros((n, len(self.low)), dtype=np.float32),
        )
        self.setting = self._setting()
        self.tableau = TABLEAUX[config.method]
        self.nobody = np.zeros(n, dtype=np.bool_)
        self.work = new_work(config.samples, config.control_period)
        self._cycle = np.zeros(4)
        self._rngs: dict[int, np.random.Generator] = {}

    def _largest_delay(self) -> float:
        return self.config.encoder.delay_s + max(self.spread.delay_s, 0.2)

    def _bounds(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        limit = self.config.voltage_limit
        measured = [TWIST_BOUND, SPEED_BOUND, SPEED_BOUND]
        if self.config.observation == "surface":
            measured = [SPEED_BOUND]
        past = [*measured, limit] * int(self.config.history)
        high = np.array([*measured, SETPOINT_BOUND, limit, *past], dtype=np.float32)
        low = -high
        low[len(measured)] = 0.0
        return low, high

    def _setting(self) -> Setting:
        c, w = self.config, self.config.reward
        b, a = c.encoder.coefficients()
        weights = [w.track, w.error, w.twist_rate, w.stick, w.effort, w.width, w.stick_speed]
        return Setting(
            float(c.control_period), c.samples, c.encoder.quantum, float(c.encoder.noise_rad),
            float(c.encoder.missed_per_count), float(c.encoder.rate_hz), b, a,
            float(c.voltage_limit), np.array(weights, dtype=float), float(c.rtol),
            ("both", "surface", "state").index(c.observation), self.high.astype(float),
        )  # fmt: skip

    def observation_space(self) -> spaces.Box:
        """Space of one environment's observation."""
        return spaces.Box(self.low, self.high, dtype=np.float32)

    def action_space(self) -> spaces.Box:
        """Space of one environment's action."""
        limit = 1.0 if self.config.action == "normalized" else self.config.voltage_limit
        return spaces.Box(-limit, limit, (1,), dtype=np.float32)

    def volts(self, actions: NDArray[Any]) -> FloatArray:
        """Voltages (V) that actions of any float type stand for."""
        scale = self.config.voltage_limit if self.config.action == "normalized" else 1.0
        volts = np.asarray(actions, dtype=np.float64).reshape(-1) * scale
        if not np.isfinite(volts).all():
            raise InputError("action holds NaN or infinity: give finite voltages")
        return volts

    def step(self, volts: FloatArray, skip: NDArray[np.bool_] | None = None) -> None:
        """Carry all environments, but those to `skip`, over one control period."""
        if self.arrays.noise.shape[1]:
            due = np.flatnonzero(self.arrays.ints[:, at.NOISE_ROW] >= _NOISE_ROWS)
            for i in due:
                self._draw_noise(int(i))
        skip = self.nobody if skip is None else skip
        failed = step_rows(
            0, self.n, skip, volts, self.arrays, self.setting, self.tableau, self.work
        )
        if failed >= 0:
            raise RuntimeError(f"integration failed in environment {failed}: step size collapsed")

    def truncated(self) -> NDArray[np.bool_]:
        """Which environments have reached the end of their episode."""
        return self.arrays.ints[:, at.STEP] >= self.config.episode_steps

    # -- resets ------------------------------------------------------------------

    def reset(self, i: int, rng: np.random.Generator, options: Mapping[str, Any] | None) -> None:
        """Start a new episode in row `i`.

        Args:
            i: row.
            rng: the row's generator; every reset draws the same count of numbers.
            options: see `DrillStringEnv.reset`.

        Raises:
            InputError: an option is unknown or out of range.
        """
        options = options or {}
        unknown = sorted(set(options) - _RESET_KEYS)
        if unknown:
            raise InputError(f"unknown reset option {unknown[0]}; known: {sorted(_RESET_KEYS)}")
        if self.arrays.noise.shape[1]:
            self._rngs[i] = rng
        uniforms = rng.random(16)
        delay = self._draw_plant(i, uniforms[:8], options)
        ints, floats = self.arrays.ints[i], self.arrays.floats[i]
        ints[at.STEP] = 0
        rate = self.config.encoder.rate_hz
        ints[at.DELAY] = min(round(delay * rate), self.arrays.history.shape[1] - 1)
        floats[at.STEP_SIZE] = 1e-3
        setpoint = self._set_targets(i, uniforms[8], options)
        self._set_friction_step(i, uniforms[9:11], options)
        floats[:4] = 0.0
        self._place(i, setpoint, uniforms[11:16], options)
        if self.arrays.noise.shape[1]:
            self._draw_noise(i)
        start_row(i, self.arrays, self.setting, self.work)

    def _draw_plant(self, i: int, uniforms: FloatArray, options: Mapping[str, Any]) -> float:
        factors = self.spread.draw(uniforms)
        rig = options.get("rig")
        if rig is None:
            self.arrays.p[i] = self.nominal
            perturb_vector(self.arrays.p[i], factors)
        elif isinstance(rig, Rig):
            self.arrays.p[i] = rig.vector()
        else:
            raise InputError("reset option rig must be a drill_env.Rig")
        return float(options.get("delay_s", self.config.encoder.delay_s + factors[7]))

    def _set_targets(self, i: int, uniform: float, options: Mapping[str, Any]) -> float:
        config = self.config
        low, high = config.setpoint_range
        setpoint = low + (high - low) * uniform
        if config.setpoint is not None:
            setpoint = config.setpoint
        setpoint = check_setpoint(options.get("setpoint", setpoint))
        schedule: Sequence[tuple[float, float]] = options.get("schedule", config.schedule)
        steps, values = self.arrays.schedule_steps, self.arrays.schedule_values
        if len(schedule) > steps.shape[1]:
            raise InputError(
                f"schedule has {len(schedule)} entries; this environment was made for "
                f"{steps.shape[1]}: pass the longest schedule to gym.make"
            )
        steps[i] = _NEVER
        for k, (time, value) in enumerate(schedule):
            steps[i, k] = round(time / config.control_period)
            values[i, k] = check_setpoint(value)
            setpoint = values[i, k] if steps[i, k] == 0 else setpoint
        self.arrays.floats[i, at.SETPOINT] = setpoint
        return float(setpoint)

    def _set_friction_step(self, i: int, uniforms: FloatArray, options: Mapping[str, Any]) -> None:
        span = options.get("friction_step", self.config.friction_step)
        self.arrays.ints[i, at.FRICTION_STEP] = _NEVER
        if span is None:
            return
        (early, late), (low, high) = span
        if not (0 <= early <= late and 0 <= low <= high):
            raise InputError(f"friction_step is {span}: give ((early, late), (low, high)) ascending")
        time = early + (late - early) * uniforms[0]
        self.arrays.ints[i, at.FRICTION_STEP] = round(time / self.config.control_period)
        self.arrays.floats[i, at.FRICTION_FACTOR] = low + (high - low) * uniforms[1]

    def _place(
        self, i: int, setpoint: float, uniforms: FloatArray, options: Mapping[str, Any]
    ) -> None:
        start: Start = options.get("start", "state" if "state" in options else self.config.start)
        if start not in get_args(Start):
            raise InputError(f"start is {start!r}: give one of {', '.join(get_args(Start))}")
        if start == "random":
            start = ("rest", "limit_cycle", "ring")[min(int(3 * uniforms[0]), 2)]
        limit = self.config.voltage_limit
        steady = min(float(equilibrium_voltage(self.config.rig, setpoint)), limit)
        floats = self.arrays.floats[i]
        floats[at.VOLTAGE] = 0.0 if start in ("rest", "state") else steady
        if start == "state":
            floats[:4] = _explicit_state(options.get("state"))
        elif start == "equilibrium":
            floats[:4] = equilibrium_state(self.config.rig, setpoint)
        elif start == "ring":
            rig = self.config.rig
            pulse = np.sqrt(rig.ktheta / rig.Jl)
            radius, angle = setpoint / pulse * uniforms[1], 2.0 * np.pi * uniforms[2]
            floats[:4] = equilibrium_state(rig, setpoint)
            floats[at.TWIST] += radius * np.cos(angle)
            floats[at.OMEGA_L] += radius * pulse * np.sin(angle)
        elif start == "limit_cycle":
            phase = float(options.get("phase", uniforms[3]))
            tableau = TABLEAUX["dop853"]
            p = self.arrays.p[i]
            if not settle_on_cycle(
                p, self._cycle, steady, phase, _SETTLE_S, _WATCH_S, tableau, self.work
            ):
                raise RuntimeError("integration failed while settling on the limit cycle")
            floats[:4] = self._cycle

    def _draw_noise(self, i: int) -> None:
        noise = self.arrays.noise
        rng = self._rngs[i]
        noise[i, :, :, :2] = rng.standard_normal(noise.shape[1:3] + (2,))
        noise[i, :, :, 2:] = rng.random(noise.shape[1:3] + (2,))
        self.arrays.ints[i, at.NOISE_ROW] = 0


def _explicit_state(state: Any) -> FloatArray:
    given = np.asarray([] if state is None else state, dtype=float)
    if given.shape not in ((3,), (4,)) or not np.isfinite(given).all():
        raise InputError(
            "reset option state must be three or four finite numbers: twist (rad), omega_u, "
            "omega_l (rad/s), theta_l (rad)"
        )
    return np.append(given, 0.0)[:4]
