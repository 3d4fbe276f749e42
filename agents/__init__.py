"""Trained agents behind the same interface as the classical controllers."""

from .policy import Agent, load, observation_scale, save_agent

__all__ = ["Agent", "load", "observation_scale", "save_agent"]
