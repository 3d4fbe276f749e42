"""What a controller is, and what it may see."""

from drill_env.controllers.protocol import Controller, Remembering, observation_names

__all__ = ["Controller", "Remembering", "observation_names"]
