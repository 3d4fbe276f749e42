"""Free shapes: functions of one coordinate that stand for physics without a name."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import Literal, TypeAlias

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.own_functions import without_own
from drill_env.diagnosis.terms import Shape
from drill_env.effects.along import Motion
from drill_env.friction import lower_curve
from drill_env.parameters import Rig

_ANGLE_HATS = 16
_TIME_HATS = 12
_OTHER_HATS = 9
# Shares of the fastest speed at which there are knots too.
_SLOW = (0.02, 0.06)
_UPPER, _LOWER = 0, 1
TURN = 2.0 * np.pi
"""One turn, rad."""

Coordinate = Callable[[Motion], FloatArray]
Functions = Callable[[FloatArray], FloatArray]
Basis = Callable[[Rig, Motion], tuple[FloatArray | None, FloatArray | None]]


def middle(values: FloatArray) -> FloatArray:
    """Mean of each row and the next, along the first axis."""
    return 0.5 * (values + np.concatenate([values[1:], values[-1:]]))


def hats(values: FloatArray, knots: FloatArray) -> FloatArray:
    """Piecewise linear functions, 1 at one knot and 0 at the others; shape (n, len(knots)).

    Beyond the ends they go on in a straight line: part of what a torque of speed or twist holds
    may stand in the rig's own parameters, which have no ends.
    """
    place = np.clip(np.searchsorted(knots, values, side="right") - 1, 0, len(knots) - 2)
    share = (values - knots[place]) / (knots[place + 1] - knots[place])
    out = np.zeros((len(values), len(knots)))
    rows = np.arange(len(values))
    out[rows, place] = 1.0 - share
    out[rows, place + 1] = share
    return out


def ring(values: FloatArray, count: int) -> FloatArray:
    """Piecewise linear functions of an angle, equally spaced on the turn; shape (n, count)."""
    place = np.mod(values, 2.0 * np.pi) * count / (2.0 * np.pi)
    low = np.floor(place).astype(np.int64)
    out = np.zeros((len(values), count))
    rows = np.arange(len(values))
    out[rows, low % count] = 1.0 - (place - low)
    out[rows, (low + 1) % count] += place - low
    return out


COORDINATES: dict[str, Coordinate] = {
    "time": lambda m: m.t,
    "voltage": lambda m: m.u,
    "theta_u": lambda m: m.states[:, 3] + m.states[:, 0],
    "theta_l": lambda m: m.states[:, 3],
    "twist": lambda m: m.states[:, 0],
    "omega_u": lambda m: m.states[:, 1],
    "omega_l": lambda m: m.states[:, 2],
    "omega_u - omega_l": lambda m: m.states[:, 1] - m.states[:, 2],
}
"""What a free shape can be a function of."""


def _held(name: str, motion: Motion) -> FloatArray:
    values = COORDINATES[name](motion)
    return values if name == "voltage" else middle(values)


def _plain(discs: Sequence[tuple[int, float]], name: str, functions: Functions) -> Basis:
    def basis(rig: Rig, motion: Motion) -> tuple[FloatArray | None, FloatArray | None]:
        values = functions(_held(name, motion))
        loads = np.zeros((len(values), 2, values.shape[1]))
        for disc, sign in discs:
            loads[:, disc] = sign * values
        return loads, None

    return basis


def _driven(name: str, functions: Functions) -> Basis:
    def basis(rig: Rig, motion: Motion) -> tuple[FloatArray | None, FloatArray | None]:
        values = rig.km * motion.u[:, None] * functions(_held(name, motion))
        loads = np.zeros((len(values), 2, values.shape[1]))
        loads[:, _UPPER] = values
        return loads, None

    return basis


def _braking(name: str, functions: Functions) -> Basis:
    def basis(rig: Rig, motion: Motion) -> tuple[FloatArray | None, FloatArray | None]:
        omega = middle(motion.states[:, 2])
        friction = lower_curve(rig, np.abs(omega)) * np.sign(omega)
        values = -functions(_held(name, motion)) * friction[:, None]
        loads = np.zeros((len(values), 2, values.shape[1]))
        loads[:, _LOWER] = values
        return loads, None

    return basis


def _rubbing(name: str, functions: Functions) -> Basis:
    def basis(rig: Rig, motion: Motion) -> tuple[FloatArray | None, FloatArray | None]:
        values = -functions(_held(name, motion)) * np.sign(middle(motion.states[:, 1]))[:, None]
        loads = np.zeros((len(values), 2, values.shape[1]))
        loads[:, _UPPER] = values
        return loads, None

    return basis


def _damping(name: str, functions: Functions) -> Basis:
    def basis(rig: Rig, motion: Motion) -> tuple[FloatArray | None, FloatArray | None]:
        values = -functions(_held(name, motion)) * middle(motion.states[:, 1])[:, None]
        loads = np.zeros((len(values), 2, values.shape[1]))
        loads[:, _UPPER] = values
        return loads, None

    return basis


def _stretching(of_speed: bool, name: str, functions: Functions) -> Basis:
    """The string's damping or stiffness."""

    def basis(rig: Rig, motion: Motion) -> tuple[FloatArray | None, FloatArray | None]:
        x, v, w = middle(motion.states[:, :3]).T
        values = functions(_held(name, motion)) * (v - w if of_speed else rig.ktheta * x)[:, None]
        loads = np.zeros((len(values), 2, values.shape[1]))
        loads[:, _UPPER], loads[:, _LOWER] = -values, values
        return loads, None

    return basis


