"""What every environment row of `environment_speed.py` offers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Stepper:
    """Some environments that can be stepped, restarts of ended episodes included.

    Attributes:
        name: what is measured.
        envs: how many environments one step moves.
        steps: steps of one repetition.
        run: carries all environments over that many steps.
        core: our `EnvCore`, from which the integrator's work is counted.
    """

    name: str
    envs: int
    steps: int
    run: Callable[[int], None]
    core: Any = None
