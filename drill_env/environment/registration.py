"""Ids for `gym.make` and `gym.make_vec`."""

from gymnasium.envs.registration import register, registry

_CLASSES = {"DrillString-v0": "DrillString", "DrillStringSurface-v0": "DrillStringSurface"}


def register_ids() -> None:
    """Register both environments by name, so that importing stays cheap."""
    for name, stem in _CLASSES.items():
        if name in registry:
            continue
        register(
            name,
            entry_point=f"drill_env.environment.env:{stem}Env",
            vector_entry_point=f"drill_env.environment.vector_env:{stem}VectorEnv",
            # The environment truncates by itself: the length depends on the control period.
            max_episode_steps=None,
            # The checker costs several times a step; `check_env` runs it in the tests.
            disable_env_checker=True,
        )
