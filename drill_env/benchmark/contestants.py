"""Who takes part in the protocol."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, TypeAlias

from drill_env.benchmark.rollout import TakesDelays
from drill_env.controllers import Controller
from drill_env.environment.config import EnvConfig

Tier: TypeAlias = Literal["E", "S"]
"""E sees both encoders, S the upper one alone."""


@dataclass(frozen=True, slots=True)
class Contestant:
    """A controller as the protocol meets it.

    Args:
        name: for tables and files.
        maker: designs it for a configuration.
        tier: by what it sees.
        ranked: whether the match is fair; a controller that is told what no agent sees is
            shown and not ranked.
        identity: changes whenever the controller does, so that old results are not reused.
    """

    name: str
    maker: Callable[[EnvConfig], Controller]
    tier: Tier
    ranked: bool = True
    identity: str = ""


def contestant(
    name: str, maker: Callable[[EnvConfig], Controller], config: EnvConfig, identity: str = ""
) -> Contestant:
    """A contestant, its tier told by the observation it asks for."""
    made = maker(config)
    tier: Tier = "S" if made.view == "surface" else "E"
    return Contestant(name, maker, tier, not isinstance(made, TakesDelays), identity or repr(maker))
