"""Many rigs at once, stepped by one compiled call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from drill_env._checks import whole
from drill_env._errors import InputError, printable
from drill_env.environment._info import all_info, masked
from drill_env.environment._reset_options import ResetOptions
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
        num_envs = whole(num_envs, "num_envs", 1)
        if render_mode is not None:
            raise InputError("the vector environment does not render; use gym.make for pictures")
        if not isinstance(truth, bool):
            raise InputError(f"truth is {printable(repr(truth), 60)}: give True or False")
        self.config = EnvConfig.from_options(options)
        self.num_envs = num_envs
        self.render_mode = render_mode
        self.truth = truth
        self.autoreset_mode = _checked_mode(autoreset_mode, self.config)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self._core = EnvCore(self.config, num_envs)
        self.single_observation_space = self._core.observation_space()
        self.single_action_space = self._core.action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._rngs: list[np.random.Generator] = []
        self._done = np.zeros(num_envs, dtype=np.bool_)
        self._everyone = np.ones(num_envs, dtype=np.bool_)
        self._unstarted = self._everyone.copy()

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

        Raises:
            InputError: an option or a seed is no such; all environments are as before.
        """
        mask: Any = self._everyone
        if isinstance(options, Mapping) and "reset_mask" in options:
            mask = np.asarray(options["reset_mask"])
            options = {key: value for key, value in options.items() if key != "reset_mask"}
        if mask.shape != (self.num_envs,) or mask.dtype != np.bool_:
            raise InputError(
                f"reset_mask has shape {mask.shape} and type {mask.dtype}: give ({self.num_envs},) "
                "truth values"
            )
        seeds, checked = self._seeds(seed), self._core.checked(options)
        return self._reset(seeds, [checked] * self.num_envs, mask)

    def reset_each(
        self, seed: int | Sequence[int | None] | None, options: Sequence[dict[str, Any] | None]
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode in every environment, each with reset options of its own."""
        if not isinstance(options, Sequence) or len(options) != self.num_envs:
            raise InputError(
                f"options is {printable(repr(options), 60)}: give {self.num_envs} dictionaries"
            )
        checked = [self._core.checked(each) for each in options]
        return self._reset(self._seeds(seed), checked, self._everyone)

    def _seeds(self, seed: Any) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, (str, bytes, Mapping)) or not hasattr(seed, "__len__"):
            first = whole(seed, "seed", 0)
            return [first + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise InputError(f"seed has {len(seed)} entries: give {self.num_envs}")
        return [None if each is None else whole(each, "seed", 0) for each in seed]

    def _reset(
        self, seeds: list[int | None], options: list[ResetOptions], mask: NDArray[np.bool_]
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        if not self._rngs:
            self._rngs = [seeding.np_random(None)[0] for _ in range(self.num_envs)]
        for i in np.flatnonzero(mask).tolist():
            if seeds[i] is not None:
                self._rngs[i] = seeding.np_random(seeds[i])[0]
            self._core.reset(i, self._rngs[i], options[i])
        self._done &= ~mask
        self._unstarted &= ~mask
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
        """Hold one voltage per environment for one control period.

        Raises:
            InputError: an environment was never reset, has ended and does not restart by itself,
                or the actions are not so many finite real numbers; all states are as before.
        """
        core = self._core
        if self._unstarted.any():
            raise InputError("call reset() of every environment before step()")
        volts = core.volts(actions)
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
        usual = self._core.checked(None)
        for i in np.flatnonzero(mask).tolist():
            self._core.reset(i, self._rngs[i], usual)

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


def _checked_mode(given: Any, config: EnvConfig) -> AutoresetMode:
    try:
        mode = AutoresetMode(given)
    except ValueError as error:
        names = ", ".join(each.value for each in AutoresetMode)
        raise InputError(
            f"autoreset_mode is {printable(repr(given), 60)}: give one of {names}"
        ) from error
    if config.start == "state" and mode is not AutoresetMode.DISABLED:
        raise InputError(
            "start is state: an episode that restarts by itself is given none; make the vector "
            'environment with another start, or autoreset_mode="Disabled"'
        )
    return mode


class DrillStringSurfaceVectorEnv(DrillStringVectorEnv):
    """`DrillStringVectorEnv` that sees the upper encoder alone."""

    def __init__(self, num_envs: int = 1, render_mode: str | None = None, **options: Any) -> None:
        super().__init__(num_envs, render_mode, **{"observation": "surface", **options})
