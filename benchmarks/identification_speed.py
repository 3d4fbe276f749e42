"""Time of a joint fit of every parameter but Ju: ours beside SciPy's least squares.

    python benchmarks/identification_speed.py [--json] [--fits 5] [--whole]

Three quasi-random recordings of 50 s at 200 Hz with 8192-count encoders, made by
`rig_maker.py`, which shares nothing with the package; the fit starts with every free parameter
up to 30 % off. The peer is `least_squares` over `solve_ivp` with events and finite differences:
it fits the free run and knows that the rig starts at rest; ours estimates the starts, the
encoders' offset, the noise and the covariance as well. A whole fit of the peer takes minutes to
hours, so by default one simulation of the three recordings is timed and multiplied by the number
that a whole fit of the first seconds of the same recordings took; `--whole` runs it all.
"""

from __future__ import annotations

import json
import os
import statistics
import time
from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
import typer
from peers.scipy_fit import Fit, Measured
from rich.console import Console
from rich.table import Table
from rig_maker import MadeRecording, make, quasi_random

from drill_env.identification.estimate import Estimate, identify
from drill_env.parameters import SYMBOLS, Rig
from drill_env.recordings import Recording

SECONDS, RATE, COUNT, COUNTS = 50.0, 200.0, 3, 8192
TORQUES = {"torque_u": 0.02, "torque_l": 2e-4}
STEP = 2.0 * np.pi / COUNTS
TRUTH = {name: getattr(Rig(), name) for name in SYMBOLS}
FREE = tuple(name for name in SYMBOLS if name != "Ju")
BAR_S, BAR_RATIO = 3.0, 50.0


def recordings(seed: int, noisy: bool) -> list[MadeRecording]:
    """The three recordings of one case."""
    return [
        make(
            TRUTH, quasi_random(np.random.default_rng([seed, i]), SECONDS, RATE, 5.0), RATE,
            seed=COUNT * seed + i, counts=COUNTS, **(TORQUES if noisy else {}),
        )
        for i in range(COUNT)
    ]  # fmt: skip


def start(seed: int) -> dict[str, float]:
    """Every free parameter up to 30 % off."""
    rng = np.random.default_rng(seed)
    return TRUTH | {name: TRUTH[name] * rng.uniform(0.7, 1.3) for name in FREE}


def fit_ours(seed: int, noisy: bool) -> tuple[float, float, Estimate]:
    """Wall and processor seconds of one fit, and the fit."""
    quanta = {"theta_u": STEP, "theta_l": STEP}
    measured = [
        Recording(m.t, m.u, m.theta_u, m.theta_l, quanta=quanta) for m in recordings(seed, noisy)
    ]
    rig = Rig(**start(seed))
    wall, used = time.perf_counter(), time.process_time()
    found = identify(measured, rig, fixed={"Ju": TRUTH["Ju"]})
    return time.perf_counter() - wall, time.process_time() - used, found


def ours(noisy: bool, fits: int) -> dict[str, Any]:
    """Medians over several fits, compilation before the clock."""
    fit_ours(0, noisy)
    rows = [fit_ours(seed, noisy) for seed in range(fits)]
    misses = [
        abs(getattr(found.rig, name) / TRUTH[name] - 1.0)
        for _, _, found in rows
        for name in ("km", "bu", "ktheta", "Jl")
    ]
    return {
        "wall_s": statistics.median(row[0] for row in rows),
        "fastest_s": min(row[0] for row in rows),
        "processor_s": statistics.median(row[1] for row in rows),
        "converged": sum(row[2].converged for row in rows),
        "fits": fits,
        "median_miss": statistics.median(misses),
    }


def problem(seed: int, noisy: bool, seconds: float) -> Fit:
    """The peer's fit of the first seconds of the same recordings."""
    rows = round(seconds * RATE)
    return Fit(
        start(seed), FREE,
        [
            Measured(RATE, m.u[:rows], np.column_stack([m.theta_u, m.theta_l])[:rows])
            for m in recordings(seed, noisy)
        ],
    )  # fmt: skip


def timed(work: Callable[[], Any]) -> tuple[float, float, Any]:
    """Wall and processor seconds of some work, and its result."""
    wall, used = time.perf_counter(), time.process_time()
    found = work()
    return time.perf_counter() - wall, time.process_time() - used, found


