"""Physics that one-inertia axes are made with and their rig files lack: is it found?

python -m benchmarks.axes --cases 60 --seed 1 [--json out.json]

Terms come in turn: of the library, laws that differ from the library's, physics that it does not
have, nothing. Four recordings are made of each axis, two of them are held out. `axis_maker` shares
no code with the package.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from benchmarks.axis_maker import (
    COMPONENTS,
    DIFFERING,
    LISTED,
    SIBLINGS,
    UNLISTED,
    Axis,
    draw,
    recorded,
)
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.result import DiagnosisResult
from drill_env.parameters import Rig
from drill_env.prediction.families import family_of
from drill_env.recordings import Recording

ORDER = (*LISTED[:8], "nothing", *DIFFERING, *LISTED[8:], "nothing", *UNLISTED, "nothing")
GROUPS = ("library", "law differs", "no library", "nothing")


def group_of(term: str) -> str:
    """Of `GROUPS`."""
    if term == "nothing":
        return term
    return "library" if term in LISTED else "law differs" if term in DIFFERING else "no library"


def judged(term: str, found: DiagnosisResult) -> str:
    """right, wrong, silent, or what alone is right: the family of a name, the place of a shape."""
    group, where = group_of(term), COMPONENTS.get(term, "upper")
    named = [e.id for e in found.effects]
    if not named and found.verdict != "unexplained":
        return "right" if group == "nothing" else "silent"
    told = found.located.component if found.located else ""
    if group == "nothing":
        return "wrong"
    allowed = (term,) if group == "library" else SIBLINGS.get(term, ())
    if named[:1] and named[0] in allowed or (group == "no library" and not named and told == where):
        return "right"
    families = {family_of(name) for name in allowed}
    if named and family_of(named[0]) in families:
        return "family"
    return "place" if not named and told == where else "wrong"


def axis_of(case: int, seed: int) -> tuple[Axis, list[Recording], Rig]:
    """One axis, its four recordings, and its rig file."""
    rng = np.random.default_rng([seed, case])
    axis = draw(ORDER[case % len(ORDER)], rng)
    runs = []
    for i in range(4):
        made = recorded(axis, rng)
        step = made.pop("step")
        runs.append(Recording(**made, quanta={"theta_u": step}, source=f"axis {case}, run {i}"))
    return axis, runs, Rig.one_inertia(**axis.given)


def row_of(case: int, seed: int) -> dict[str, Any]:
    """What is said of one axis, and whether it is right."""
    began = time.process_time()
    axis, runs, rig = axis_of(case, seed)
    options = DiagnosisOptions(given_rig=True, doubt=0.1)
    found = diagnose(runs[:2], rig, runs[2:], options=options).result
    first = found.effects[0] if found.effects else None
    inside = {}
    if first is not None and first.id == axis.term:
        for name, truth in axis.truth.items():
            number = first.parameters[name]
            inside[name] = [truth, number.value, number.low, number.high]
    return {
        "case": case, "term": axis.term, "group": group_of(axis.term),
        "kind": axis.kind, "verdict": found.verdict, "named": [e.id for e in found.effects],
        "component": found.located.component if found.located else "",
        "law": found.grades.law_probability if found.grades else 0.0,
        "judged": judged(axis.term, found), "numbers": inside,
        "cpu_s": time.process_time() - began,
    }  # fmt: skip


def main(
    cases: Annotated[int, typer.Option(help="How many axes.")] = 28,
    seed: Annotated[int, typer.Option(help="Of the axes.")] = 1,
    first: Annotated[int, typer.Option(help="Number of the first one.")] = 0,
    json_out: Annotated[Path | None, typer.Option("--json", help="Where rows go.")] = None,
) -> None:
    """Diagnose axes and print one line of each, then the counts."""
    console, rows = Console(width=140), list[dict[str, Any]]()
    table = Table("case", "left out", "verdict", "named", "component", "law", "judged", "CPU s")
    for case in range(first, first + cases):
        rows.append(row := row_of(case, seed))
        table.add_row(
            str(case), row["term"], row["verdict"], ", ".join(row["named"]), row["component"],
            f"{row['law']:.2f}", row["judged"], f"{row['cpu_s']:.0f}",
        )  # fmt: skip
        if json_out is not None:
            json_out.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    console.print(table)
    for group in GROUPS:
        own = [r for r in rows if r["group"] == group]
        right, family = (sum(r["judged"] == what for r in own) for what in ("right", "family"))
        console.print(f"{group}: {right} of {len(own)} right, {family} by family alone")
    inside = [low <= truth <= high for r in rows for truth, _, low, high in r["numbers"].values()]
    console.print(f"intervals: {sum(inside)} of {len(inside)} hold the number of the plant")
    console.print(f"CPU: median {np.median([r['cpu_s'] for r in rows]):.0f} s")


if __name__ == "__main__":
    typer.run(main)
