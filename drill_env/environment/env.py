"""`DrillString-v0` and `DrillStringSurface-v0`: one rig behind the Gymnasium interface."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from drill_env._checks import whole
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.environment._info import one_info
from drill_env.environment._render import Frame, Renderer
from drill_env.environment.config import EnvConfig
from drill_env.environment.core import EnvCore
from drill_env.parameters import Rig


class DrillStringEnv(gym.Env[NDArray[np.float32], NDArray[np.float32]]):
    """Hold the lower disc at a set point without stick-slip.

    Action, shape (1,): motor voltage in V within +- `voltage_limit`, held for one control
    period; or its share of the limit with ``action="normalized"``.

    Observation (float32), in this order:

    ==========================  ======  ===========  =====================================
    entry                       unit    bounds       what
    ==========================  ======  ===========  =====================================
    twist                       rad     +-100        encoder theta_u - theta_l (not surface)
    omega_u                     rad/s   +-150        upper encoder, differentiated, filtered
    omega_l                     rad/s   +-150        lower encoder, likewise (not surface)
    setpoint                    rad/s   0 ... 60     wanted lower-disc velocity
    voltage                     V       +-limit      voltage of the last period
    past frames                                      `history` times (measurements, voltage)
    ==========================  ======  ===========  =====================================

    With ``observation="state"`` the first three are exact. Reward: see `RewardWeights`;
    its parts and the truth behind the encoders are in ``info``. Episodes are truncated
    after `episode_seconds` and never terminate.

    Args:
        render_mode: "human", "rgb_array" or None.
        **options: fields of `EnvConfig`.

    Raises:
        InputError: an option is unknown or out of range.
    """

    metadata = {  # pyright: ignore
        "render_modes": ["human", "rgb_array"],
        "render_fps": 20,
    }

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise InputError(f"render_mode is {render_mode!r}: give human, rgb_array or None")
        self.config = EnvConfig.from_options(options)
        self.metadata = {**self.metadata, "render_fps": round(1.0 / self.config.control_period)}
        self.render_mode = render_mode
        self._core = EnvCore(self.config, 1)
        self.observation_space = self._core.observation_space()
        self.action_space = self._core.action_space()
        self._renderer: Renderer | None = None
        self._started = False

    def __getstate__(self) -> dict[str, Any]:
        # Pictures belong to a process: a copy draws its own, its traces begin anew.
        return {**self.__dict__, "_renderer": None}

    @property
    def rig(self) -> Rig:
        """The nominal rig."""
        return self.config.rig

    @property
    def state(self) -> FloatArray:
        """True (twist, omega_u, omega_l, theta_l), a copy."""
        return self._core.row["run"]["y"][0].copy()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: seeds the environment's generator.
            options: any of ``setpoint`` (rad/s), ``schedule`` ((time, set point) pairs),
                ``start``, ``state`` (twist, omega_u, omega_l[, theta_l]), ``phase`` of the
                limit cycle (0 to 1), ``rig``, ``delay_s``, ``friction_step``.

        Raises:
            InputError: an option is unknown or out of range, or the seed is no whole number from
                0 on; the episode and the generator are as before.
        """
        checked = self._core.checked(options)
        super().reset(seed=None if seed is None else whole(seed, "seed", 0))
        self._core.reset(0, self.np_random, checked)
        self._started = True
        if self._renderer is not None:
            self._renderer.reset()
        if self.render_mode == "human":
            self.render()
        return self._core.rows.observation[0].copy(), one_info(self._core)

    def step(
        self, action: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold the voltage for one control period.

        After the end of the episode the rig goes on, and every step is truncated again.

        Raises:
            InputError: `reset` was not called, or the action is not one finite real number; the
                state is as before.
        """
        if not self._started:
            raise InputError("call reset() before step()")
        core = self._core
        core.step(core.volts(action))
        if self.render_mode == "human":
            self.render()
        row = core.row[0]
        truncated = bool(row["step"] >= self.config.episode_steps)
        observation = core.rows.observation[0].copy()
        return observation, float(row["reward"]), False, truncated, one_info(core)

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the discs, the string and the recent traces."""
        if self.render_mode is None:
            gym.logger.warn("render() without render_mode: give one to gym.make")
            return None
        if self._renderer is None:
            fps = self.metadata["render_fps"]
            self._renderer = Renderer(self.render_mode, fps=fps)  # pyright: ignore
        return self._renderer.draw(_frame(self._core))

    def close(self) -> None:
        """Close the window, if any."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None


def _frame(core: EnvCore) -> Frame:
    row = core.row[0]
    twist, omega_u, omega_l, theta_l = (float(v) for v in row["run"]["y"])
    return Frame(
        t=float(row["step"]) * core.config.control_period, theta_u=twist + theta_l,
        theta_l=theta_l, omega_u=omega_u, omega_l=omega_l, setpoint=float(row["setpoint"]),
        voltage=float(row["voltage"]), voltage_limit=core.config.voltage_limit,
        stuck_u=bool(row["run"]["mode"][0] == 0), stuck_l=bool(row["run"]["mode"][1] == 0),
        reward=float(row["reward"]),
    )  # fmt: skip


class DrillStringSurfaceEnv(DrillStringEnv):
    """`DrillStringEnv` that sees the upper encoder alone: a rig without downhole measurement."""

    def __init__(self, render_mode: str | None = None, **options: Any) -> None:
        super().__init__(render_mode, **{"observation": "surface", **options})
