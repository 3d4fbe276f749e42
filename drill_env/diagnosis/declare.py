"""Terms as the [[effects]] of a rig file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.shapes import TURN
from drill_env.diagnosis.strikes import Once, Strike, outline
from drill_env.diagnosis.terms import Shape, Source, Term
from drill_env.diagnosis.waves import Wave, one_period, period_of
from drill_env.parameters import SYMBOLS, Rig

# Of a period of a wave: straight lines between them are off by a thousandth of its size.
_KNOTS = 64


def declaration(term: Term) -> dict[str, Any]:
    """One term as an entry of [[effects]]."""
    if isinstance(term.source, Wave):
        x, y = one_period(term, _KNOTS)
        return {
            "id": "table",
            "component": term.source.effect.component,
            "depends_on": term.source.effect.depends_on,
            "sort": "torque",
            "period": period_of(term),
            "knots": x.tolist(),
            "values": y.tolist(),
        }
    if not isinstance(term.source, Shape):
        names = [p.name for p in term.source.effect.parameters]
        return {"id": term.id, **dict(zip(names, term.q.tolist(), strict=True))}
    shape = term.source
    knots, values = _continued(shape, term.q)
    entry: dict[str, Any] = {
        "id": "table",
        "component": shape.component,
        "depends_on": shape.depends_on,
        "sort": shape.sort,
        "knots": knots,
        "values": values,
    }
    if shape.sort == "error":
        entry["encoder"] = "upper" if shape.id.startswith("error_u") else "lower"
    return entry


def _continued(shape: Shape, q: FloatArray) -> tuple[list[float], list[float]]:
    """The shape's table with its straight continuation over once more its range on both sides."""
    if isinstance(shape, Strike):
        times, torques = outline(shape, q)
        return times.tolist(), torques.tolist()
    x, y = np.array(shape.knots), q
    if shape.depends_on.startswith("theta"):
        # Of a way shorter than a turn the ends are joined where it never comes.
        order = np.argsort(np.mod(x, TURN))
        return np.mod(x, TURN)[order].tolist(), y[order].tolist()
    reach = x[-1] - x[0]
    low = y[0] - reach * (y[1] - y[0]) / (x[1] - x[0])
    high = y[-1] + reach * (y[-1] - y[-2]) / (x[-1] - x[-2])
    return [x[0] - reach, *x.tolist(), x[-1] + reach], [low, *y.tolist(), high]


def extended_rig(rig: Rig, terms: Sequence[Term]) -> Rig:
    """A rig with the terms among its effects; single events of one recording are no part of it.

    A term that is a parameter which the rig lacked becomes that parameter, where the rig allows it.
    """
    effects = list(rig.effects)
    # Levels come before the asymmetries that lie within them.
    for term in sorted(terms, key=lambda t: SYMBOLS.index(_own(t)) if _own(t) else -1):
        if _single(term.source):
            continue
        own = _own(term)
        try:
            given = rig.replace(**{own: float(term.q[0])}) if own else None
        except InputError:
            given = None
        if given is None:
            effects.append(declaration(term))
        else:
            rig = given
    return rig.replace(effects=tuple(effects))


def _single(source: Source) -> bool:
    """Whether it stands for events of one recording."""
    if isinstance(source, Strike):
        return source.recording is not None
    return isinstance(source, (LostCounts, Once))


def _own(term: Term) -> str:
    return "" if isinstance(term.source, Shape) else term.source.effect.stands_for
