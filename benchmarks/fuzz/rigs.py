"""Random rigs with random effects: `python -m benchmarks.fuzz.rigs --rigs 2000 --seed 1`.

Each runs some seconds; counted are exceptions, numbers that are none, runs of more than five
seconds, and motions that do not obey the rig's laws, see `judge`.
"""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.progress import track

from benchmarks.fuzz.balance import OPEN, OPEN_MEMORY, judge
from benchmarks.fuzz.draws import Case, draw_case
from benchmarks.fuzz.forked import forked
from drill_env.effects import LIBRARY
from drill_env.integrator import simulate

SLOW, DEAD = 5.0, 15.0
"""Seconds of CPU of a simulation that count as a hang, and after which a case is given up."""


def verdict(case: Case) -> dict[str, Any]:
    """What became of a case: `fault` is empty if nothing is wrong."""
    began = time.process_time()
    seconds = float(case.voltage.breaks[-1])
    try:
        run = simulate(case.rig, case.voltage, seconds, initial=case.start, rate=100.0)
    except RuntimeError as error:
        return {"fault": "exception", "detail": str(error)}
    took = time.process_time() - began
    known: dict[str, Any] = {"took": took, "steps": run.steps, "events": len(run.events)}
    if not (np.isfinite(run.state).all() and np.isfinite(run.inner).all()):
        return {"fault": "not finite", **known}
    if took > SLOW:
        return {"fault": "hang", **known}
    try:
        found = judge(case)
    except RuntimeError as error:
        return {"fault": "exception", "detail": f"judged: {error}", **known}
    known |= {"energy": found.energy, "memory": found.memory, "held": found.held,
              "panels": found.panels}  # fmt: skip
    fault = "energy" if not found.energy <= OPEN else ""
    fault = fault or ("memory" if not found.memory <= OPEN_MEMORY else "")
    return {"fault": fault or ("held" if not found.held <= OPEN else ""), **known}


def judged(case: Case) -> dict[str, Any]:
    """`verdict` in a process of its own, which is ended where it hangs."""
    return forked(lambda: verdict(case), DEAD)


def described(case: Case, found: dict[str, Any]) -> dict[str, Any]:
    effects = [dict(e) for e in case.rig.effects]
    return {"number": case.number, "sort": case.sort, **found, "effects": effects}


def run_all(seed: int, numbers: range, wide: bool) -> Iterator[dict[str, Any]]:
    """Verdicts one by one; what all need is compiled once, here."""
    _ = [effect.kernel.address for effect in LIBRARY.values()]
    judge(draw_case(0, 0))
    simulate(draw_case(0, 0).rig.replace(effects=()), 1.0, 0.1)
    for number in track(numbers, description="rigs"):
        case = draw_case(seed, number, wide=wide)
        yield described(case, judged(case))


def main(
    rigs: Annotated[int, typer.Option(help="how many")] = 2000,
    seed: Annotated[int, typer.Option(help="of the draws")] = 1,
    first: Annotated[int, typer.Option(help="number of the first one")] = 0,
    wide: Annotated[bool, typer.Option(help="shapes anywhere in their range")] = False,
    out: Annotated[Path | None, typer.Option(help="file for the faults, JSON lines")] = None,
) -> None:
    """Draw, simulate, judge, count."""
    count: Counter[str] = Counter()
    lines = []
    for found in run_all(seed, range(first, first + rigs), wide):
        count[found["fault"] or "sound"] += 1
        if found["fault"]:
            lines.append(json.dumps(found))
            if out is not None:
                out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    for fault, many in count.most_common():
        print(f"{fault:12} {many}")
    raise typer.Exit(1 if set(count) - {"sound"} else 0)


if __name__ == "__main__":
    typer.run(main)
