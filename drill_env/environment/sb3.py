"""The native vector environment as a stable-baselines3 `VecEnv`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from stable_baselines3.common.vec_env.base_vec_env import VecEnv, VecEnvIndices

from drill_env._errors import InputError
from drill_env.environment.vector_env import DrillStringVectorEnv


class DrillStringVecEnv(VecEnv):
    """Adapter with the rules of stable-baselines3.

    An episode that ends is restarted within the same step; its last observation is in
    ``info["terminal_observation"]``, and ``info["TimeLimit.truncated"]`` tells the
    algorithm to bootstrap. Episode return and length are in ``info["episode"]``.

    Args:
        num_envs: number of environments.
        **options: as `DrillStringVectorEnv`; `truth` is off by default, for speed.
    """

    def __init__(self, num_envs: int, **options: Any) -> None:
        if "autoreset_mode" in options:
            raise InputError("autoreset_mode is fixed to SAME_STEP by stable-baselines3")
        options.setdefault("truth", False)
        self.env = DrillStringVectorEnv(num_envs, autoreset_mode=AutoresetMode.SAME_STEP, **options)
        self.render_mode = None
        self._actions = np.zeros((num_envs, 1), dtype=np.float32)
        self._returns = np.zeros(num_envs)
        self._lengths = np.zeros(num_envs, dtype=np.int64)
        super().__init__(num_envs, self.env.single_observation_space, self.env.single_action_space)

    def reset(self) -> NDArray[np.float32]:
        """Start an episode in every environment, with the seeds set before."""
        seeds = None if all(s is None for s in self._seeds) else self._seeds
        observation, _ = self.env.reset_each(seeds, self._options)
        self._reset_seeds()
        self._reset_options()
        self._returns[:] = 0.0
        self._lengths[:] = 0
        return observation

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Step all environments."""
        observation, reward, _, truncated, info = self.env.step(self._actions)
        self._returns += reward
        self._lengths += 1
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        if self.env.truth:
            names = [k for k in info if not k.startswith("_") and f"_{k}" in info]
            plain = [k for k in names if k not in ("final_obs", "final_info")]
            infos = [{k: info[k][i] for k in plain} for i in range(self.num_envs)]
        for i in np.flatnonzero(truncated):
            infos[i]["TimeLimit.truncated"] = True
            infos[i]["terminal_observation"] = info["final_obs"][i]
            infos[i]["episode"] = {"r": float(self._returns[i]), "l": int(self._lengths[i])}
            self._returns[i], self._lengths[i] = 0.0, 0
        return observation, reward.astype(np.float32), truncated.copy(), infos

    def close(self) -> None:
        """Nothing to close."""
        self.env.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The same attribute of the vector environment, once per index."""
        value = getattr(self.env, attr_name)
        return [value for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the whole vector environment; it has none per environment."""
        if len(list(self._get_indices(indices))) != self.num_envs:
            raise InputError("set_attr: rows share their attributes; leave indices out")
        setattr(self.env, attr_name, value)

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Call a method of the vector environment once; its result is repeated per index."""
        result = getattr(self.env, method_name)(*args, **kwargs)
        return [result for _ in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:
        """No environment is wrapped."""
        return [False for _ in self._get_indices(indices)]

    def get_images(self) -> Sequence[NDArray[np.uint8] | None]:
        """No pictures."""
        return [None] * self.num_envs