def peer(noisy: bool, short: float, whole: bool) -> dict[str, Any]:
    """SciPy's fit of case 0, whole or extrapolated."""
    fit = problem(0, noisy, SECONDS if whole else short)
    wall, used, (found, simulations) = timed(fit.solve)
    row = {
        "seconds_fitted": SECONDS if whole else short,
        "simulations": simulations,
        "evaluations": int(found.nfev),
        "rms_rad": float(np.sqrt(np.mean(found.fun**2))),
        "rms_truth_rad": float(np.sqrt(np.mean(fit.residuals(fit.vector(TRUTH)) ** 2))),
        "whole": whole,
    }
    if whole:
        return row | {"wall_s": wall, "processor_s": used}
    # One simulation of all three recordings, at the start, at the truth and between.
    full = problem(0, noisy, SECONDS)
    ends = full.vector(full.start), full.vector(TRUTH)
    clocks = [
        timed(lambda share=share: full.residuals((1 - share) * ends[0] + share * ends[1]))
        for share in (0.0, 0.25, 0.5, 0.75, 1.0)
    ]
    walls, uses = (statistics.median(clock[i] for clock in clocks) for i in (0, 1))
    return row | {
        "simulation_s": walls,
        "wall_s": walls * simulations,
        "processor_s": uses * simulations,
    }


def show(rows: list[dict[str, Any]]) -> None:
    """The tables for people."""
    console = Console()
    table = Table(title=f"{len(FREE)} parameters from {COUNT} recordings of {SECONDS:g} s")
    for name in ("", "without torque noise", "with torque noise", "bar"):
        table.add_column(name, justify="right" if name else "left")
    lines: list[tuple[str, Callable[[dict[str, Any]], str], str]] = [
        ("drill-env, wall, s (median)", lambda r: f"{r['ours']['wall_s']:.2f}", f"<= {BAR_S:g}"),
        ("  fastest, s", lambda r: f"{r['ours']['fastest_s']:.2f}", ""),
        ("  processor time, s", lambda r: f"{r['ours']['processor_s']:.2f}", ""),
        ("  converged", lambda r: f"{r['ours']['converged']} of {r['ours']['fits']}", ""),
        (
            "  median error of km, bu, ktheta, Jl",
            lambda r: f"{100 * r['ours']['median_miss']:.3f} %",
            "",
        ),
        ("SciPy, wall, s", lambda r: f"{r['peer']['wall_s']:.0f}", ""),
        ("  simulations of all recordings", lambda r: str(r["peer"]["simulations"]), ""),
        (
            "  rms it ended at, and that of the truth, rad",
            lambda r: f"{r['peer']['rms_rad']:.2g}, {r['peer']['rms_truth_rad']:.2g}",
            "",
        ),
        ("ours is faster by", lambda r: f"{r['ratio']:.0f}x", f">= {BAR_RATIO:g}x"),
    ]
    for name, text, bar in lines:
        table.add_row(name, *(text(row) for row in rows), bar)
    console.print(table)
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    console.print(f"{os.cpu_count()} cores, load {load:.1f}")
    if not rows[0]["peer"]["whole"]:
        short = rows[0]["peer"]["seconds_fitted"]
        console.print(
            f"SciPy's time is that of one simulation of the {SECONDS:g} s times the number it took "
            f"to fit the first {short:g} s; --whole runs it to the end"
        )


def main(
    fits: Annotated[int, typer.Option(help="Fits of ours in each case.")] = 5,
    short: Annotated[float, typer.Option(help="Seconds that the peer fits whole.")] = 10.0,
    whole: Annotated[bool, typer.Option("--whole", help="Run the peer's whole fit.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
) -> None:
    """Measure and print."""
    rows = []
    for noisy in (False, True):
        row: dict[str, Any] = {"torque_noise": noisy, "ours": ours(noisy, fits)}
        row["peer"] = peer(noisy, short, whole)
        row["ratio"] = row["peer"]["wall_s"] / row["ours"]["wall_s"]
        rows.append(row)
    if as_json:
        print(json.dumps(rows, indent=2))
    else:
        show(rows)


if __name__ == "__main__":
    typer.run(main)
