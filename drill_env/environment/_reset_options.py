"""Options of a reset, all checked before anything is changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from drill_env._checks import real, reals
from drill_env._errors import InputError, printable
from drill_env._types import FloatArray
from drill_env.environment import targets
from drill_env.environment.config import SPEED_BOUND, TWIST_BOUND, EnvConfig, Start
from drill_env.parameters import Rig

_KEYS = {"setpoint", "schedule", "start", "state", "phase", "rig", "delay_s", "friction_step"}


@dataclass(frozen=True, slots=True)
class ResetOptions:
    """How an episode starts; None is drawn, or the environment's own.

    Args:
        start: where it starts.
        schedule: times (s) and set points (rad/s).
        friction_step: ranges of its time (s) and factor; None for no step.
        setpoint: rad/s.
        state: (twist, omega_u, omega_l, theta_l) of the start "state", rad and rad/s.
        phase: share of the limit cycle's period.
        rig: plant of the episode.
        delay_s: of the sensors, s.
    """

    start: Start
    schedule: list[tuple[float, float]]
    friction_step: tuple[tuple[float, float], tuple[float, float]] | None
    setpoint: float | None
    state: FloatArray | None
    phase: float | None
    rig: Rig | None
    delay_s: float | None


def checked_reset(
    given: Any, config: EnvConfig, longest_schedule: int, largest_delay: float
) -> ResetOptions:
    """Check what a reset was given.

    Args:
        given: None or a dictionary, see `DrillStringEnv.reset`.
        config: options of the environment.
        longest_schedule: entries that the environment has room for.
        largest_delay: that it has room for, s.

    Raises:
        InputError: an option is unknown or out of range.
    """
    given = {} if given is None else given
    if not isinstance(given, Mapping):
        raise InputError(f"options is {printable(repr(given), 60)}: give a dictionary or None")
    unknown = sorted(str(key) for key in given if key not in _KEYS)
    if unknown:
        raise InputError(
            f"unknown reset option {unknown[0]}; known: {', '.join(sorted(_KEYS))}, and for vector "
            "environments reset_mask"
        )
    start, state = _checked_start(given, config)
    friction_step = given.get("friction_step", config.friction_step)
    return ResetOptions(
        start=start,
        schedule=_checked_schedule(given.get("schedule", config.schedule), longest_schedule),
        friction_step=(
            None if friction_step is None else targets.checked_friction_step(friction_step)
        ),
        setpoint=targets.check_setpoint(given["setpoint"]) if "setpoint" in given
        else config.setpoint,
        state=state,
        phase=_between(given, "phase", 1.0, "of a period"),
        rig=_checked_rig(given["rig"], config) if "rig" in given else None,
        delay_s=_between(given, "delay_s", largest_delay, "s"),
    )  # fmt: skip


def _between(given: Mapping[str, Any], name: str, most: float, unit: str) -> float | None:
    if name not in given:
        return None
    value = real(given[name], f"reset option {name}")
    if not 0 <= value <= most:
        raise InputError(f"reset option {name} is {value}: give 0 to {most:g} {unit}")
    return value


def _checked_schedule(given: Any, longest: int) -> list[tuple[float, float]]:
    schedule = targets.checked_schedule(given)
    if len(schedule) > longest:
        raise InputError(
            f"schedule has {len(schedule)} entries; this environment was made for {longest}: pass "
            "the longest schedule to gym.make"
        )
    return schedule


def _checked_rig(rig: Any, config: EnvConfig) -> Rig:
    if not isinstance(rig, Rig):
        raise InputError(
            f"reset option rig is {printable(repr(rig), 60)}: give a drill_env.Rig, or leave it out"
        )
    if rig.inertias == 1:
        raise InputError("reset option rig: the environment needs two inertias")
    if rig.effects != config.rig.effects:
        raise InputError(
            "reset option rig: its [[effects]] differ from those the environment was made "
            "with; pass it to gym.make instead"
        )
    return rig


def _checked_start(given: Mapping[str, Any], config: EnvConfig) -> tuple[Start, FloatArray | None]:
    start: Start = given.get("start", "state" if "state" in given else config.start)
    if not isinstance(start, str) or start not in get_args(Start):
        raise InputError(f"start is {start!r}: give one of {', '.join(get_args(Start))}")
    if start == "state":
        return start, _explicit_state(given.get("state"))
    if "state" in given:
        raise InputError(f"reset option state with start {start}: give one of the two")
    return start, None


def _explicit_state(state: Any) -> FloatArray:
    name = "reset option state (twist, omega_u, omega_l[, theta_l])"
    try:
        count = 4 if len(state) == 4 else 3
    except TypeError:
        count = 3
    given = np.array(reals(state, name, count))
    bounds = (TWIST_BOUND, SPEED_BOUND, SPEED_BOUND)
    for part, value, bound in zip(("twist", "omega_u", "omega_l"), given, bounds, strict=False):
        if abs(value) > bound:
            raise InputError(
                f"reset option state: {part} is {value:g}, beyond the {bound:g} of observations"
            )
    return np.append(given, 0.0)[:4]
