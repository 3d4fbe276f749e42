"""The policy class of training: the critic also sees the plant, the actor never does."""

from __future__ import annotations

from typing import Any

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import nn

from drill_env._types import FloatArray


class _Halves(nn.Module):
    """Actor on the first `seen` entries, critic on all of them."""

    def __init__(self, seen: int, whole: int, hidden: int) -> None:
        super().__init__()
        self.seen = seen
        self.actor = _hidden(seen, hidden, nn.Tanh)
        # Cheaper than tanh, and nothing here has to be smooth.
        self.critic = _hidden(whole, hidden, nn.ReLU)
        self.latent_dim_pi = self.latent_dim_vf = hidden

    def forward(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return self.forward_actor(x), self.forward_critic(x)

    def forward_actor(self, x: torch.Tensor) -> torch.Tensor:
        return self.actor(x[:, : self.seen])

    def forward_critic(self, x: torch.Tensor) -> torch.Tensor:
        return self.critic(x)


def _hidden(inputs: int, units: int, bend: type[nn.Module]) -> nn.Sequential:
    return nn.Sequential(nn.Linear(inputs, units), bend(), nn.Linear(units, units), bend())


class PlantCritic(ActorCriticPolicy):
    """Two hidden layers each; the last entries of the observation are for the critic alone.

    Args:
        seen: entries of the observation that the actor reads.
        hidden: units in each hidden layer.
        **options: of `ActorCriticPolicy`.
    """

    def __init__(self, *args: Any, seen: int, hidden: int, **options: Any) -> None:
        self._sizes = (seen, hidden)
        super().__init__(*args, **options)

    def _build_mlp_extractor(self) -> None:
        seen, hidden = self._sizes
        self.mlp_extractor = _Halves(seen, self.features_dim, hidden)  # pyright: ignore

    def _get_constructor_parameters(self) -> dict[str, Any]:
        seen, hidden = self._sizes
        return {**super()._get_constructor_parameters(), "seen": seen, "hidden": hidden}


def actor_layers(model: PPO) -> list[tuple[FloatArray, FloatArray]]:
    """Weights (inputs, outputs) and biases of the actor's layers."""
    policy: Any = model.policy
    linear = [m for m in policy.mlp_extractor.actor if isinstance(m, nn.Linear)]
    return [
        (m.weight.detach().numpy().T.copy(), m.bias.detach().numpy().copy())
        for m in (*linear, policy.action_net)
    ]
