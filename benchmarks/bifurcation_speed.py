"""Time of the whole bifurcation diagram: ours, unsmoothed, beside AUTO-07p on a smoothed rig.

    python benchmarks/bifurcation_speed.py [--json] [--repeats 5] [--eps 1e-3]

Both compute Fig. 4: equilibria to 20 V, the cycles B -> C -> D, their Floquet multipliers
and special points. AUTO needs a smooth system: sign(omega) becomes tanh(omega / eps). AUTO
(Debian packages auto-07p and gfortran) is optional; its compilation is timed apart.
"""

from __future__ import annotations

import json
import statistics
import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from peers.auto_tanh import (
    AT,
    DEFAULT_STEP,
    LONG_STEP,
    NTST,
    RIG,
    TO_VOLTS,
    AutoRun,
    compile_auto,
    run_auto,
)
from peers.common import NotInstalledError
from rich.console import Console
from rich.table import Table

from drill_env.continuation import Diagram, bifurcation_diagram
from drill_env.continuation.branch import Corrector
from drill_env.continuation.cycle import PeriodMap

BAR = 1.0 / 3.0
EPS_LADDER = (1e-2, 1e-3, 1e-4)


def ours() -> tuple[float, Diagram]:
    """The whole diagram, and the seconds it took."""
    start = time.perf_counter()
    diagram = bifurcation_diagram(RIG, TO_VOLTS)
    return time.perf_counter() - start, diagram


def our_periods(diagram: Diagram) -> dict[float, float]:
    """Periods of the stable cycles at the voltages of `AT`, s."""
    points = diagram.branches[0].points
    corrector = Corrector(PeriodMap(RIG), np.array([1.0, 10.0, 20.0, 4.0, 1.0]))
    out = {}
    for volts in AT:
        near = min((p for p in points if p.cycle.stable), key=lambda p: abs(p.z[4] - volts))
        out[volts] = corrector.at_parameter(near.z, volts).cycle.period
    return out


def measure(repeats: int, eps: float) -> dict[str, Any]:
    """All figures, ours and AUTO's in turn."""
    first, _ = ours()
    walls, note, compile_s, ladder = [], "", None, []
    auto: dict[float, list[AutoRun]] = {DEFAULT_STEP: [], LONG_STEP: []}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        try:
            compile_s = compile_auto(folder, eps)
        except NotInstalledError as missing:
            note = f"not installed ({missing})"
        for _ in range(repeats):
            walls.append(ours()[0])
            if compile_s is not None:
                for step, runs in auto.items():
                    runs.append(run_auto(folder, eps, step))
        if compile_s is not None:
            ladder = [convergence(folder, value) for value in EPS_LADDER]
    diagram = ours()[1]
    seconds = statistics.median(walls)
    return {
        "ours_s": seconds, "ours_first_call_s": first, "auto_compile_s": compile_s, "eps": eps,
        "auto_note": note, "bar": BAR, "failures": list(diagram.failures),
        "ours_cycles": sum(len(b.points) for b in diagram.branches),
        "ours_points": {p.name: p.parameter for p in diagram.points if p.name},
        "ours_special_points": len(diagram.points), "ours_periods_s": our_periods(diagram),
        "auto": [peer_row(step, runs, seconds) for step, runs in auto.items() if runs],
        "convergence": [asdict(run) for run in ladder],
    }  # fmt: skip


def peer_row(step: float, runs: list[AutoRun], seconds: float) -> dict[str, Any]:
    """AUTO at one step length: the median, beside ours."""
    median = statistics.median(run.seconds for run in runs)
    return asdict(runs[-1]) | {"largest_step": step, "seconds": median, "ratio": seconds / median}


def convergence(folder: Path, eps: float) -> AutoRun:
    """AUTO's cycles at one eps, for the comparison and not for the clock."""
    compile_auto(folder, eps)
    return run_auto(folder, eps, LONG_STEP, periods=True)


def show(found: dict[str, Any]) -> None:
    """The tables for people."""
    console = Console()
    table = Table(title="Fig. 4 whole: equilibria to 20 V, cycles, multipliers, special points")
    for column in ("what", "s", "ours takes", "bar", "cycles"):
        table.add_column(column, justify="left" if column == "what" else "right")
    table.add_row("drill-env", f"{found['ours_s']:.3f}", "", "", str(found["ours_cycles"]))
    for run in found["auto"]:
        default = run["largest_step"] == DEFAULT_STEP
        table.add_row(
            "AUTO, " + ("default steps" if default else "long steps"),
            f"{run['seconds']:.3f}",
            f"{run['ratio']:.2f}",
            f"<= {BAR:.2f}" if default else "",
            str(run["cycles"]),
        )
    if not found["auto"]:
        table.add_row("AUTO", found["auto_note"])
    console.print(table)
    first = f"our first call took {found['ours_first_call_s']:.2f} s"
    if not found["auto"]:
        console.print(first)
        return
    console.print(
        f"AUTO-07p on one thread, tanh(omega / {found['eps']:g}), NTST {NTST}; its model compiled "
        f"in {found['auto_compile_s']:.2f} s, {first}"
    )
    auto = found["auto"][0]
    pairs = zip("BDC", (*auto["hopf"], auto["fold"]), strict=True)
    gaps = [f"{name} {volts - found['ours_points'][name]:.1e} V" for name, volts in pairs]
    console.print("AUTO's points minus ours: " + ", ".join(gaps))
    table = Table(title="AUTO's period minus ours, s")
    for column in ("eps", *(f"{volts:g} V" for volts in AT)):
        table.add_column(column, justify="right")
    for run in found["convergence"]:
        gaps = [run["periods"].get(v, float("nan")) - found["ours_periods_s"][v] for v in AT]
        table.add_row(f"{run['eps']:g}", *(f"{gap:.2e}" for gap in gaps))
    console.print(table)


def main(
    repeats: Annotated[int, typer.Option(help="Rounds; the medians are reported.")] = 5,
    eps: Annotated[float, typer.Option(help="Width of AUTO's tanh, rad/s.")] = 1e-3,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
) -> None:
    """Measure and print."""
    found = measure(repeats, eps)
    if as_json:
        print(json.dumps(found, indent=2))
    else:
        show(found)


if __name__ == "__main__":
    typer.run(main)
