"""What the declaration of an effect says."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from drill_env._errors import InputError
from drill_env._jit import names_in
from drill_env._types import FloatArray
from drill_env.effects.signal import response

Component: TypeAlias = Literal["actuator", "upper", "string", "lower", "sensor"]
Equation: TypeAlias = Literal["upper", "lower", "both"]
Role: TypeAlias = Literal["amplitude", "phase", "shape"]

_EQUATIONS = {"actuator": "upper", "upper": "upper", "string": "both", "lower": "lower"}

FORM = 0.015
"""Relative standard deviation of a number for its formula's sake.

A law of the library is not the rig's to the last digit, and every rig has a little of what no law
tells: on the opened cases of the proof's eighth and ninth runs numbers that noise alone told to
half a per cent were off by one or two.
"""


@dataclass(frozen=True, slots=True)
class EffectParameter:
    """One number of an effect.

    Attributes:
        name: as in files and reports.
        unit: SI.
        role: the effect is proportional to an amplitude; a phase turns it by an angle; a shape
            does neither.
        grid: values of a shape that a search tries; an amplitude's one value is its usual size.
        low: lowest sensible value.
        high: highest sensible value.
        form: relative standard deviation for its formula's sake, beside that of noise; 0 for
            moments, frequencies and orders, which no formula bends.
    """

    name: str
    unit: str
    role: Role
    grid: tuple[float, ...]
    low: float
    high: float
    form: float = FORM


def reads(kernel: Any, *fields: str) -> bool:
    """Whether an effect's function mentions any of these fields of the signal or the ports."""
    return not names_in(kernel).isdisjoint(fields)


SIDES = ("side_u", "side_l", "friction_u")
"""Fields of the signal that tell the two sides of a disc at rest apart."""


