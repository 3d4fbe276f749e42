"""The vector environment with observations scaled for a network."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from drill_env._types import FloatArray


class ScaledObservations(VecEnvWrapper):
    """Divides every observation by fixed scales, the same that `Agent` uses."""

    def __init__(self, venv: VecEnv, scale: FloatArray) -> None:
        box = venv.observation_space
        assert isinstance(box, spaces.Box)
        self._scale = scale.astype(np.float32)
        space = spaces.Box(box.low / self._scale, box.high / self._scale, dtype=np.float32)
        super().__init__(venv, observation_space=space)

    def reset(self) -> NDArray[np.float32]:
        """Scaled first observations."""
        return np.asarray(self.venv.reset(), dtype=np.float32) / self._scale

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict]]:
        """Scaled observations, the last ones of ended episodes too."""
        observation, reward, done, infos = self.venv.step_wait()
        for i in np.flatnonzero(done):
            infos[i]["terminal_observation"] = infos[i]["terminal_observation"] / self._scale
        return np.asarray(observation, dtype=np.float32) / self._scale, reward, done, infos
