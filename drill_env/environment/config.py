"""Every option of the environments, checked in one place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

from drill_env._checks import real, reals
from drill_env._errors import InputError
from drill_env._types import Method
from drill_env.effects.declared import declared
from drill_env.environment.targets import (
    LONGEST_EPISODE,
    SETPOINT_BOUND,
    check_setpoint,
    checked_friction_step,
    checked_schedule,
)
from drill_env.parameters import Level, Rig, Uncertainty, uncertainty
from drill_env.sensors import Encoder

View: TypeAlias = Literal["both", "surface", "state"]
"""What is observed: both encoders, the upper one alone, or the exact state."""

Start: TypeAlias = Literal["rest", "equilibrium", "limit_cycle", "ring", "state", "random"]
"""Where an episode starts."""

ActionUnit: TypeAlias = Literal["volts", "normalized"]
"""Actions in volts, or in shares of the voltage limit."""

MAX_VOLTAGE = 15.0
TWIST_BOUND, SPEED_BOUND = 100.0, 150.0


@dataclass(frozen=True, slots=True)
class RewardWeights:
    """Weights of the reward's terms; e = |omega_l - setpoint| / setpoint, all from true values.

    Args:
        track: + track / (1 + (e / width)^2), close to its weight once on the set point.
        error: - error * min(e, 2), a slope that points home from far away.
        twist_rate: - twist_rate * min(|omega_u - omega_l| / setpoint, 2): torsional vibration.
        stick: - stick while |omega_l| < stick_speed.
        effort: - effort * (change of voltage / voltage limit)^2.
        width: relative error at which `track` has halved.
        stick_speed: rad/s below which the lower disc counts as stuck.
    """

    track: float = 1.0
    error: float = 0.5
    twist_rate: float = 0.5
    stick: float = 0.5
    effort: float = 0.05
    width: float = 0.1
    stick_speed: float = 0.1

    def __post_init__(self) -> None:
        for item in fields(self):
            value = real(getattr(self, item.name), f"reward weight {item.name}")
            if value < 0:
                raise InputError(f"reward weight {item.name} is {value}: give 0 or greater")
        if self.width == 0:
            raise InputError("reward weight width is 0: give a relative error greater than 0")


@dataclass(frozen=True, slots=True)
class EnvConfig:
    """Options of `DrillString-v0`, all of them keyword arguments of `gym.make`.

    Args:
        rig: nominal parameters, and the effects that all plants share; `gym.make` also takes the
            path of a rig file.
        observation: "both" encoders, "surface" (upper encoder alone) or exact "state".
        history: past frames (measurements and voltage) appended to the observation.
        action: "volts" or "normalized" to [-1, 1].
        voltage_limit: V, up to 15.
        control_period: s, 0.01 to 0.2.
        episode_seconds: length after which an episode is truncated, s.
        setpoint: fixed set point in rad/s; None draws from `setpoint_range`.
        setpoint_range: rad/s.
        schedule: (time in s, set point in rad/s) pairs that override the set point.
        start: where episodes start; "random" mixes rest, limit cycle and ring. Equilibrium and
            limit cycle are those of the rig without its effects.
        uncertainty: "L0" to "L3" or an `Uncertainty`, drawn at every reset.
        friction_step: ((earliest, latest) time in s, (lowest, highest) factor) of a sudden
            change of the lower friction, drawn at every reset; None for no such step.
        encoder: resolution, noise, delay, filter.
        reward: weights of the reward.
        method: Runge-Kutta pair between events.
        rtol: relative tolerance of a step.
    """

    rig: Rig = field(default_factory=Rig)
    observation: View = "both"
    history: int = 0
    action: ActionUnit = "volts"
    voltage_limit: float = 5.0
    control_period: float = 0.05
    episode_seconds: float = 60.0
    setpoint: float | None = None
    setpoint_range: tuple[float, float] = (0.3, 8.5)
    schedule: Sequence[tuple[float, float]] = ()
    start: Start = "rest"
    uncertainty: Level | Uncertainty = "L0"
    friction_step: tuple[tuple[float, float], tuple[float, float]] | None = None
    encoder: Encoder = field(default_factory=Encoder)
    reward: RewardWeights = field(default_factory=RewardWeights)
    method: Method = "dopri5"
    rtol: float = 1e-5

    def __post_init__(self) -> None:
        _check_choices(self)
        _check_kinds(self)
        _check_numbers(self)
        uncertainty(self.uncertainty)
        if self.rig.inertias == 1:
            raise InputError("rig: the environment needs two inertias")
        declared(self.rig)
        samples = self.control_period * self.encoder.rate_hz
        if abs(samples - round(samples)) > 1e-6 or round(samples) < 1:
            raise InputError(
                f"encoder rate {self.encoder.rate_hz:g} Hz and control_period "
                f"{self.control_period:g} s: a period must hold a whole number of samples"
            )

    @property
    def samples(self) -> int:
        """Encoder samples per control period."""
        return round(self.control_period * self.encoder.rate_hz)

    @property
    def episode_steps(self) -> int:
        """Control periods per episode."""
        return max(1, round(self.episode_seconds / self.control_period))

    @property
    def n_measured(self) -> int:
        """Measurements in one frame of the observation."""
        return 1 if self.observation == "surface" else 3

    @classmethod
    def from_options(cls, options: dict[str, Any]) -> EnvConfig:
        """Options as `gym.make` passes them: dictionaries stand for the nested structures.

        Raises:
            InputError: an option is unknown or out of range.
        """
        known = {item.name for item in fields(cls)}
        unknown = sorted(str(key) for key in set(options) - known)
        if unknown:
            raise InputError(f"unknown option {unknown[0]}; known: {', '.join(sorted(known))}")
        options = dict(options)
        for name, kind in (("rig", Rig), ("encoder", Encoder), ("reward", RewardWeights)):
            if isinstance(options.get(name), dict):
                options[name] = _nested(name, kind, options[name])
        if isinstance(options.get("rig"), (str, Path)):
            from drill_env.parameters import load_rig

            options["rig"] = load_rig(options["rig"])
        return cls(**options)


def _check_choices(config: EnvConfig) -> None:
    choices = (("observation", View), ("start", Start), ("action", ActionUnit), ("method", Method))
    for name, alias in choices:
        value = getattr(config, name)
        if not isinstance(value, str) or value not in get_args(alias):
            raise InputError(f"{name} is {value!r}: give one of {', '.join(get_args(alias))}")


def _nested(name: str, kind: type[Any], values: dict[Any, Any]) -> Any:
    known = {item.name for item in fields(kind)}
    unknown = sorted(str(key) for key in set(values) - known)
    if unknown:
        raise InputError(f"{name}: unknown key {unknown[0]}; known: {', '.join(sorted(known))}")
    return kind(**values)


def _check_kinds(config: EnvConfig) -> None:
    kinds = (("rig", Rig), ("encoder", Encoder), ("reward", RewardWeights))
    for name, kind in kinds:
        if not isinstance(getattr(config, name), kind):
            raise InputError(f"{name} is {getattr(config, name)!r}: give a {kind.__name__}")
    if not isinstance(config.uncertainty, (str, Uncertainty)):
        raise InputError(f"uncertainty is {config.uncertainty!r}: give L0 to L3 or an Uncertainty")


def _check_numbers(config: EnvConfig) -> None:
    for name in ("voltage_limit", "control_period", "episode_seconds", "history", "rtol"):
        real(getattr(config, name), name)
    if not 0 < config.voltage_limit <= MAX_VOLTAGE:
        raise InputError(f"voltage_limit is {config.voltage_limit}: give 0 to {MAX_VOLTAGE:g} V")
    if not 0.01 - 1e-9 <= config.control_period <= 0.2 + 1e-9:
        raise InputError(f"control_period is {config.control_period}: give 0.01 to 0.2 s")
    if not config.control_period <= config.episode_seconds <= LONGEST_EPISODE:
        raise InputError(
            f"episode_seconds is {config.episode_seconds}: give a period to {LONGEST_EPISODE:g} s"
        )
    if config.history != int(config.history) or not 0 <= config.history <= 1000:
        raise InputError(f"history is {config.history}: give a whole number of frames, 0 to 1000")
    if not 1e-12 <= config.rtol <= 1e-2:
        raise InputError(f"rtol is {config.rtol}: give 1e-12 to 1e-2")
    low, high = reals(config.setpoint_range, "setpoint_range", 2)
    if not 0 < low <= high <= SETPOINT_BOUND:
        raise InputError(f"setpoint_range is {low}, {high}: give 0 < low <= high <= 60 rad/s")
    if config.setpoint is not None:
        check_setpoint(config.setpoint)
    checked_schedule(config.schedule)
    if config.friction_step is not None:
        checked_friction_step(config.friction_step)
