"""Gymnasium: the CartPole vector environment, Euler steps in numpy."""

from __future__ import annotations

import gymnasium as gym

from peers.steppers import Stepper


def peer(envs: int) -> Stepper:
    env = gym.make_vec("CartPole-v1", num_envs=envs, vectorization_mode="vector_entry_point")
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(64)]

    def run(steps: int) -> None:
        for i in range(steps):
            env.step(actions[i % 64])

    return Stepper("Gymnasium CartPole vector, random actions", envs, 600, run)
