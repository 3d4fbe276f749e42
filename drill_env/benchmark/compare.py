"""Controllers side by side over set points and starts, on the same rig and encoders."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.benchmark.measures import measure
from drill_env.controllers import Controller
from drill_env.dynamics import equilibrium_speed
from drill_env.environment.config import EnvConfig, Start
from drill_env.environment.targets import check_setpoint
from drill_env.environment.vector_env import DrillStringVectorEnv

SETPOINTS: tuple[float, ...] = (0.5, 0.85, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 8.5)
STARTS: tuple[Start, ...] = ("rest", "limit_cycle")

Progress = Callable[[str, int, int], None]


class UnreachableWarning(UserWarning):
    """A set point lies above the speed that the voltage limit can hold."""


def compare(
    makers: Mapping[str, Callable[[EnvConfig], Controller]],
    config: EnvConfig,
    *,
    setpoints: Sequence[float] = SETPOINTS,
    starts: Sequence[Start] = STARTS,
    seconds: float = 90.0,
    window_s: float = 30.0,
    seed: int = 0,
    progress: Progress | None = None,
) -> pd.DataFrame:
    """Run every controller from every start to every set point.

    Args:
        makers: controllers by name, each designed from the configuration.
        config: rig, encoders and voltage limit; view and history follow the controller.
        setpoints: rad/s; those the voltage limit cannot hold give an `UnreachableWarning`.
        starts: where the runs begin.
        seconds: length of a run, s.
        window_s: end of a run that is judged, s.
        seed: of the environments; all controllers meet the same plants.
        progress: called with (controller, done, total).

    Returns:
        One row a run: controller, view, set point, start and the fields of `Measures`.

    Raises:
        InputError: an argument is empty or out of range, or a controller returns no voltage.
    """
    _check(len(makers) * len(setpoints) * len(starts), config, seconds, window_s)
    _warn_if_unreachable(config, [check_setpoint(value) for value in setpoints])
    rows: list[dict[str, Any]] = []
    tell = progress or (lambda name, done, total: None)
    for done, (name, maker) in enumerate(makers.items()):
        tell(name, done, len(makers))
        for start in starts:
            rows += _runs(name, maker, config, setpoints, start, seconds, window_s, seed)
    tell("", len(makers), len(makers))
    return pd.DataFrame(rows)


def _check(runs: int, config: EnvConfig, seconds: float, window_s: float) -> None:
    if not runs:
        raise InputError("compare needs at least one controller, one set point and one start")
    if not (np.isfinite(seconds) and seconds >= config.control_period):
        raise InputError(f"seconds is {seconds}: give a run of at least one control period")
    if not 0 < window_s <= seconds:
        raise InputError(f"window is {window_s} s: give more than 0 and at most {seconds} s")


def _warn_if_unreachable(config: EnvConfig, setpoints: Sequence[float]) -> None:
    top = equilibrium_speed(config.rig, config.voltage_limit)
    beyond = [f"{value:g}" for value in setpoints if value > top]
    if beyond:
        warnings.warn(
            f"set point {', '.join(beyond)} rad/s is out of reach: {config.voltage_limit:g} V "
            f"hold at most {top:.2f} rad/s; lower it or raise the voltage limit",
            UnreachableWarning,
            stacklevel=3,
        )


def _runs(
    name: str,
    maker: Callable[[EnvConfig], Controller],
    config: EnvConfig,
    setpoints: Sequence[float],
    start: Start,
    seconds: float,
    window_s: float,
    seed: int,
) -> Iterator[dict[str, Any]]:
    controller = maker(config)
    setting = dataclasses.replace(
        config, observation=controller.view, history=controller.history, action="volts",
        start=start, episode_seconds=seconds,
    )  # fmt: skip
    try:
        omega_l, voltage = run_closed_loop(controller, setting, setpoints, seed)
    except InputError as error:
        raise InputError(f"controller {name}: {error}") from error
    for i, setpoint in enumerate(setpoints):
        judged = measure(
            omega_l[:, i], voltage[:, i], setpoint, config.control_period, config.voltage_limit,
            window_s,
        )  # fmt: skip
        where = {"controller": name, "view": controller.view, "setpoint": setpoint, "start": start}
        yield where | dataclasses.asdict(judged)


def run_closed_loop(
    controller: Controller, config: EnvConfig, setpoints: Sequence[float] | FloatArray, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Run one controller on as many rigs as there are set points, for one episode.

    Returns:
        True omega_l (rad/s) at the end of each period and the voltage (V) in it, both of
        shape (steps, rigs).

    Raises:
        InputError: the controller returns NaN, infinity or the wrong number of voltages.
    """
    rigs = len(setpoints)
    options = {item.name: getattr(config, item.name) for item in dataclasses.fields(config)}
    env = DrillStringVectorEnv(rigs, **options)
    observation, _ = env.reset_each(seed, [{"setpoint": value} for value in setpoints])
    controller.reset(rigs)
    steps = config.episode_steps
    omega_l, voltage = np.zeros((steps, rigs)), np.zeros((steps, rigs))
    for k in range(steps):
        volts = np.asarray(controller.act(observation.astype(np.float64)))
        if volts.shape != (rigs,) or not np.isfinite(volts).all():
            raise InputError(
                f"act() returned shape {volts.shape} or a value that is not finite in step {k}: "
                f"return {rigs} finite voltages"
            )
        observation, _, _, _, info = env.step(volts[:, None])
        omega_l[k], voltage[k] = info["omega_l"], info["voltage"]
    return omega_l, voltage
