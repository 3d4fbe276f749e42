"""Trained agents behind the same interface as the classical controllers."""

from .policy import Agent, RememberingAgent, find, load, names, save_agent

__all__ = ["Agent", "RememberingAgent", "find", "load", "names", "save_agent"]
