"""Torsional vibration of rotary drilling on the experimental drill-string rig.

Importing it registers ``DrillString-v0`` and ``DrillStringSurface-v0`` with Gymnasium.
"""

from typing import TYPE_CHECKING, Any

from drill_env import _siblings
from drill_env._engine import Engine
from drill_env._errors import InputError
from drill_env.environment.registration import register_ids
from drill_env.parameters import Rig, load_rig, save_rig

if TYPE_CHECKING:
    from drill_env.integrator import simulate

__version__ = "0.1.0"

__all__ = ["Engine", "InputError", "Rig", "__version__", "load_rig", "save_rig", "simulate"]

_siblings.install()
register_ids()


def __getattr__(name: str) -> Any:
    # The integrator pulls in numba; whoever only wants the ids should not wait for it.
    if name == "simulate":
        from drill_env.integrator import simulate

        return simulate
    raise AttributeError(f"module 'drill_env' has no attribute {name!r}")