def _misread(disc: int, name: str, functions: Functions) -> Basis:
    def basis(rig: Rig, motion: Motion) -> tuple[FloatArray | None, FloatArray | None]:
        known = COORDINATES[name](motion)
        # A row is read while the voltage of the row before still acts.
        values = functions(np.append(known[:1], known[:-1]) if name == "voltage" else known)
        errors = np.zeros((len(values), 2, values.shape[1]))
        errors[:, disc] = values
        return None, errors

    return basis


Place: TypeAlias = Literal["upper", "lower", "string"]
"""Where a plain torque acts; the string's turns the lower disc on and the upper one back."""

_PLAIN: dict[Place, list[tuple[int, float]]] = {
    "upper": [(_UPPER, 1.0)],
    "lower": [(_LOWER, 1.0)],
    "string": [(_UPPER, -1.0), (_LOWER, 1.0)],
}
_Maker = Callable[[str, Functions], Basis]
_OFFERED: tuple[tuple[str, str, str, tuple[str, ...], _Maker], ...] = (
    ("upper_torque", "upper", "torque", ("time", "voltage", "theta_u", "omega_u", "twist"),
     partial(_plain, _PLAIN["upper"])),
    ("lower_torque", "lower", "torque", ("time", "theta_l", "omega_l"),
     partial(_plain, _PLAIN["lower"])),
    ("upper_drive", "upper", "drive", ("theta_u", "omega_u"), _driven),
    ("drive", "actuator", "drive", ("time",), _driven),
    ("lower_friction", "lower", "friction", ("time", "theta_l", "twist"), _braking),
    ("upper_friction", "upper", "friction", ("time", "theta_u", "twist"), _rubbing),
    ("upper_damping", "upper", "damping", ("time", "theta_u"), _damping),
    ("string_torque", "string", "torque", ("twist", "omega_u - omega_l"),
     partial(_plain, _PLAIN["string"])),
    ("string_damping", "string", "damping", ("twist", "time", "omega_u"),
     partial(_stretching, True)),
    ("string_stiffness", "string", "stiffness", ("time", "theta_l", "omega_u"),
     partial(_stretching, False)),
    ("error_u", "sensor", "error", ("theta_u", "time", "omega_u", "voltage"),
     partial(_misread, _UPPER)),
    ("error_l", "sensor", "error", ("theta_l", "time", "omega_l"), partial(_misread, _LOWER)),
)  # fmt: skip


