"""Torsional vibration of rotary drilling on the experimental drill-string rig."""

from drill_env import _siblings
from drill_env._errors import InputError
from drill_env.parameters import Rig, load_rig, save_rig

_siblings.install()

__version__ = "0.1.0"

__all__ = ["InputError", "Rig", "__version__", "load_rig", "save_rig"]
