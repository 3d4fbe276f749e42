"""What a controlled rig settles on over the set point, in the environment itself."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pandas as pd

from drill_env._types import BoolArray, FloatArray
from drill_env.benchmark.compare import Progress, run_closed_loop
from drill_env.controllers import Controller
from drill_env.dynamics import equilibrium_state
from drill_env.environment.config import EnvConfig, Start
from drill_env.environment.vector_env import DrillStringVectorEnv
from drill_env.sensors import Encoder

_STARTS: tuple[Start, ...] = ("rest", "limit_cycle")
_SETTLE_S, _WATCH_S = 120.0, 24.0
_PUSH, _HELD = 0.01, 0.01
# Observations are single precision, so smaller swings are not the loop's own.
_ROUNDING = 1e-6


def controlled_diagram(
    maker: Callable[[EnvConfig], Controller],
    config: EnvConfig,
    setpoints: FloatArray,
    progress: Progress | None = None,
    growth: FloatArray | None = None,
) -> pd.DataFrame:
    """Attractors of the sampled closed loop, set point by set point.

    They are found by letting the loop settle from rest and from the open-loop limit cycle;
    whether the equilibrium at the set point is stable, by pushing it a little. Encoders are
    not quantised, so that what is seen is the loop's own. Unstable motions need
    `drill_env.continuation.loop_diagram`.

    Args:
        maker: makes the controller from the configuration.
        config: rig, control period, filter and voltage limit.
        setpoints: rad/s, shape (n,).
        progress: called with (what, done, total).
        growth: growth rates of the equilibria (1/s), shape (n,), where they are known;
            else they are fitted to the pushed runs.

    Returns:
        Columns setpoint, start, min, max, mean (rad/s) of the settled motion, and
        growth_rate (1/s; if fitted, NaN where the swing is never small for two natural
        periods, as the controller's own start may drive it away) and stable.
    """
    exact = dataclasses.replace(config.encoder, counts_per_rev=0, noise_rad=0.0)
    assert isinstance(exact, Encoder)
    quiet = dataclasses.replace(config, encoder=exact, action="volts", rtol=1e-9)
    controller = maker(quiet)
    quiet = dataclasses.replace(
        quiet, observation=controller.view, history=controller.history,
        episode_seconds=_SETTLE_S + _WATCH_S,
    )  # fmt: skip
    pushed = _pushed_runs(controller, quiet, setpoints)
    if growth is None:
        growth = growth_rates(pushed, quiet, setpoints)
    settled = _settled(pushed, quiet, setpoints)
    tails = {}
    for done, start in enumerate(_STARTS):
        if progress is not None:
            progress(start, done, len(_STARTS))
        config = dataclasses.replace(quiet, start=start)
        omega, _ = run_closed_loop(controller, config, setpoints.tolist(), 0)
        settled |= _settled(omega, quiet, setpoints)
        tails[start] = omega[-round(_WATCH_S / quiet.control_period) :]
    return pd.DataFrame(
        [
            {
                "setpoint": float(setpoint), "start": start, "min": float(tail[:, i].min()),
                "max": float(tail[:, i].max()), "mean": float(tail[:, i].mean()),
                "growth_rate": float(growth[i]), "stable": bool(settled[i]),
            }
            for start, tail in tails.items()
            for i, setpoint in enumerate(setpoints)
        ]
    )  # fmt: skip


def _settled(omega: FloatArray, config: EnvConfig, setpoints: FloatArray) -> BoolArray:
    """Which runs end on their set points, shape (n,)."""
    tail = omega[-round(_WATCH_S / config.control_period) :]
    return np.asarray(np.abs(tail - setpoints).max(axis=0) < _HELD * setpoints)


def growth_rates(omega: FloatArray, config: EnvConfig, setpoints: FloatArray) -> FloatArray:
    """Rate (1/s) at which a small swing around each set point grows, shape (n,).

    Fitted to runs that start on the set point but for a push of the lower disc: it is
    the swing of omega_l from one natural period to the next.
    """
    period = config.control_period
    block = max(2, round(config.rig.natural_period / period))
    count = len(omega) // block
    swings = np.ptp(omega[: count * block].reshape(count, block, -1), axis=1)
    times = (np.arange(count) + 0.5) * block * period
    rates = np.full(len(setpoints), np.nan)
    for i, setpoint in enumerate(setpoints):
        # Straight on a logarithmic scale: neither rounding nor the nonlinear end.
        use = (swings[:, i] > _ROUNDING) & (swings[:, i] < 0.1 * setpoint)
        if use.sum() >= 2:
            rates[i] = np.polyfit(times[use], np.log(swings[use, i]), 1)[0]
    return rates


def _pushed_runs(controller: Controller, config: EnvConfig, setpoints: FloatArray) -> FloatArray:
    """omega_l (rad/s) of runs that begin a little off the set points, shape (steps, n)."""
    fields = {item.name: getattr(config, item.name) for item in dataclasses.fields(config)}
    env = DrillStringVectorEnv(len(setpoints), **fields)
    starts = []
    for setpoint in setpoints.tolist():
        state = equilibrium_state(config.rig, setpoint)
        state[2] += _PUSH * setpoint
        starts.append({"setpoint": setpoint, "start": "state", "state": state})
    observation, _ = env.reset_each(0, starts)
    controller.reset(len(setpoints))
    omega = np.zeros((config.episode_steps, len(setpoints)))
    for k in range(len(omega)):
        volts = np.asarray(controller.act(observation.astype(np.float64)))
        observation, _, _, _, info = env.step(volts[:, None])
        omega[k] = info["omega_l"]
    return omega
