"""Where an episode starts: rest, equilibrium, limit cycle, a ring around it or any state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, get_args

import numpy as np

from drill_env._checks import real, reals
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.dynamics import equilibrium_state, equilibrium_voltage
from drill_env.environment._kernel import settle_on_cycle
from drill_env.environment._records import Buffers
from drill_env.environment.config import SPEED_BOUND, TWIST_BOUND, EnvConfig, Start
from drill_env.integrator.tableau import tableau

_SETTLE_S, _WATCH_S = 30.0, 14.0


def place(
    row: Any,
    config: EnvConfig,
    setpoint: float,
    uniforms: FloatArray,
    options: Mapping[str, Any],
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

    Raises:
        InputError: a reset option is out of range.
    """
    start: Start = options.get("start", "state" if "state" in options else config.start)
    if not isinstance(start, str) or start not in get_args(Start):
        raise InputError(f"start is {start!r}: give one of {', '.join(get_args(Start))}")
    if start == "random":
        start = ("rest", "limit_cycle", "ring")[min(int(3 * uniforms[0]), 2)]
    rig, limit = config.rig, config.voltage_limit
    y = row["run"]["y"]
    row["voltage"] = 0.0
    if start == "state":
        y[:] = _explicit_state(options.get("state"))
    elif start != "rest":
        row["voltage"] = min(float(equilibrium_voltage(rig, setpoint)), limit)
        y[:] = equilibrium_state(rig, setpoint)
    if start == "ring":
        pulse = np.sqrt(rig.ktheta / rig.Jl)
        radius, angle = setpoint / pulse * uniforms[1], 2.0 * np.pi * uniforms[2]
        y[0] += radius * np.cos(angle)
        y[2] += radius * pulse * np.sin(angle)
    elif start == "limit_cycle":
        phase = real(options.get("phase", float(uniforms[3])), "reset option phase")
        if not 0 <= phase <= 1:
            raise InputError(f"phase is {phase}: give 0 to 1, the share of a period")
        if not settle_on_cycle(
            row["p"], row["run"], row["voltage"], phase, _SETTLE_S, _WATCH_S,
            tableau("dop853")[0], buffers,
        ):  # fmt: skip
            raise RuntimeError("integration failed while settling on the limit cycle")


def _explicit_state(state: Any) -> FloatArray:
    count = 4 if np.size(np.asarray(state, dtype=object)) == 4 else 3
    given = np.array(reals(state, "reset option state (twist, omega_u, omega_l, theta_l)", count))
    bounds = (TWIST_BOUND, SPEED_BOUND, SPEED_BOUND)
    for name, value, bound in zip(("twist", "omega_u", "omega_l"), given, bounds, strict=False):
        if abs(value) > bound:
            raise InputError(
                f"reset option state: {name} is {value:g}, beyond the {bound:g} of observations"
            )
    return np.append(given, 0.0)[:4]
