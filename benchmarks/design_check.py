"""Whether `design-experiment` keeps its promises: expected against realised intervals.

    python benchmarks/design_check.py [--cases 8] [--first 20] [--next 30] [--json]

In each case a rig of which one short recording exists (from `rig_maker.py`, with both noises of
the practice sets) is fitted, the next signal is designed, that recording is made with the truth
and both are fitted again; the same with a random signal in its place.
"""

from __future__ import annotations

import json
import statistics
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from rig_maker import make, quasi_random

from drill_env.identification.estimate import Estimate, FitOptions, identify
from drill_env.identification.experiment import Proposal, design
from drill_env.identification.knowledge import knowledge_of
from drill_env.identification.signal_menu import menu
from drill_env.parameters import SYMBOLS, Rig
from drill_env.recordings import Recording
from drill_env.recordings.signals import Signal, signal_samples

RIG, RATE, TOP, STEP = Rig(), 200.0, 4.0, 2.0 * np.pi / 8192
TRUTH = {name: getattr(RIG, name) for name in SYMBOLS}
FIXED = {"Ju": RIG.Ju}


def record(u: np.ndarray, seed: int) -> Recording:
    made = make(TRUTH, u, RATE, seed=seed, torque_u=0.02, torque_l=2e-4)
    quanta = {"theta_u": STEP, "theta_l": STEP}
    return Recording(made.t, made.u, made.theta_u, made.theta_l, quanta=quanta)


def deviations(estimate: Estimate) -> np.ndarray:
    return np.sqrt(np.diag(estimate.covariance))


def realised(
    first: Recording, before: Estimate, proposal: Proposal, rough: tuple[str, ...], seed: int
) -> dict[str, Any]:
    """What the promised intervals came to."""
    other = record(signal_samples(proposal.signal)[1], seed)
    after = identify([first, other], before.rig, fixed=FIXED)
    ratio = deviations(after) / proposal.deviations
    told = np.array([name not in rough for name in after.free])
    gain = np.linalg.slogdet(before.covariance)[1] - np.linalg.slogdet(after.covariance)[1]
    count = 2.0 * len(after.free)
    miss = np.array([getattr(after.rig, n) - TRUTH[n] for n in after.free])
    return {
        "signal": proposal.signal.text,
        "promised_narrowing": float(np.exp(proposal.gain / count)),
        "realised_narrowing": float(np.exp(gain / count)),
        "realised_over_promised": dict(zip(after.free, ratio.tolist(), strict=True)),
        "told": ratio[told].tolist(),
        "rough": ratio[~told].tolist(),
        "largest_miss_sd": float(np.abs(miss / deviations(after)).max()),
    }


def case(seed: int, first_s: float, next_s: float) -> dict[str, Any]:
    """One rig, its first recording, and what the next one brought."""
    rng = np.random.default_rng([7, seed])
    first = record(quasi_random(rng, first_s, RATE, TOP), 2 * seed)
    start = {n: v * rng.uniform(0.7, 1.3) for n, v in TRUTH.items() if n not in FIXED}
    before = identify([first], RIG.replace(**start), fixed=FIXED, options=FitOptions(starts=3))
    known = knowledge_of(before)
    plan = design(known, menu(seconds=next_s, rate=RATE))
    random = Signal("quasi-random", seconds=next_s, rate=RATE, seed=1000 + seed)
    return {
        "rough": list(plan.rough),
        "best": realised(first, before, plan.best, plan.rough, 2 * seed + 1),
        "random": realised(
            first, before, design(known, [random]).best, plan.rough, 2 * seed + 1
        ),
    }  # fmt: skip


def show(rows: list[dict[str, Any]]) -> None:
    table = Table(title="Mean narrowing of the intervals, and promised against realised ones")
    for name in ("case", "signal", "promised", "realised", "worst told", "worst rough"):
        table.add_column(name, justify="right" if name != "signal" else "left")
    for number, row in enumerate(rows):
        for which in ("best", "random"):
            found = row[which]
            worst = [
                f"{max(found[part], key=lambda r: abs(np.log(r))):.2f}" if found[part] else ""
                for part in ("told", "rough")
            ]
            table.add_row(
                str(number), found["signal"], f"{found['promised_narrowing']:.2f}x",
                f"{found['realised_narrowing']:.2f}x", *worst,
            )  # fmt: skip
    console = Console(width=140)
    console.print(table)
    for which in ("best", "random"):
        told = [abs(r - 1.0) for row in rows for r in row[which]["told"]]
        narrow = [row[which]["realised_narrowing"] for row in rows]
        console.print(
            f"{which}: intervals realised within {100 * statistics.median(told):.1f} % (median), "
            f"{100 * float(np.quantile(told, 0.95)):.1f} % (95 %), {100 * max(told):.1f} % (worst) "
            f"of {len(told)} promised ones; narrowing {statistics.median(narrow):.2f}x (median)"
        )


def main(
    cases: Annotated[int, typer.Option(help="Seeded cases.")] = 8,
    first: Annotated[float, typer.Option(help="Seconds of the first recording.")] = 20.0,
    following: Annotated[float, typer.Option("--next", help="Seconds of the next.")] = 30.0,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
) -> None:
    """Measure and print."""
    rows = [case(seed, first, following) for seed in range(cases)]
    if as_json:
        print(json.dumps(rows, indent=2))
    else:
        show(rows)


if __name__ == "__main__":
    typer.run(main)
