"""What a controller is, and what it may see."""

from drill_env.controllers.protocol import Controller, observation_names

__all__ = ["Controller", "observation_names"]
