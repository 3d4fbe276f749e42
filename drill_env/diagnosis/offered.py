"""What a search may move and what it may add, by the rig and the recordings it starts from."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import replace

import numpy as np

from drill_env.diagnosis.shapes import TURN
from drill_env.effects import LIBRARY, Effect
from drill_env.identification.coordinates import active_names
from drill_env.identification.samples import Samples
from drill_env.identification.torn import with_integrals
from drill_env.parameters import SYMBOLS, Rig

# Speed (rad/s) up to which the paper's rig is driven, for which the library's grids are made.
_USUAL_SPEED = 4.0
_ROWS = 20
# Way (rad) of a pendulum over which its torque is no straight line.
_SWING = 1.0
# An asymmetry lies within the level that it is an asymmetry of.
_LEVELS = {"dTsu": "Tsu", "dbu": "bu"}


def free_parameters(rig: Rig, fixed: Container[str] = (), scale: str = "Ju") -> list[str]:
    """Names of the rig's parameters that are fitted, in the order of `SYMBOLS`.

    Args:
        rig: where to start. `Tsu` or `bu` of 0 is a model without that term: its coordinate is a
            logarithm, so it stays out, and its asymmetry with it.
        fixed: parameters that are held besides the scale of torque.
        scale: the parameter that sets it: Ju, or km where the drive is a measured torque.
    """
    absent = {name for name in ("Tsu", "bu") if getattr(rig, name) == 0.0}
    absent |= {name for name, level in _LEVELS.items() if level in absent}
    known = active_names(rig) - absent - {scale}
    return [name for name in SYMBOLS if name in known and name not in fixed]


def offered_effects(
    rig: Rig, free: Container[str], samples: Sequence[Samples], leave_out: Container[str] = ()
) -> list[Effect]:
    """The effects of the library that a rig can have and recordings can show.

    Args:
        rig: where to start.
        free: its free parameters; an effect that is a parameter of the rig is offered where the
            rig lacks that, so where it is 0 and held.
        samples: recordings. An axis that never makes a turn has no effect that repeats with one,
            but for a pendulum, which needs to swing no further than where its torque bends.
        leave_out: ids that are not wanted.
    """
    alone = rig.inertias == 1
    way = max((_travel(s) for s in samples), default=0.0)
    scale = max(_speed(s) for s in samples) / _USUAL_SPEED if alone else 1.0
    return [
        _scaled(effect, scale) if alone else effect
        for effect in LIBRARY.values()
        if effect.id not in leave_out
        and (effect.equation == "upper" if alone else not effect.axis_only)
        and not (effect.stands_for and _has(rig, effect.stands_for, free))
        and not (alone and repeats(effect) and way < _least_way(effect))
    ]


def is_parameter(name: str) -> bool:
    """Whether an effect of that name is a parameter of the rig's own model."""
    return name in LIBRARY and bool(LIBRARY[name].stands_for)


def repeats(effect: Effect) -> bool:
    """Whether an effect comes back with every turn of a disc."""
    turned = any(p.role == "phase" for p in effect.parameters)
    return turned and effect.depends_on.startswith("theta")


def _has(rig: Rig, name: str, free: Container[str]) -> bool:
    return name in free or getattr(rig, name) != 0.0


def _scaled(effect: Effect, scale: float) -> Effect:
    """The effect with its grids of speeds where the axis has its speeds."""
    parameters = tuple(
        replace(p, grid=tuple(min(max(v * scale, p.low), p.high) for v in p.grid))
        if p.unit == "rad/s" and p.role == "shape"
        else p
        for p in effect.parameters
    )
    return replace(effect, parameters=parameters)


def _speed(samples: Samples) -> float:
    """Speed (rad/s) that is hardly exceeded; over some rows, for readings come in steps."""
    omega = samples.recording.omega_u
    if omega is not None:
        return max(float(np.nanquantile(np.abs(omega), 0.99)), 1e-9)
    way = np.abs(samples.angles[_ROWS:, 0] - samples.angles[:-_ROWS, 0])
    known = way[np.isfinite(way)]
    seconds = _ROWS * samples.recording.interval
    return max(float(np.quantile(known, 0.99)) / seconds, 1e-9) if len(known) else _USUAL_SPEED


def _travel(samples: Samples) -> float:
    """Way (rad) between the upper disc's ends."""
    theta = with_integrals(samples.recording).theta_u
    return 0.0 if theta is None else float(np.nanmax(theta) - np.nanmin(theta))


def _least_way(effect: Effect) -> float:
    """Way (rad) from which on an effect that repeats shows as such."""
    return _SWING if effect.id == "upper_unbalance" else TURN