@dataclass(frozen=True, slots=True)
class Effect:
    """Physics that the rig of the paper leaves out.

    Attributes:
        component: where it sits.
        depends_on: what it is a function of.
        meaning: one plain sentence for a report.
        parameters: its numbers, in the order of the kernel's `q`.
        neighbours: effects it is easily confused with.
        aliases: effects that no recording tells from it.
        source: reference.
        stands_for: parameter of the rig that it is; a search offers it where the rig lacks that.
        axis_only: whether a search offers it for one inertia alone: with a string the upper disc
            hardly reverses.
        at_rest: whether it decides when a disc comes to rest and leaves it: a filter then takes
            it at its own state.
        only_at_rest: whether it acts on a disc at rest alone: no torque along a motion shows it.
        refined_within: whether a last fit takes it at the filter's own state, though a search may
            follow the smoothed motion: along that its numbers come out wrong.
        rigs_own_if_slow: whether it is the rig's own physics when its last parameter, a time, is
            far longer than a recording.
        rigs_own_if_early: likewise when its last parameter, a moment or the time in which it
            settles, is at a recording's start.
        limit: the parameter at whose least value it is another effect, and that effect's id.
        forgets: whether what was long ago leaves no trace in it.
        passing: whether it ends some time after the voltage has become constant.
        replaces_balance: whether it puts a drive in the place of the voltage's torque on the upper
            disc; it is then evaluated after the others of the drive.
        last: whether it looks at the torques of all others and is evaluated after them.
        common: whether most machines have it, so that its prior odds as a name are higher.
        heavier: of its numbers and of how many times the inertia its disc has in a recording, the
            numbers by which the same body acts there; None where none is a share of that inertia.
        states: how many inner states it has, of first-order differential equations; they are 0 at
            first unless the kernel sets them where `s.first`.
        switches: how many corners or jumps it has, at which the integrator ends its steps.
        delay: the parameter by which it reads the voltage or an angle late.
        swings: the parameter, in Hz, at which it swings with time whatever moves.
        kernel: function of (p, e, s, out), compiled: the rig's parameters, its own numbers `e.q`
            and inner states `e.z`, whose rates `e.rate` it sets, the signal at the instant, and
            the ports of the equations of motion that it adds to.
        id: name in files and reports; by default that of the kernel.
        formula: what is added, in the symbols of the paper; by default the kernel's docstring.
        equation: the disc whose equation of motion it enters; by default that of the component.
    """

    component: Component
    depends_on: str
    meaning: str
    parameters: tuple[EffectParameter, ...]
    kernel: Any
    id: str = ""
    formula: str = ""
    equation: Equation | Literal[""] = ""
    neighbours: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    source: str = ""
    stands_for: str = ""
    axis_only: bool = False
    at_rest: bool = False
    only_at_rest: bool = False
    refined_within: bool = False
    rigs_own_if_slow: bool = False
    rigs_own_if_early: bool = False
    limit: tuple[str, str] | None = None
    states: int = 0
    switches: int = 0
    delay: str = ""
    swings: str = ""
    forgets: bool = True
    passing: bool = False
    replaces_balance: bool = False
    last: bool = False
    common: bool = False
    heavier: Callable[[FloatArray, float], FloatArray] | None = None

    def __post_init__(self) -> None:
        if not self.id:
            object.__setattr__(self, "id", self.kernel.function.__name__)
        if not self.formula:
            told = inspect.cleandoc(self.kernel.function.__doc__ or "").partition("\n")[0]
            object.__setattr__(self, "formula", told.rstrip("."))
        if not self.equation:
            sensed = "upper" if self.depends_on.endswith("_u") else "lower"
            object.__setattr__(self, "equation", _EQUATIONS.get(self.component, sensed))

    @property
    def senses(self) -> bool:
        """Whether it is an error of an encoder and no torque."""
        return self.component == "sensor"

    @property
    def autonomous(self) -> bool:
        """Whether the rig can turn steadily with it under a constant voltage.

        It then follows neither time nor an angle and forgets what was.
        """
        return self.forgets and not reads(self.kernel, "t", "theta_u", "theta_l")

    @property
    def holds(self) -> bool:
        """Whether it changes the friction, and so what a disc at rest withstands."""
        return reads(self.kernel, "size_u", "size_l", "scale_u", "scale_l")

    def vector(self, values: dict[str, float]) -> FloatArray:
        """Its parameters as the kernel reads them.

        Raises:
            InputError: a parameter is missing, unknown or no number in its range.
        """
        names = [p.name for p in self.parameters]
        unknown = sorted(set(values) - set(names))
        missing = [name for name in names if name not in values]
        if unknown or missing:
            raise InputError(
                f"effect {self.id}: {'unknown' if unknown else 'missing'} parameter "
                f"{(unknown or missing)[0]}; it has {', '.join(names)}"
            )
        vector = np.array([float(values[name]) for name in names])
        for parameter, value in zip(self.parameters, vector.tolist(), strict=True):
            if not (parameter.low <= value <= parameter.high):
                raise InputError(
                    f"effect {self.id}: {parameter.name} is {value}, give "
                    f"{parameter.low:g} to {parameter.high:g} {parameter.unit}"
                )
        return vector


def effect(
    component: Component, depends_on: str, meaning: str, *parameters: EffectParameter, **more: Any
) -> Callable[[Callable[..., None]], Effect]:
    """Decorator of a function of (p, e, s, out), which it makes an `Effect`.

    Args:
        component: where it sits.
        depends_on: what it is a function of.
        meaning: one plain sentence for a report.
        *parameters: its numbers, in the order of `e.q`.
        **more: what else it declares, see `Effect`.
    """

    def declared(function: Callable[..., None]) -> Effect:
        kernel = response(function)
        # Pickled by name, which is the effect's.
        kernel.__qualname__ = f"{function.__qualname__}.kernel"
        return Effect(component, depends_on, meaning, parameters, kernel, **more)

    return declared


HEAVIEST = 1e5
"""Largest amplitude in Nm, Nm/rad and the like: rigs have any size, and N for Nm if linear."""


def amplitude(
    name: str, unit: str, usual: float, *, most: float, signed: bool = True, form: float = FORM
) -> EffectParameter:
    """A parameter to which the effect is proportional."""
    return EffectParameter(name, unit, "amplitude", (usual,), -most if signed else 0.0, most, form)


def phase(name: str = "phase") -> EffectParameter:
    """An angle by which the effect is turned."""
    return EffectParameter(name, "rad", "phase", (0.0,), -7.0, 7.0)


def shape(
    name: str, unit: str, grid: tuple[float, ...], *, low: float = 0.0, high: float = np.inf,
    form: float = FORM,
) -> EffectParameter:  # fmt: skip
    """A parameter that a search tries on a grid."""
    return EffectParameter(name, unit, "shape", grid, low, high, form)
