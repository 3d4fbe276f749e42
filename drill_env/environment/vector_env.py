"""Many rigs at once, stepped by one compiled call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from drill_env._errors import InputError
from drill_env.environment._info import all_info, masked
from drill_env.environment.config import EnvConfig
from drill_env.environment.core import EnvCore


class DrillStringVectorEnv(VectorEnv[NDArray[np.float32], NDArray[Any], Any]):
    """`num_envs` independent `DrillStringEnv`, bit-identical to them for the same seeds.

    Args:
        num_envs: number of environments.
        render_mode: must be None; render a scalar environment instead.
        autoreset_mode: `AutoresetMode.NEXT_STEP`, ``SAME_STEP`` or ``DISABLED``.
        truth: whether ``info`` carries the truth behind the sensors; off saves time.
        **options: fields of `EnvConfig`.

    Raises:
        InputError: an option is unknown or out of range.
    """

    metadata = {  # pyright: ignore
        "render_modes": [],
        "autoreset_mode": AutoresetMode.NEXT_STEP,
    }

    def __init__(
        self,
        num_envs: int = 1,
        render_mode: str | None = None,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        truth: bool = True,
        **options: Any,
    ) -> None:
        if num_envs < 1:
            raise InputError(f"num_envs is {num_envs}: give 1 or more")
        if render_mode is not None:
            raise InputError("the vector environment does not render; use gym.make for pictures")
        self.config = EnvConfig.from_options(options)
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.truth = truth
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self._core = EnvCore(self.config, num_envs)
        self.single_observation_space = self._core.observation_space()
        self.single_action_space = self._core.action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rngs: list[np.random.Generator] = []
        self._done = np.zeros(num_envs, dtype=np.bool_)
        self._everyone = np.ones(num_envs, dtype=np.bool_)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode in every environment.

        Args:
            seed: environment i gets ``seed + i``, or ``seed[i]``.
            options: as `DrillStringEnv.reset`, the same for all; ``reset_mask`` (booleans)
                resets only some.
        """
        options = dict(options or {})
        mask = np.asarray(options.pop("reset_mask", self._everyone), dtype=np.bool_)
        if mask.shape != (self.num_envs,):
            raise InputError(f"reset_mask has shape {mask.shape}: give ({self.num_envs},)")
        return self._reset(seed, [options] * self.num_envs, mask)

    def reset_each(
        self, seed: int | Sequence[int | None] | None, options: Sequence[dict[str, Any]]
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode in every environment, each with reset options of its own."""
        if len(options) != self.num_envs:
            raise InputError(f"options has {len(options)} entries: give {self.num_envs}")
        return self._reset(seed, options, self._everyone)

    def _reset(
        self,
        seed: int | Sequence[int | None] | None,
        options: Sequence[dict[str, Any]],
        mask: NDArray[np.bool_],
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed
        if seeds is not None and len(seeds) != self.num_envs:
            raise InputError(f"seed has {len(seeds)} entries: give {self.num_envs}")
        if not self._rngs:
            self._rngs = [seeding.np_random(None)[0] for _ in range(self.num_envs)]
        for i in np.flatnonzero(mask).tolist():
            given = None if seeds is None else seeds[i]
            if given is not None:
                self._rngs[i] = seeding.np_random(given)[0]
            self._core.reset(i, self._rngs[i], options[i])
        self._done &= ~mask
        return self._core.rows.observation.copy(), self._info(mask)

    def step(
        self, actions: NDArray[Any]
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float64],
        NDArray[np.bool_],
        NDArray[np.bool_],
        dict[str, Any],
    ]:
        """Hold one voltage per environment for one control period."""
        core = self._core
        if not self._rngs:
            raise InputError("call reset() before step()")
        volts = core.volts(actions)
        if len(volts) != self.num_envs:
            raise InputError(f"actions hold {len(volts)} voltages: give {self.num_envs}")
        if self.autoreset_mode is AutoresetMode.DISABLED and self._done.any():
            raise InputError("an environment has ended: reset it with options={'reset_mask': ...}")
        over = self._done if self.autoreset_mode is AutoresetMode.NEXT_STEP else core.nobody
        core.step(volts, over)
        reward = core.row["reward"].copy()
        if over.any():
            reward[over] = 0.0
            self._restart(over)
        truncated = core.truncated()
        info: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and truncated.any():
            info = self._final(truncated)
            self._restart(truncated)
        else:
            self._done = truncated
        info.update(self._info(self._everyone))
        terminated = np.zeros(self.num_envs, dtype=np.bool_)
        return core.rows.observation.copy(), reward, terminated, truncated, info

    def _restart(self, mask: NDArray[np.bool_]) -> None:
        for i in np.flatnonzero(mask).tolist():
            self._core.reset(i, self._rngs[i], None)

    def _final(self, mask: NDArray[np.bool_]) -> dict[str, Any]:
        final = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(mask):
            final[i] = self._core.rows.observation[i].copy()
        out: dict[str, Any] = {"final_obs": final, "_final_obs": mask}
        if self.truth:
            out["final_info"], out["_final_info"] = masked(all_info(self._core), mask), mask
        return out

    def _info(self, mask: NDArray[np.bool_]) -> dict[str, Any]:
        return masked(all_info(self._core), mask) if self.truth else {}


class DrillStringSurfaceVectorEnv(DrillStringVectorEnv):
    """`DrillStringVectorEnv` that sees the upper encoder alone."""

    def __init__(self, num_envs: int = 1, render_mode: str | None = None, **options: Any) -> None:
        super().__init__(num_envs, render_mode, **{"observation": "surface", **options})
