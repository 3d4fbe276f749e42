"""A trained stable-baselines3 policy behind the controllers' interface."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from drill_env._errors import InputError
from drill_env._files import make_folder, write_text
from drill_env._types import FloatArray, PathLike
from drill_env.environment.config import EnvConfig, View

MODEL, SETTING = "model.zip", "agent.json"


class Agent:
    """Deterministic actions of a PPO policy, from scaled observations.

    Args:
        model: anything with stable-baselines3's `predict`.
        view: observation it was trained on.
        history: past frames in that observation.
        scale: divisors of the observation, shape (d,).
        voltage_limit: V that an action of 1 stands for.
    """

    def __init__(
        self, model: Any, view: View, history: int, scale: FloatArray, voltage_limit: float
    ) -> None:
        self.view: View = view
        self.history: int = history
        self._model, self._scale, self._limit = model, scale, voltage_limit

    def reset(self, n: int) -> None:
        """Nothing to forget: the policy has no memory of its own."""

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltages (V) for observations in physical units, shape (n, d)."""
        if observation.shape[1] != len(self._scale):
            raise InputError(
                f"this agent reads {len(self._scale)} numbers, the environment gives "
                f"{observation.shape[1]}: use the environment it was trained on"
            )
        scaled = (observation / self._scale).astype(np.float32)
        action, _ = self._model.predict(scaled, deterministic=True)
        return self._limit * np.clip(action[:, 0].astype(np.float64), -1.0, 1.0)


def observation_scale(config: EnvConfig) -> FloatArray:
    """Divisors that bring every entry of the observation to the order of 1, shape (d,)."""
    top = config.setpoint_range[1]
    twist = 4.0 * float(np.sqrt(config.rig.Jl / config.rig.ktheta)) * top / 4.0
    measured = [top] if config.observation == "surface" else [twist, top, top]
    frame = [*measured, config.voltage_limit]
    return np.array([*measured, top, config.voltage_limit, *frame * config.history])


def save_agent(model: Any, config: EnvConfig, folder: PathLike, notes: dict[str, Any]) -> None:
    """Write the policy and what is needed to use it again into `folder`."""
    path = make_folder(Path(folder))
    model.save(path / MODEL)
    setting = {
        "view": config.observation,
        "history": config.history,
        "voltage_limit": config.voltage_limit,
        "control_period": config.control_period,
        "scale": observation_scale(config).tolist(),
        **notes,
    }
    write_text(path / SETTING, json.dumps(setting, indent=2) + "\n")


def load(folder: PathLike) -> Agent:
    """Read an agent written by `save_agent`.

    Raises:
        InputError: the folder holds no agent or a damaged one, or the extra ``agents`` is not
            installed.
    """
    path = Path(folder)
    if not ((path / SETTING).is_file() and (path / MODEL).is_file()):
        raise InputError(
            f"agent {path}: no {MODEL} and {SETTING} there; name a folder written by train.py"
        )
    try:
        from stable_baselines3 import PPO
    except ImportError as error:
        raise InputError(f"agent {path} needs torch: pip install 'drill-env[agents]'") from error
    try:
        found = json.loads((path / SETTING).read_text(encoding="utf-8"))
        scale = np.array(found["scale"], dtype=float)
        view, history, limit = found["view"], int(found["history"]), float(found["voltage_limit"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"agent {path}: {SETTING} is damaged ({error}); train it again") from error
    try:
        model = PPO.load(path / MODEL, device="cpu")
    except (BadZipFile, KeyError, ValueError, RuntimeError, AttributeError) as error:
        raise InputError(f"agent {path}: {MODEL} is damaged ({error}); train it again") from error
    return Agent(model, view, history, scale, limit)


def describe(args: Any) -> dict[str, Any]:
    """A dataclass of arguments as plain values."""
    return {
        key: str(v) if isinstance(v, Path) else v for key, v in dataclasses.asdict(args).items()
    }
