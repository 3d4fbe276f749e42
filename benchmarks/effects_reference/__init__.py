"""Slow, independent reference for a rig with effects: it shares no code with `drill_env`."""
