"""Terms as the [[effects]] of a rig file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.slips import Slips
from drill_env.diagnosis.terms import Shape, Term
from drill_env.parameters import Rig


def declaration(term: Term) -> dict[str, Any]:
    """One term as an entry of [[effects]]."""
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
    x, y = np.array(shape.knots), q
    if shape.depends_on.startswith("theta"):
        return x.tolist(), y.tolist()
    reach = x[-1] - x[0]
    low = y[0] - reach * (y[1] - y[0]) / (x[1] - x[0])
    high = y[-1] + reach * (y[-1] - y[-2]) / (x[-1] - x[-2])
    return [x[0] - reach, *x.tolist(), x[-1] + reach], [low, *y.tolist(), high]


def extended_rig(rig: Rig, terms: Sequence[Term]) -> Rig:
    """A rig with the terms among its effects; single events of one recording are no part of it."""
    lasting = [term for term in terms if not isinstance(term.source, Slips)]
    return rig.replace(effects=(*rig.effects, *(declaration(term) for term in lasting)))
