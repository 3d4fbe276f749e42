"""Terms: what is added to the rig, a named effect or a free shape, with its numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.late_readings import LATE, ahead
from drill_env.diagnosis.rig_parameters import made_of
from drill_env.effects import Effect, EffectParameter
from drill_env.effects.along import Motion, responses_along
from drill_env.effects.declared import bundled
from drill_env.parameters import Rig
from drill_env.parameters.rig import LOWER_LAW

_RELATIVE_STEP = 1e-4
# Events that come a little early or late make predictions rough: two in a hundred even that out.
_AT_REST_STEPS = 200.0


class Source(Protocol):
    """What a term's torques and reading errors come from."""

    @property
    def id(self) -> str:
        """Name in reports."""
        ...

    @property
    def component(self) -> str:
        """Where it acts."""
        ...

    @property
    def made_of(self) -> tuple[str, ...]:
        """Parameters of the rig that its torques are made of."""
        ...

    def response(self, q: FloatArray, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Torques (Nm) and reading errors (rad) of both discs, each of shape (n, 2)."""
        ...

    def steps(self, q: FloatArray) -> FloatArray:
        """How far each number moves for a finite difference."""
        ...

    def bounded(self, q: FloatArray) -> FloatArray:
        """The numbers within their range."""
        ...


@dataclass(frozen=True, slots=True)
class Named:
    """An effect of the library as a source of terms.

    Attributes:
        effect: of the library.
        within: whether it acts at the filter's own state though it decides no rest.
        probe: how far each number moves for a finite difference within the filter, if it is known
            how uncertain they are.
        times: its own inertia that the disc has in a recording.
    """

    effect: Effect
    within: bool = False
    probe: tuple[float, ...] = ()
    times: float = 1.0

    @property
    def id(self) -> str:
        """The effect's."""
        return self.effect.id

    @property
    def component(self) -> str:
        """The effect's."""
        return self.effect.component

    @property
    def made_of(self) -> tuple[str, ...]:
        """Parameters of the rig that its torques are made of."""
        return made_of(self.effect)

    def response(self, q: FloatArray, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """The effect's torques and reading errors."""
        return responses_along(bundled([(self.effect, self.acts_by(q))]), rig, motion)

    def acts_by(self, q: FloatArray) -> FloatArray:
        """The numbers as they act in a recording in which the disc is heavier."""
        heavier = self.effect.heavier
        return q if heavier is None or self.times == 1.0 else heavier(q, self.times)

    def steps(self, q: FloatArray) -> FloatArray:
        """A thousandth of each number, or of its usual size."""
        usual = [abs(p.grid[0]) if p.role == "amplitude" else 0.0 for p in self.effect.parameters]
        places = [1.0 if p.role == "phase" or _is_place(p) else 0.0 for p in self.effect.parameters]
        return _RELATIVE_STEP * np.maximum(np.maximum(np.abs(q), usual), places)

    def probes(self, q: FloatArray) -> FloatArray:
        """How far each number moves for a finite difference within the filter."""
        return np.array(self.probe) if self.probe else _AT_REST_STEPS * self.steps(q)

    def bounded(self, q: FloatArray) -> FloatArray:
        """Amplitudes and shapes within the declared range, phases within one turn."""
        out = np.array(q, dtype=np.float64)
        for i, p in enumerate(self.effect.parameters):
            if p.role == "phase":
                out[i] = (out[i] + np.pi) % (2.0 * np.pi) - np.pi
            else:
                low = p.low if p.role == "amplitude" or _is_place(p) else max(p.low, 1e-6)
                out[i] = min(max(out[i], low), p.high)
        return out


def _is_place(p: EffectParameter) -> bool:
    """Whether a shape is a place on either side of 0 and no size."""
    return p.role == "shape" and p.low < 0.0


@dataclass(frozen=True, slots=True)
class Shape:
    """A free function of one coordinate, linear in its numbers.

    Attributes:
        id: name in reports.
        component: where its torque acts.
        depends_on: the coordinate.
        sort: "torque", "friction" (turned against the motion), "drive" (a share of km u),
            "damping" (times a speed), "stiffness" (a share of the string's torque) or "error".
        knots: values of the coordinate at which its numbers are the function's values.
        basis: gives torques and errors of every number, each (n, 2, size), or None for none.
        kept: projects its numbers on what no free parameter of the rig can do, shape (size, size);
            None where the rig can do nothing of it.
    """

    id: str
    component: str
    depends_on: str
    sort: str
    knots: tuple[float, ...]
    basis: Callable[[Rig, Motion], tuple[FloatArray | None, FloatArray | None]]
    kept: FloatArray | None = field(default=None, kw_only=True)

    @property
    def size(self) -> int:
        """How many numbers it has."""
        return len(self.knots)

    @property
    def made_of(self) -> tuple[str, ...]:
        """Parameters of the rig that its torques are made of."""
        if self.sort == "friction" and self.component == "lower":
            return LOWER_LAW
        return {"drive": ("km",), "stiffness": ("ktheta",)}.get(self.sort, ())

    def response(self, q: FloatArray, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """The function's torques and reading errors."""
        loads, errors = self.basis(rig, motion)
        nothing, q = np.zeros((len(motion.t), 2)), self.bounded(q)
        return (
            nothing if loads is None else loads @ q,
            nothing if errors is None else errors @ q,
        )

    def slopes(self, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
        """Torques and reading errors of each number alone, each of shape (n, 2, size)."""
        loads, errors = self.basis(rig, motion)
        nothing = np.zeros((len(motion.t), 2, self.size))
        if loads is not None and self.kept is not None:
            loads = loads @ self.kept
        return nothing if loads is None else loads, nothing if errors is None else errors

    def steps(self, q: FloatArray) -> FloatArray:
        """Any will do: it is linear."""
        return np.ones_like(q)

    def bounded(self, q: FloatArray) -> FloatArray:
        """Without what the rig's own parameters can do; there are no other bounds."""
        return q if self.kept is None else self.kept @ q


@dataclass(frozen=True, slots=True, eq=False)
class Term:
    """A source with its numbers."""

    source: Named | Shape
    q: FloatArray

    @property
    def id(self) -> str:
        """The source's."""
        return self.source.id

    def slopes(
        self, rig: Rig, motion: Motion, below: tuple[FloatArray, FloatArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Derivatives of torques and errors by the numbers, each of shape (n, 2, size).

        Args:
            rig: parameters.
            motion: of the rig.
            below: the term's torques and errors there.
        """
        if isinstance(self.source, Shape):
            return self.source.slopes(rig, motion)
        n = len(motion.t)
        disc = late_disc(self)
        if disc is not None:
            errors = np.zeros((n, 2, 1))
            errors[:, disc, 0] = -motion.states[:, 1 + disc]
            return np.zeros((n, 2, 1)), errors
        steps = self.source.steps(self.q)
        loads, errors = np.zeros((n, 2, len(self.q))), np.zeros((n, 2, len(self.q)))
        for i, step in enumerate(steps.tolist()):
            move = np.zeros_like(self.q)
            move[i] = step
            above = self.source.response(self.q + move, rig, motion)
            loads[:, :, i] = (above[0] - below[0]) / step
            errors[:, :, i] = (above[1] - below[1]) / step
        return loads, errors

    def slopes_by(
        self, names: Sequence[str], rig: Rig, motion: Motion, below: FloatArray
    ) -> FloatArray:
        """Derivatives of torques (Nm) by parameters of the rig, shape (n, 2, len(names)).

        Args:
            names: of the parameters.
            rig: parameters.
            motion: of the rig.
            below: the term's torques there, Nm, shape (n, 2).
        """
        out = np.empty((len(motion.t), 2, len(names)))
        for i, name in enumerate(names):
            value = getattr(rig, name)
            step = _RELATIVE_STEP * max(abs(value), _RELATIVE_STEP)
            moved = rig.replace(**{name: value + step})
            out[:, :, i] = (self.source.response(self.q, moved, motion)[0] - below) / step
        return out


def at_rest(term: Term) -> bool:
    """Whether a term acts at the filter's own state, as what decides when a disc rests must."""
    source = term.source
    return isinstance(source, Named) and (source.effect.at_rest or source.within)


def late_disc(term: Term) -> int | None:
    """The disc whose encoder a term makes late, if it does."""
    return LATE.get(term.id) if isinstance(term.source, Named) else None


def corrected(term: Term, motion: Motion) -> Motion:
    """The motion behind readings that are late, when it was told by the late readings.

    Other errors of the readings depend on the angle itself and hardly change with it.
    """
    disc = late_disc(term)
    return motion if disc is None else ahead(motion, disc, float(term.q[0]))
