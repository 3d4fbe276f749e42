"""Where an episode starts: rest, equilibrium, limit cycle, a ring around it or any state."""

from __future__ import annotations

from typing import Any

import numpy as np

from drill_env._types import FloatArray
from drill_env.dynamics import equilibrium_state, equilibrium_voltage
from drill_env.environment._kernel import settle_on_cycle
from drill_env.environment._records import Buffers
from drill_env.environment._reset_options import ResetOptions
from drill_env.environment.config import EnvConfig
from drill_env.integrator.tableau import tableau

_SETTLE_S, _WATCH_S = 30.0, 14.0


def place(
    row: Any,
    config: EnvConfig,
    setpoint: float,
    uniforms: FloatArray,
    options: ResetOptions,
    buffers: Buffers,
) -> None:
    """Put one environment into its initial state and set the voltage it starts with.

    Args:
        row: record of the environment, its plant already drawn.
        config: options.
        setpoint: rad/s.
        uniforms: five numbers in [0, 1).
        options: reset options.
        buffers: working arrays for settling on the limit cycle.
    """
    start = options.start
    if start == "random":
        start = ("rest", "limit_cycle", "ring")[min(int(3 * uniforms[0]), 2)]
    rig, limit = config.rig, config.voltage_limit
    y = row["run"]["y"]
    row["voltage"] = 0.0
    if start == "state":
        y[:] = options.state
    elif start != "rest":
        row["voltage"] = min(float(equilibrium_voltage(rig, setpoint)), limit)
        y[:] = equilibrium_state(rig, setpoint)
    if start == "ring":
        pulse = np.sqrt(rig.ktheta / rig.Jl)
        radius, angle = setpoint / pulse * uniforms[1], 2.0 * np.pi * uniforms[2]
        y[0] += radius * np.cos(angle)
        y[2] += radius * pulse * np.sin(angle)
    elif start == "limit_cycle":
        phase = float(uniforms[3]) if options.phase is None else options.phase
        if not settle_on_cycle(
            row["p"], row["run"], row["voltage"], phase, _SETTLE_S, _WATCH_S,
            tableau("dop853")[0], buffers,
        ):  # fmt: skip
            raise RuntimeError("integration failed while settling on the limit cycle")
