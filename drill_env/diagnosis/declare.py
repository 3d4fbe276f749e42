"""Terms as the [[effects]] of a rig file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from drill_env.diagnosis.slips import Slips
from drill_env.diagnosis.terms import Shape, Term
from drill_env.parameters import Rig


def declaration(term: Term) -> dict[str, Any]:
    """One term as an entry of [[effects]]."""
    if not isinstance(term.source, Shape):
        names = [p.name for p in term.source.effect.parameters]
        return {"id": term.id, **dict(zip(names, term.q.tolist(), strict=True))}
    shape = term.source
    entry: dict[str, Any] = {
        "id": "table",
        "component": shape.component,
        "depends_on": shape.depends_on,
        "sort": shape.sort,
        "knots": list(shape.knots),
        "values": term.q.tolist(),
    }
    if shape.sort == "error":
        entry["encoder"] = "upper" if shape.id.startswith("error_u") else "lower"
    return entry


def extended_rig(rig: Rig, terms: Sequence[Term]) -> Rig:
    """A rig with the terms among its effects; single events of one recording are no part of it."""
    lasting = [term for term in terms if not isinstance(term.source, Slips)]
    return rig.replace(effects=(*rig.effects, *(declaration(term) for term in lasting)))
