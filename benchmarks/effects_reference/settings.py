"""What the library is compared at: numbers of each effect, voltages, and both solutions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drill_env import Rig
from drill_env.effects import LIBRARY
from drill_env.integrator import Trajectory, sampled_voltage, simulate

from .simulation import Array
from .solver import reference

# Where the middle of the grid would do nothing in the run.
SETTINGS = {
    "wear": {"distance": 100.0},
    "amplifier_saturation": {"level": 3.0},
    "current_limit": {"level": 3.0, "back_emf": 0.3},
    "friction_step": {"time": 4.0},
    "torque_pulse": {"time": 4.0},
    "amplifier_deadzone": {"width": 0.2},
    "upper_presliding": {"distance": 0.05},
    "presliding": {"distance": 0.15},
}
MOVING = tuple(name for name, effect in LIBRARY.items() if not effect.senses)
"""Effects that move the rig."""


def entry(name: str) -> dict[str, Any]:
    """An effect with its usual numbers."""
    middle = {p.name: p.grid[len(p.grid) // 2] for p in LIBRARY[name].parameters}
    return {"id": name, **middle, **SETTINGS.get(name, {})}


@dataclass(frozen=True)
class Problem:
    """A run from rest: effects, and voltages that follow each other in equal parts of it."""

    names: tuple[str, ...]
    volts: tuple[float, ...]
    seconds: float
    samples: int = 601

    @property
    def t(self) -> Array:
        return np.linspace(0.0, self.seconds, self.samples)

    @property
    def steps(self) -> list[tuple[float, float]]:
        starts = np.arange(len(self.volts)) * self.seconds / len(self.volts)
        return list(zip(starts.tolist(), self.volts, strict=True))

    def ours(self, rtol: float = 1e-12) -> Trajectory:
        """What the package finds."""
        starts = np.array([start for start, _ in self.steps])
        drive = sampled_voltage(starts, np.array(self.volts), self.seconds)
        rig = Rig(effects=tuple(entry(name) for name in self.names))
        return simulate(rig, drive, self.seconds, t_eval=self.t, rtol=rtol, atol=0.01 * rtol)

    def truth(self, cap: float = 0.02) -> Array:
        """What the reference finds with steps of `cap` s at most."""
        effects = [entry(name) for name in self.names]
        return reference(Rig(), effects, self.steps, self.seconds, self.t, cap=cap)
