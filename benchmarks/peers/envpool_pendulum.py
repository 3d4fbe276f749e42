"""EnvPool: Pendulum in C++. One thread: more of them wait actively, which costs CPU time."""

from __future__ import annotations

import warnings

import numpy as np

from peers.common import NotInstalledError
from peers.steppers import Stepper


def peer(envs: int) -> Stepper:
    try:
        import envpool
    except ImportError as error:
        raise NotInstalledError(str(error)) from error
    with warnings.catch_warnings():
        # Its bounds are doubles in a float space.
        warnings.simplefilter("ignore")
        env = envpool.make_gymnasium("Pendulum-v1", num_envs=envs, num_threads=1, seed=0)
    env.reset()
    rng = np.random.default_rng(0)
    actions = rng.uniform(-2.0, 2.0, (64, envs, 1)).astype(np.float32)

    def run(steps: int) -> None:
        for i in range(steps):
            env.step(actions[i % 64])

    return Stepper("EnvPool Pendulum, random actions", envs, 600, run)
