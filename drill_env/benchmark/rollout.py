"""Closed-loop runs of one controller on many plants at once."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal, NamedTuple, Protocol, TypeAlias, get_args, runtime_checkable

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.benchmark.plants import Plants
from drill_env.controllers import Controller
from drill_env.environment.config import EnvConfig, Start
from drill_env.environment.core import EnvCore

Scenario: TypeAlias = Literal["limit_cycle", "rest", "ring", "friction_step"]
"""How a run begins; "friction_step" begins on the limit cycle and changes friction midway."""

SCENARIOS: tuple[Scenario, ...] = get_args(Scenario)
PHASES = 8
FRICTION_STEP = 1.5

_STARTS: dict[Scenario, Start] = {"friction_step": "limit_cycle"}


class Runs(NamedTuple):
    """True omega_l (rad/s), voltage (V) and twist (rad) at the end of each control period.

    All of shape (steps, runs).
    """

    omega_l: FloatArray
    voltage: FloatArray
    twist: FloatArray


@runtime_checkable
class TakesDelays(Protocol):
    """A controller that is told each rig's sensor delay: no fair match, shown for comparison."""

    def tell_delays(self, delays: FloatArray) -> None:
        """Sensor delays (s) of the rigs, shape (n,)."""
        ...


def run_plants(
    controller: Controller,
    config: EnvConfig,
    plants: Plants,
    setpoints: FloatArray,
    scenario: Scenario,
    seed: int = 0,
) -> Runs:
    """Run every plant at every set point, for one episode of `config.episode_seconds`.

    Limit cycles are entered at eight phases, which go round over plants and set points so
    that every set point meets each of them equally often.

    Args:
        controller: designed for the nominal rig; it sees nothing of the plants.
        config: nominal rig, encoders, period and voltage limit.
        plants: true plants, each with its sensor delay.
        setpoints: rad/s, shape (s,).
        scenario: how the runs begin.
        seed: of the ring's amplitude and angle.

    Returns:
        Series of all runs, the set point running fastest.

    Raises:
        InputError: the controller returns NaN, infinity or the wrong number of voltages.
    """
    setting = dataclasses.replace(
        config, observation=controller.view, history=controller.history, action="volts"
    )
    runs = len(plants) * len(setpoints)
    core = EnvCore(setting, runs)
    _reset_all(core, plants, setpoints, scenario, seed)
    controller.reset(runs)
    if isinstance(controller, TakesDelays):
        controller.tell_delays(np.repeat(plants.delays, len(setpoints)))
    steps = setting.episode_steps
    omega_l, voltage, twist = (np.zeros((steps, runs)) for _ in range(3))
    state, applied = core.row["run"]["y"], core.row["voltage"]
    for k in range(steps):
        volts = np.asarray(controller.act(core.rows.observation.astype(np.float64)))
        if volts.shape != (runs,) or not np.isfinite(volts).all():
            raise InputError(
                f"act() returned shape {volts.shape} or a value that is not finite in step {k}: "
                f"return {runs} finite voltages"
            )
        core.step(volts)
        twist[k], omega_l[k], voltage[k] = state[:, 0], state[:, 2], applied
    return Runs(omega_l, voltage, twist)


def _reset_all(
    core: EnvCore, plants: Plants, setpoints: FloatArray, scenario: Scenario, seed: int
) -> None:
    rigs, delays = plants.rigs(core.config.rig), plants.delays
    common: dict[str, Any] = {"start": _STARTS.get(scenario, scenario)}
    if scenario == "friction_step":
        half = 0.5 * core.config.episode_seconds
        common["friction_step"] = ((half, half), (FRICTION_STEP, FRICTION_STEP))
    for i, (rig, delay) in enumerate(zip(rigs, delays.tolist(), strict=True)):
        for j, setpoint in enumerate(setpoints.tolist()):
            options = common | {
                "rig": rig, "delay_s": delay, "setpoint": setpoint,
                "phase": (i + j) % PHASES / PHASES,
            }  # fmt: skip
            row, rng = i * len(setpoints) + j, np.random.default_rng([seed, i, j])
            core.reset(row, rng, core.checked(options))
