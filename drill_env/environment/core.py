"""The environments behind both the scalar and the vector interface, one per row."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from drill_env._checks import real_array
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.effects.declared import Declared, declared
from drill_env.environment import targets
from drill_env.environment._extended import Extension, start_extended, step_extended
from drill_env.environment._kernel import start_row, step_rows
from drill_env.environment._layout import lay_out
from drill_env.environment._records import (
    REWARD_TERMS,
    ROW,
    SETTING,
    VIEWS,
    Rows,
    new_buffers,
)
from drill_env.environment._reset_options import ResetOptions, checked_reset
from drill_env.environment._starts import place
from drill_env.environment.config import SPEED_BOUND, TWIST_BOUND, EnvConfig
from drill_env.friction import kernel_record
from drill_env.friction.kernels import fill_clamp
from drill_env.integrator.tableau import tableau
from drill_env.parameters import uncertainty
from drill_env.parameters.uncertainty import perturb_record

_NEVER = -1
_NOISE_ROWS = 128


class EnvCore:
    """Arrays of `n` environments and the compiled functions that move them.

    Args:
        config: options, the same for all rows.
        n: number of environments.
    """

    def __init__(self, config: EnvConfig, n: int) -> None:
        self.config = config
        self.n = n
        self.nominal = kernel_record(config.rig)
        self.spread = uncertainty(config.uncertainty)
        self.low, self.high = self._bounds()
        self.rows = self._rows()
        self.row = self.rows.row
        self.setting = self._setting()
        self.buffers = new_buffers(config.samples, config.control_period, config.rtol)
        self.settling = new_buffers(1, config.control_period, 1e-7)
        self.effects, self.extension = self._extended()
        self.nobody = np.zeros(n, dtype=np.bool_)
        self._rngs: dict[int, np.random.Generator] = {}

    def _rows(self) -> Rows:
        n, encoder = self.n, self.config.encoder
        slots = max(1, len(self.config.schedule))
        ring = round(self._largest_delay() * encoder.rate_hz) + 1
        noisy = _NOISE_ROWS if encoder.is_random else 0
        try:
            return Rows(
                row=np.zeros(n, dtype=ROW),
                ring=np.zeros((n, ring, 2)),
                schedule_steps=np.full((n, slots), _NEVER, dtype=np.int64),
                schedule_values=np.zeros((n, slots)),
                noise=np.zeros((n, noisy, self.config.samples, 4)),
                observation=np.zeros((n, len(self.low)), dtype=np.float32),
            )
        except (MemoryError, OverflowError, ValueError) as error:
            raise InputError(
                f"num_envs is {n}: so many do not fit into the memory; give fewer, or a shorter "
                "history, delay or schedule"
            ) from error

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.row, kept = self.rows.row, self.extension
        # Addresses mean nothing in another process or to a copy.
        self.effects, self.extension = self._extended()
        if kept is not None and self.extension is not None:
            self.extension.volts[:], self.extension.past[:] = kept.volts, kept.past

    def _extended(self) -> tuple[Declared, Extension | None]:
        effects = declared(self.config.rig)
        if not self.config.rig.effects:
            return effects, None
        return effects, lay_out(self.config, self.n, effects, self.buffers)

    def _largest_delay(self) -> float:
        return self.config.encoder.delay_s + max(self.spread.delay_s, 0.2)

    def _bounds(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        limit = self.config.voltage_limit
        measured = [TWIST_BOUND, SPEED_BOUND, SPEED_BOUND]
        if self.config.observation == "surface":
            measured = [SPEED_BOUND]
        past = [*measured, limit] * int(self.config.history)
        high = np.array([*measured, targets.SETPOINT_BOUND, limit, *past], dtype=np.float32)
        low = -high
        low[len(measured)] = 0.0
        return low, high

    def _setting(self) -> np.ndarray:
        c, out = self.config, np.zeros(1, dtype=SETTING)
        out["period"], out["samples"] = c.control_period, c.samples
        out["quantum"], out["noise_rad"] = c.encoder.quantum, c.encoder.noise_rad
        out["missed"], out["rate"] = c.encoder.missed_per_count, c.encoder.rate_hz
        out["b"], out["a"] = c.encoder.coefficients()
        out["limit"], out["shown"] = c.voltage_limit, VIEWS.index(c.observation)
        weights = [getattr(c.reward, name) for name in (*REWARD_TERMS, "width", "stick_speed")]
        out["weights"] = weights
        out["bounds"][0, : c.n_measured] = self.high[: c.n_measured]
        return out

    def observation_space(self) -> Any:
        """Space of one environment's observation."""
        return spaces.Box(self.low, self.high, dtype=np.float32)

    def action_space(self) -> Any:
        """Space of one environment's action."""
        limit = 1.0 if self.config.action == "normalized" else self.config.voltage_limit
        return spaces.Box(-limit, limit, (1,), dtype=np.float32)

    def volts(self, action: Any) -> FloatArray:
        """Voltages (V) that an action stands for, shape (n,).

        Args:
            action: real numbers of any type, shape (n, 1) or (n,); those beyond the limit are
                clipped by `step`.

        Raises:
            InputError: the shape is another, or an entry is no finite real number.
        """
        values = real_array(action, "action")
        if values.shape not in ((self.n, 1), (self.n,)) and (values.ndim, self.n) != (0, 1):
            wanted = f"{self.n} voltages, shape ({self.n}, 1)" if self.n > 1 else "shape (1,)"
            raise InputError(f"action has shape {values.shape}: give {wanted}")
        volts = values.reshape(-1)
        if self.config.action == "normalized":
            # Clipped first: the largest floats would overflow.
            volts = np.clip(volts, -1.0, 1.0) * self.config.voltage_limit
        return volts

    def step(self, volts: FloatArray, skip: NDArray[np.bool_] | None = None) -> None:
        """Carry all environments, but those to `skip`, over one control period."""
        if self.rows.noise.shape[1]:
            for i in np.flatnonzero(self.row["noise_row"] >= _NOISE_ROWS):
                self._draw_noise(int(i))
        skip = self.nobody if skip is None else skip
        pair = tableau(self.config.method, effects=self.effects.acts)[0]
        plain = (0, self.n, skip, volts, self.rows, self.setting[0], pair, self.buffers)
        if self.extension is None:
            failed = step_rows(*plain)
        else:
            failed = step_extended(*plain, self.extension)
        if failed >= 0:
            raise RuntimeError(f"integration failed in environment {failed}: step size collapsed")

    def truncated(self) -> NDArray[np.bool_]:
        """Which environments have reached the end of their episode."""
        return self.row["step"] >= self.config.episode_steps

    # -- resets ------------------------------------------------------------------

    def checked(self, options: Any) -> ResetOptions:
        """Options of a reset, checked; nothing is changed yet.

        Raises:
            InputError: an option is unknown or out of range.
        """
        longest = self.rows.schedule_steps.shape[1]
        return checked_reset(options, self.config, longest, self._largest_delay())

    def reset(self, i: int, rng: np.random.Generator, options: ResetOptions) -> None:
        """Start a new episode in row `i`.

        Args:
            i: row.
            rng: the row's generator; every reset draws the same count of numbers.
            options: from `checked`.
        """
        self._rngs[i] = rng
        uniforms = rng.random(16)
        row = self.row[i]
        delay = self._draw_plant(row, uniforms[:8], options)
        row["step"] = 0
        row["delay"] = min(round(delay * self.config.encoder.rate_hz), self.rows.ring.shape[1] - 1)
        row["run"]["h"] = 1e-3
        row["run"]["y"] = 0.0
        setpoint = self._set_targets(i, uniforms[8], options)
        self._set_friction_step(row, uniforms[9:11], options)
        place(row, self.config, setpoint, uniforms[11:16], options, self.settling)
        if self.rows.noise.shape[1]:
            self._draw_noise(i)
        if self.extension is None:
            start_row(i, self.rows, self.setting[0])
        else:
            pair = tableau(self.config.method, effects=self.effects.acts)[0]
            start_extended(i, self.rows, self.setting[0], pair, self.buffers, self.extension)

    def _draw_plant(self, row: Any, uniforms: FloatArray, options: ResetOptions) -> float:
        factors = self.spread.draw(uniforms)
        if options.rig is None:
            row["p"] = self.nominal[0]
            perturb_record(row["p"], factors)
            if self.config.rig.clamp:
                fill_clamp(row["p"])
        else:
            row["p"] = kernel_record(options.rig)[0]
        drawn = self.config.encoder.delay_s + float(factors[7])
        return drawn if options.delay_s is None else options.delay_s

    def _set_targets(self, i: int, uniform: float, options: ResetOptions) -> float:
        low, high = self.config.setpoint_range
        setpoint = low + (high - low) * uniform if options.setpoint is None else options.setpoint
        steps, values = self.rows.schedule_steps, self.rows.schedule_values
        steps[i] = _NEVER
        for k, (time, value) in enumerate(options.schedule):
            steps[i, k] = round(time / self.config.control_period)
            values[i, k] = value
            setpoint = values[i, k] if steps[i, k] == 0 else setpoint
        self.row[i]["setpoint"] = setpoint
        return float(setpoint)

    def _set_friction_step(self, row: Any, uniforms: FloatArray, options: ResetOptions) -> None:
        row["friction_step"] = _NEVER
        if options.friction_step is None:
            return
        (early, late), (low, high) = options.friction_step
        time = early + (late - early) * uniforms[0]
        row["friction_step"] = round(time / self.config.control_period)
        row["friction_factor"] = low + (high - low) * uniforms[1]

    def _draw_noise(self, i: int) -> None:
        noise, rng = self.rows.noise, self._rngs[i]
        noise[i, :, :, :2] = rng.standard_normal((*noise.shape[1:3], 2))
        noise[i, :, :, 2:] = rng.random((*noise.shape[1:3], 2))
        self.row[i]["noise_row"] = 0
