"""gym-electric-motor: a permanently excited DC motor under current control."""

from __future__ import annotations

import warnings

import numpy as np

from peers.common import NotInstalledError
from peers.steppers import Stepper


def peer() -> Stepper:
    try:
        import gym_electric_motor as gem
    except ImportError as error:
        raise NotInstalledError(str(error)) from error
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        env = gem.make("Cont-CC-PermExDc-v0")
        env.reset(seed=0)
        # The passive checker complains at the first step only.
        env.step(np.zeros(1))
    action = np.full(1, 0.1)

    def run(steps: int) -> None:
        for _ in range(steps):
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return Stepper("gym-electric-motor DC motor", 1, 3000, run)
