"""The diagram of a controlled rig over the set point, beside the open-loop one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pandas as pd

from drill_env._types import FloatArray
from drill_env.benchmark.compare import Progress, run_closed_loop
from drill_env.controllers import Controller
from drill_env.environment.config import EnvConfig, Start
from drill_env.sensors import Encoder

_STARTS: tuple[Start, ...] = ("rest", "limit_cycle")
_SETTLE_S, _WATCH_S, _PUSH_S = 120.0, 24.0, 60.0
_PUSH = 1e-3


def controlled_diagram(
    maker: Callable[[EnvConfig], Controller],
    config: EnvConfig,
    setpoints: FloatArray,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Steady motions of the sampled closed loop, set point by set point.

    Attractors are found by letting the loop settle from rest and from the open-loop limit
    cycle; whether the equilibrium at the set point is stable, by pushing it a little and
    fitting the growth of the swing. Both use encoders without quantisation, so that what
    is seen is the loop's own. Unstable cycles are not computed.

    Args:
        maker: makes the controller from the configuration.
        config: rig, control period, filter and voltage limit.
        setpoints: rad/s, shape (n,).
        progress: called with (what, done, total).

    Returns:
        Columns setpoint, start, min, max, mean (rad/s) of the settled motion, and
        growth_rate (1/s, of a small push; NaN if the set point cannot be held) and stable.
    """
    exact = dataclasses.replace(config.encoder, counts_per_rev=0, noise_rad=0.0)
    assert isinstance(exact, Encoder)
    quiet = dataclasses.replace(config, encoder=exact, action="volts", rtol=1e-9)
    controller = maker(quiet)
    quiet = dataclasses.replace(
        quiet, observation=controller.view, episode_seconds=_SETTLE_S + _WATCH_S
    )
    rows = []
    growth = growth_rates(controller, quiet, setpoints)
    for done, start in enumerate(_STARTS):
        if progress is not None:
            progress(start, done, len(_STARTS))
        omega, _ = run_closed_loop(
            controller, dataclasses.replace(quiet, start=start), setpoints, 0
        )
        tail = omega[-round(_WATCH_S / config.control_period) :]
        for i, setpoint in enumerate(setpoints):
            rows.append(
                {
                    "setpoint": float(setpoint),
                    "start": start,
                    "min": float(tail[:, i].min()),
                    "max": float(tail[:, i].max()),
                    "mean": float(tail[:, i].mean()),
                    "growth_rate": float(growth[i]),
                    "stable": bool(growth[i] < 0.0),
                }
            )
    return pd.DataFrame(rows)


def growth_rates(controller: Controller, config: EnvConfig, setpoints: FloatArray) -> FloatArray:
    """Rate (1/s) at which a small swing around each set point grows, shape (n,).

    The loop is first settled on the set point with the string's swing taken out, by the
    start at equilibrium; the push is what remains of the controller's own transient.
    """
    pushed = dataclasses.replace(config, start="equilibrium", episode_seconds=_PUSH_S)
    omega, _ = run_closed_loop(controller, pushed, setpoints.tolist(), 0)
    period = config.control_period
    swing = np.abs(omega - np.asarray(setpoints))
    block = max(1, round(config.rig.natural_period / period))
    count = len(swing) // block
    envelope = swing[: count * block].reshape(count, block, -1).max(axis=1)
    rates = np.full(len(setpoints), np.nan)
    times = (np.arange(count) + 0.5) * block * period
    for i, setpoint in enumerate(setpoints):
        # Straight on a logarithmic scale: neither rounding nor the nonlinear end.
        use = (envelope[:, i] > 1e-9) & (envelope[:, i] < 0.05 * setpoint)
        if use.sum() >= 3:
            rates[i] = np.polyfit(times[use], np.log(envelope[use, i]), 1)[0]
    return rates
