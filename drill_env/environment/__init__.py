"""Gymnasium environments of the rig.

The stable-baselines3 adapter is in `drill_env.environment.sb3`, so that nothing here
needs torch.
"""

from typing import Any

_HOMES = {
    "EnvConfig": "config",
    "RewardWeights": "config",
    "Start": "config",
    "View": "config",
    "DrillStringEnv": "env",
    "DrillStringSurfaceEnv": "env",
    "DrillStringVectorEnv": "vector_env",
    "DrillStringSurfaceVectorEnv": "vector_env",
}

__all__ = list(_HOMES)  # pyright: ignore


def __getattr__(name: str) -> Any:
    # Lazy, because `import drill_env` passes through here to register the ids.
    import importlib

    if name in _HOMES:
        return getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
