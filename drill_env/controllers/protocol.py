"""The one interface of classical controllers and agents."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from drill_env._types import FloatArray
from drill_env.environment.config import EnvConfig, View


@runtime_checkable
class Controller(Protocol):
    """Anything that turns observations into voltages, for `n` rigs at once.

    It sees what an agent sees in the same environment and nothing more.

    Attributes:
        view: the observation it needs, "both" or "surface".
        history: past frames it needs in the observation; 0 for classical controllers, which
            keep a memory of their own.
    """

    view: View
    history: int

    def reset(self, n: int) -> None:
        """Forget everything; `n` rigs follow."""
        ...

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltages (V) for one control period.

        Args:
            observation: in physical units, shape (n, d), see `observation_names`.

        Returns:
            Voltages, shape (n,); the environment clips them to its limit.
        """
        ...


@runtime_checkable
class Remembering(Controller, Protocol):
    """A controller whose memory can be read and set: what continuation of its loop needs.

    Optional. A controller that keeps nothing between calls of `act` needs neither method.
    Together with the observation the memory must determine everything: after `recall`,
    `act` depends on nothing else. Flags such as "first call" are false after `recall`.
    """

    def memory(self) -> FloatArray:
        """What it keeps between calls of `act`, shape (n, m); a copy."""
        ...

    def recall(self, memory: FloatArray) -> None:
        """Continue from `memory`, shape (n, m), as if its values had come about by `act`."""
        ...


def observation_names(config: EnvConfig) -> tuple[str, ...]:
    """Name of every entry of the observation."""
    measured = ("omega_u",) if config.observation == "surface" else ("twist", "omega_u", "omega_l")
    frame = (*measured, "voltage")
    past = [f"{name}[-{k}]" for k in range(1, config.history + 1) for name in frame]
    return (*measured, "setpoint", "voltage", *past)
