"""Every effect beside an independent reference: largest errors of both discs' speeds.

    python benchmarks/effects_accuracy.py [--effects NAME]... [--seconds 60] [--out FILE]

Three runs from rest for each effect that moves the rig: a limit cycle, a schedule of steps and a
reversing one. The reference (`effects_reference`) is SciPy's DOP853 between located events, written
from the formulas, and has the same numbers of the effects, the middle of their grids. A run that
exceeds the bar of 1e-7 rad/s is solved twice more, which tells whether the reference is at its own
limit or the motion amplifies.
"""

from __future__ import annotations

import csv
import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from effects_reference.settings import MOVING, Problem
from effects_reference.simulation import Array
from rich.console import Console
from rich.progress import track
from rich.table import Table

BAR = 1e-7
RUNS = {
    "limit cycle": (3.5,),
    "steps": (2.0, 5.0, 1.5),
    "reversing": (4.0, -4.0, 2.0, -5.0, 3.0, -1.5),
}
HEAD = ("effect", *RUNS, "CPU s")
SAMPLES_PER_SECOND = 100


def apart(a: Array, b: Array) -> float:
    """Largest difference of either disc's speed, rad/s."""
    return float(np.abs(a[:, 1:3] - b[:, 1:3]).max())


def problem_of(name: str, run: str, seconds: float) -> Problem:
    return Problem((name,), RUNS[run], seconds, round(SAMPLES_PER_SECOND * seconds) + 1)


def errors_of(name: str, seconds: float) -> dict[str, float]:
    """Of each run."""
    problems = {run: problem_of(name, run, seconds) for run in RUNS}
    return {run: apart(p.ours().state, p.truth()) for run, p in problems.items()}


def why(name: str, run: str, seconds: float) -> str:
    """What tells an error of ours from the reference's own and from a motion that amplifies."""
    problem = problem_of(name, run, seconds)
    moved = replace(problem, volts=tuple(u * (1.0 + 1e-12) for u in problem.volts))
    truth = problem.truth()
    return (
        f"{name}, {run}: the reference is {apart(truth, problem.truth(cap=0.01)):.1e} from itself "
        f"at half its longest step, {apart(truth, moved.truth()):.1e} at voltages 1e-12 greater"
    )


def shown(rows: list[list[str | float]], seconds: float) -> Table:
    table = Table(title=f"Largest error of a disc's speed, rad/s, {seconds:g} s")
    for title in HEAD:
        table.add_column(title, justify="left" if title == "effect" else "right", no_wrap=True)
    for name, *errors, took in rows:
        table.add_row(str(name), *(f"{error:.1e}" for error in errors), f"{took:.1f}")
    return table


def main(
    effects: Annotated[list[str] | None, typer.Option(help="some alone; all by default")] = None,
    seconds: Annotated[float, typer.Option(min=1.0, help="of each run")] = 60.0,
    out: Annotated[Path | None, typer.Option(help="file for the table, CSV")] = None,
) -> None:
    """Compare, print, count."""
    unknown = set(effects or ()) - set(MOVING)
    if unknown:
        raise typer.BadParameter(f"{min(unknown)}; known: {', '.join(MOVING)}")
    names = effects or list(MOVING)
    rows, reasons = [], []
    for name in track(names, "effects", console=Console(stderr=True)):
        began = time.process_time()
        errors = errors_of(name, seconds)
        rows.append([name, *errors.values(), time.process_time() - began])
        reasons += [why(name, run, seconds) for run, error in errors.items() if not error <= BAR]
    Console().print(shown(rows, seconds))
    if out is not None:
        with out.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([HEAD, *rows])
    for reason in reasons:
        print(reason)
    close = sum(max(row[1:-1]) <= BAR for row in rows)
    print(f"{close} of {len(rows)} within {BAR:g} rad/s")


if __name__ == "__main__":
    typer.run(main)