def at_driven_disc(shape: Shape) -> bool:
    """Whether a shape acts on the drive or the upper disc, or misreads it, and on nothing else."""
    return shape.component in ("actuator", "upper") or shape.id.startswith("error_u")


def comes_round(depends_on: str, knots: Sequence[float]) -> bool:
    """Whether a shape over so many knots is one of an angle's turn and not of a way."""
    even = TURN * (1.0 - 1.0 / len(knots))
    return depends_on.startswith("theta") and abs(knots[-1] - knots[0] - even) < 1e-9


def _functions(name: str, motions: Sequence[Motion]) -> tuple[FloatArray, Functions]:
    if name.startswith("theta"):
        turn = TURN * np.arange(_ANGLE_HATS) / _ANGLE_HATS
        return turn, lambda values: ring(values, _ANGLE_HATS)
    values = np.concatenate([COORDINATES[name](m) for m in motions])
    if name == "time":
        knots = np.linspace(0.0, float(values.max()), _TIME_HATS)
    else:
        # Between quantiles and even spacing: friction changes fast near rest, drag far from it.
        inner = np.quantile(values, np.linspace(0.0, 1.0, _OTHER_HATS))
        even = np.linspace(float(values.min()), float(values.max()), _OTHER_HATS)
        knots = np.unique(0.5 * (inner + even))
        if name in ("omega_u", "omega_l"):
            knots = _with_slow(knots)
    return knots, lambda values: hats(values, knots)


def _with_slow(knots: FloatArray) -> FloatArray:
    """Knots of a speed with those near rest, where friction changes within a small part of it."""
    fastest = float(np.abs(knots).max())
    slow = fastest * np.array([sign * share for share in _SLOW for sign in (-1.0, 1.0)])
    slow = slow[(slow > knots[0]) & (slow < knots[-1])]
    near = 0.5 * fastest * min(_SLOW)
    far = np.abs(knots[:, None] - slow).min(axis=1, initial=np.inf) > near
    return np.unique(np.concatenate([knots[far], slow]))


def _products(name: str, functions: Functions, motions: Sequence[Motion]) -> FloatArray:
    """Products of the functions of the knots, summed over all rows, shape (knots, knots)."""
    rows = [functions(COORDINATES[name](m)) for m in motions]
    return np.sum([r.T @ r for r in rows], axis=0)


def free_shapes(motions: Sequence[Motion], free: Collection[str] = ()) -> tuple[Shape, ...]:
    """The shapes that recordings of these motions can tell.

    Args:
        motions: of the fitted recordings; they set the range of each coordinate.
        free: names of the rig's parameters that are fitted; what these can do is no shape.
    """
    forms = {name: _functions(name, motions) for name in COORDINATES}
    # A voltage that is constant throughout tells no function of it.
    forms = {name: form for name, form in forms.items() if len(form[0]) > 1}
    products = {name: _products(name, form[1], motions) for name, form in forms.items()}
    return tuple(
        Shape(f"{what}_of_{name}", component, name, sort, tuple(forms[name][0]),
              make(name, forms[name][1]),
              kept=without_own(what, name, forms[name][0], products[name], free))
        for what, component, sort, names, make in _OFFERED
        for name in names if name in forms
    )  # fmt: skip


def plain_shape(place: Place, name: str, motions: Sequence[Motion]) -> Shape | None:
    """A torque at some place as a function of one coordinate, or None where that is constant.

    Args:
        place: where it acts.
        name: of `COORDINATES`.
        motions: they set the coordinate's range.
    """
    if np.ptp(np.concatenate([COORDINATES[name](m) for m in motions])) == 0.0:
        return None
    knots, functions = _functions(name, motions)
    if len(knots) < 2:
        return None
    basis = _plain(_PLAIN[place], name, functions)
    return Shape(f"{place}_torque_of_{name}", place, name, "torque", tuple(knots), basis)
