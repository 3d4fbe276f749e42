"""The training task: plants of all levels, short episodes, features in and policy outputs back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnvWrapper

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig, RewardWeights, Start, View
from drill_env.environment.sb3 import DrillStringVecEnv
from drill_env.parameters.uncertainty import UNCERTAINTY, Uncertainty, uncertainty

from .features import OUTPUT_BOUND, Features

MIXED = "mixed"
REWARD = RewardWeights(track=1.0, width=0.05, error=1.0, twist_rate=0.0, stick=0.0, effort=0.5)
SETPOINTS = (0.3, 8.6)
"""rad/s; the rig cannot hold more at 5 V."""

_NEAR_LIMIT, _NEAR_LIMIT_SHARE = (7.5, 8.6), 0.2
_STARTS: tuple[Start, ...] = ("limit_cycle", "rest", "ring")
_START_SHARES = (0.6, 0.2, 0.2)
_STEP_SHARE, _STEP_FACTORS = 0.4, (0.6, 1.6)
_PLANT = ("Tsl", "T1", "T2", "bu", "ktheta", "Jl", "Tsu")


@dataclass(frozen=True, slots=True)
class LevelMixture(Uncertainty):
    """Plants of L0, L1, L2 and, three times as often, L3, two thirds of those near its corners."""

    delay_s: float = UNCERTAINTY["L3"].delay_s

    def draw(self, uniforms: FloatArray) -> FloatArray:
        """One plant; the first number chooses the level, and its remainder the friction."""
        sets = [*UNCERTAINTY.values(), UNCERTAINTY["L3"], UNCERTAINTY["L3"]]
        scaled = len(sets) * uniforms[0]
        which = min(int(scaled), len(sets) - 1)
        inner = np.array([scaled - which, *uniforms[1:]])
        if which >= len(UNCERTAINTY):
            inner = 0.5 + 0.5 * np.cbrt(2.0 * inner - 1.0)
        return sets[which].draw(inner)


def rigs(view: View, history: int, level: str, count: int) -> DrillStringVecEnv:
    """The shipped vector environment with the reward and the plants of training."""
    spread = LevelMixture() if level == MIXED else uncertainty(level)  # pyright: ignore
    # Episodes end when the task says so: all at once, so that filters start together.
    return DrillStringVecEnv(
        count, observation=view, history=history, uncertainty=spread, reward=REWARD,
        episode_seconds=1e6,
    )  # fmt: skip


class TaskEnv(VecEnvWrapper):
    """Episodes of equal length with set points, starts and friction steps drawn anew.

    An observation holds the agent's features, then the plant's parameters and delay, which
    only the critic of `PlantCritic` reads.

    Args:
        venv: see `rigs`.
        features: of the agent.
        seconds: length of an episode, s.
        seed: of plants, set points and starts.
    """

    def __init__(
        self, venv: DrillStringVecEnv, features: Features, seconds: float, seed: int
    ) -> None:
        self.features, self._rigs = features, venv.env
        config: EnvConfig = venv.env.config
        self.length = max(1, round(seconds / config.control_period))
        self._seconds = self.length * config.control_period
        size = features.size + len(_PLANT) + 1
        super().__init__(
            venv,
            observation_space=spaces.Box(-np.inf, np.inf, (size,), dtype=np.float32),
            action_space=spaces.Box(-OUTPUT_BOUND, OUTPUT_BOUND, (1,), dtype=np.float32),
        )
        self._returns = np.zeros(self.num_envs)
        self.start_again(seed)

    def start_again(self, seed: int) -> None:
        """Draw from `seed` from the next reset on."""
        self._rng = np.random.default_rng(seed)
        self._seeds_due = True

    def _episode(self) -> dict[str, Any]:
        """Reset options of one rig."""
        rng, (low, high) = self._rng, SETPOINTS
        # Half of them spread over the logarithm: the slow set points are the tight ones.
        even = rng.random() < 0.5
        setpoint = (
            rng.uniform(low, high) if even else np.exp(rng.uniform(np.log(low), np.log(high)))
        )
        if rng.random() < _NEAR_LIMIT_SHARE:
            setpoint = rng.uniform(*_NEAR_LIMIT)
        options = {"setpoint": float(setpoint), "start": rng.choice(_STARTS, p=_START_SHARES)}
        if rng.random() < _STEP_SHARE:
            times = (0.3 * self._seconds, 0.8 * self._seconds)
            options["friction_step"] = (times, _STEP_FACTORS)
        return options

    def reset(self) -> NDArray[np.float32]:
        """Start an episode on every rig."""
        seeds = None
        if self._seeds_due:
            seeds, self._seeds_due = self._rng.integers(2**31, size=self.num_envs).tolist(), False
        episodes = [self._episode() for _ in range(self.num_envs)]
        observation, _ = self._rigs.reset_each(seeds, episodes)
        self.features.reset(self.num_envs)
        self._plant = self._parameters()
        self._steps, self._returns[:] = 0, 0.0
        return self._read(observation)

    def _parameters(self) -> NDArray[np.float32]:
        """Plants as the critic sees them, of order 1, shape (n, 8)."""
        core = self._rigs._core
        ratios = [core.row["p"][name] / core.nominal[name] for name in _PLANT]
        scales = [2.0, *[10.0] * (len(_PLANT) - 1)]
        logs = [scale * np.log(ratio) for scale, ratio in zip(scales, ratios, strict=True)]
        return np.column_stack([*logs, core.row["delay"] / 10.0 - 1.0]).astype(np.float32)

    def _read(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        seen = self.features.read(observation.astype(np.float64))
        return np.concatenate([seen.astype(np.float32), self._plant], axis=1)

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Voltages for the policy's outputs."""
        self.venv.step_async(self.features.volts(actions[:, 0].astype(np.float64))[:, None])

    def step_wait(
        self,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list[dict]]:
        """One control period; at the end of an episode the first features of the next one."""
        observation, reward, _, infos = self.venv.step_wait()
        seen = self._read(np.asarray(observation))
        self._returns += reward
        self._steps += 1
        over = self._steps == self.length
        if over:
            for i, info in enumerate(infos):
                info["TimeLimit.truncated"], info["terminal_observation"] = True, seen[i]
                info["episode"] = {"r": float(self._returns[i]), "l": self.length}
            seen = self.reset()
        return seen, reward, np.full(self.num_envs, over), infos
