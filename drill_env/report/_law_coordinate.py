"""The coordinate over which a term's law is drawn."""

from __future__ import annotations

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.shapes import COORDINATES, TURN, comes_round
from drill_env.diagnosis.terms import Shape, Term
from drill_env.effects.along import Motion

_WORDS = {
    "time": "time [s]",
    "voltage": "voltage [V]",
    "theta_u": "angle of the upper disc [rad]",
    "theta_l": "angle of the lower disc [rad]",
    "twist": "twist of the string [rad]",
    "omega_u": "speed of the upper disc [rad/s]",
    "omega_l": "speed of the lower disc [rad/s]",
    "omega_u - omega_l": "speed of the upper less that of the lower disc [rad/s]",
}


def law_coordinate(term: Term, motions: tuple[Motion, ...]) -> tuple[str, list[FloatArray]]:
    """The coordinate of a term's law in words and along each motion."""
    source = term.source
    name = source.depends_on if isinstance(source, Shape) else source.effect.depends_on
    if name == "distance":
        return "way of the lower disc [rad]", [_way(m) for m in motions]
    take = COORDINATES.get(name, COORDINATES["omega_l"])
    values = [take(m) for m in motions]
    cycles = cycles_of(term)
    if cycles is None:
        return _WORDS.get(name, _WORDS["omega_l"]), values
    if name == "time":
        return f"phase at {cycles:.4g} Hz [rad]", [np.mod(TURN * cycles * v, TURN) for v in values]
    disc = "upper" if name == "theta_u" else "lower"
    words = f"angle of the {disc} disc within a turn [rad]"
    if f"{cycles:.4g}" != "1":
        words = f"{cycles:.4g} times the angle of the {disc} disc, phase [rad]"
    return words, [np.mod(cycles * v, TURN) for v in values]


def _way(motion: Motion) -> FloatArray:
    steps = np.diff(motion.t, append=motion.t[-1])
    return np.cumsum(np.abs(motion.states[:, 2]) * steps)


def cycles_of(term: Term) -> float | None:
    """Cycles a turn, or a second, of a law that repeats."""
    source = term.source
    if isinstance(source, Shape):
        return 1.0 if comes_round(source.depends_on, source.knots) else None
    parameters = source.effect.parameters
    if not any(p.role == "phase" for p in parameters):
        return None
    for p, value in zip(parameters, term.q.tolist(), strict=True):
        if p.name in ("order", "frequency"):
            return value
    return 1.0
