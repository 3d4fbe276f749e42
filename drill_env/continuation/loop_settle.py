"""What a sampled loop settles on, as a first guess of a cycle."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.cycle import PeriodMap
from drill_env.continuation.loop_period import SampledLoop
from drill_env.continuation.tracer import settled_cycle
from drill_env.dynamics import equilibrium_voltage

_SETTLE_PERIODS, _WATCH_PERIODS = 40, 6
# Sampling alone moves the peaks by a thousandth.
_DRIFT = 5e-3


def settled_motion(loop: SampledLoop, setpoint: float) -> FloatArray | None:
    """State at a peak of omega_l, period and set point, shape (n + 2,).

    None if the motion becomes steady, or is still changing.

    The loop starts from the limit cycle that the rig has at the constant voltage of the set
    point, or from rest if there is none.

    Raises:
        CycleError: the integration or the controller failed.
    """
    volts = float(equilibrium_voltage(loop.rig, setpoint))
    open_loop = settled_cycle(PeriodMap(loop.rig), volts)
    rig = np.zeros(3) if open_loop is None else open_loop[:3]
    state, clock = loop.settled_state(rig, setpoint, volts), loop.config.control_period
    block = max(3, round(loop.rig.natural_period / clock))
    modes, states = None, []
    for k in range((_SETTLE_PERIODS + _WATCH_PERIODS) * block):
        step = loop.advance(state, clock, setpoint, modes, sensitivity=False)
        state, modes = step.state, step.run.final_modes
        if k >= _SETTLE_PERIODS * block:
            states.append(state)
    return _last_cycle(np.array(states), clock, setpoint)


def _last_cycle(states: FloatArray, clock: float, setpoint: float) -> FloatArray | None:
    speed = states[:, 2]
    top = float(speed.max())
    swing = top - float(speed.min())
    drift = speed[: len(speed) // 2].max() - speed[len(speed) // 2 :].max()
    if swing < 1e-2 * (1.0 + abs(top)) or abs(drift) > _DRIFT * swing:
        return None
    inner = speed[1:-1]
    # Peaks of the same height lie one period apart, lesser ones within it.
    high = (inner > speed[:-2]) & (inner >= speed[2:]) & (inner > top - 0.05 * swing)
    peaks = 1 + np.flatnonzero(high)
    if len(peaks) < 2:
        return None
    period = clock * float(np.diff(peaks).mean())
    return np.append(states[peaks[-1]], [period, setpoint])
