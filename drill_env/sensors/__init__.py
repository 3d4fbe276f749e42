"""Encoders and velocity filters."""

from drill_env.sensors.encoder import Encoder, filter_velocity, read_encoder

__all__ = ["Encoder", "filter_velocity", "read_encoder"]
