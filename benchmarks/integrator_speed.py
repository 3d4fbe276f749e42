"""Simulated seconds per second of wall clock: our integrator beside its peers.

    python benchmarks/integrator_speed.py [--json] [--repeats 5] [--peer-python PATH]

One run, all rows interleaved, medians, compilation outside the clock. Every row solves
the same problem: 3.5 V from rest for 200 s, omega_l sampled every 0.5 s; its largest
error against `tests/data/reference.npz` (see `tests/reference.py`) stands beside its speed.
Peers that are absent say so. MuJoCo and diffrax may live in another environment: give its
interpreter as `--peer-python`.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from peers import diffrax_events, heyoka_events, mujoco_hinges, scipy_events, siconos_relay
from peers.common import NotInstalledError, Peer
from rich.console import Console
from rich.table import Table

from drill_env.integrator import simulate
from drill_env.parameters import Rig

ROOT = Path(__file__).resolve().parents[1]
VOLTS, SECONDS = 3.5, 200.0
TIMES = np.linspace(0.0, SECONDS, 401)
# Every fifth of the stored 10 Hz samples.
TRUTH = np.load(ROOT / "tests" / "data" / "reference.npz")["long_state"][::5, 2]
BAR = 1e-7
SHORTEST = 0.1


@dataclass
class Row:
    """One line of the table."""

    name: str
    speed: float | None
    error: float | None
    times_ours: float | None = None
    bar: float | None = None
    note: str = ""


def error_of(omega_l: Sequence[float]) -> float:
    return float(np.abs(np.asarray(omega_l) - TRUTH).max())


def ours(rtol: float) -> Peer:
    """Our integrator; everything `simulate` does is inside the clock."""

    def measure(volts: float, times: Sequence[float]) -> tuple[float, list[float]]:
        grid = np.asarray(times)
        start = time.perf_counter()
        run = simulate(Rig(), volts, grid[-1], t_eval=grid, rtol=rtol, atol=0.01 * rtol)
        return time.perf_counter() - start, run.omega_l.tolist()

    return Peer(f"drill-env dop853, rtol {rtol:g}", measure)


def loosest_rtol() -> float:
    """The loosest tolerance of a ladder from which on every error stays below the bar."""
    best = 1e-12
    for rtol in (1e-12, 1e-11, 1e-10, 3e-10, 1e-9, 3e-9, 1e-8):
        if error_of(ours(rtol).measure(VOLTS, TIMES.tolist())[1]) > BAR:
            break
        best = rtol
    return best


def batch_speed(rtol: float, count: int = 64) -> float:
    """Many voltages at once: plain threads, as the kernels release the GIL."""

    def one(volts: float) -> None:
        simulate(Rig(), volts, SECONDS, t_eval=TIMES, rtol=rtol, atol=0.01 * rtol)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        start = time.perf_counter()
        list(pool.map(one, np.linspace(3.0, 4.0, count)))
    return count * SECONDS / (time.perf_counter() - start)


def fresh_seconds(code: str, cache: str) -> float:
    """Seconds that `code` reports from a fresh interpreter with this numba cache."""
    environment = {**os.environ, "NUMBA_CACHE_DIR": cache, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, check=True, capture_output=True, text=True
    )
    return float(done.stdout.strip().splitlines()[-1])


def latencies(repeats: int) -> dict[str, float]:
    """Import and first call, with an empty and with a warm cache on disk."""
    clock = "import time; t = time.perf_counter(); import drill_env"
    call = (
        f"{clock}; from drill_env.parameters import Rig;"
        " from drill_env.integrator import simulate; simulate(Rig(), 3.5, 1.0)"
    )
    end = "; print(time.perf_counter() - t)"
    with tempfile.TemporaryDirectory() as cache:
        cold = fresh_seconds(call + end, cache)
        warm = [fresh_seconds(call + end, cache) for _ in range(repeats)]
        bare = [fresh_seconds(clock + end, cache) for _ in range(repeats)]
    return {
        "import_s": statistics.median(bare),
        "first_call_warm_cache_s": statistics.median(warm),
        "first_call_empty_cache_s": cold,
    }


def wall_seconds(peer: Peer, grid: list[float]) -> float:
    """Mean wall time of one solve; short ones are repeated, the same rule for everyone.

    A solve of a millisecond right after another program's would measure cold caches.
    """
    walls = [peer.measure(VOLTS, grid)[0]]
    while sum(walls) < SHORTEST and len(walls) < 200:
        walls.append(peer.measure(VOLTS, grid)[0])
    return statistics.fmean(walls)


def measure_rows(rtol: float, repeats: int, python: str) -> list[Row]:
    """All rows, one measurement of each per round."""
    makers: list[tuple[str, float | None, Callable[[], Peer]]] = [
        ("ours", None, lambda: ours(rtol)),
        ("SciPy", 150.0, scipy_events.peer),
        ("heyoka", 1.0, heyoka_events.peer),
        ("Siconos", 500.0, siconos_relay.peer),
        ("diffrax", None, lambda: diffrax_events.peer([python])),
        ("MuJoCo", None, lambda: mujoco_hinges.peer([python])),
    ]
    rows, live = [], []
    grid = TIMES.tolist()
    for name, bar, make in makers:
        row = Row(name, None, None, bar=bar)
        rows.append(row)
        try:
            peer = make()
            row.name = peer.name
            row.error = error_of(peer.measure(VOLTS, grid)[1])
            live.append((row, peer, []))
        except NotInstalledError as missing:
            row.note = f"not installed ({missing})"
    for _ in range(repeats):
        for _, peer, walls in live:
            walls.append(wall_seconds(peer, grid))
    for row, _, walls in live:
        row.speed = SECONDS / statistics.median(walls)
    for row in rows[1:]:
        if row.speed and rows[0].speed:
            row.times_ours = rows[0].speed / row.speed
    return rows


def show(rows: list[Row], batch: float, waits: dict[str, float]) -> None:
    """The table for people."""
    table = Table(title=f"{SECONDS:g} s at {VOLTS} V from rest, medians of one interleaved run")
    for column in ("what", "simulated s per s", "max error, rad/s", "ours is faster by", "bar"):
        table.add_column(column, justify="left" if column == "what" else "right")
    for row in rows:
        table.add_row(
            row.name,
            row.note or f"{row.speed:,.0f}",
            "" if row.error is None else f"{row.error:.1e}",
            "" if row.times_ours is None else f"{row.times_ours:.1f}x",
            "" if row.bar is None else f">= {row.bar:g}x",
        )
    table.add_row(f"drill-env, 64 voltages on {os.cpu_count()} cores", f"{batch:,.0f}", "", "", "")
    console = Console()
    console.print(table)
    console.print(
        f"import {waits['import_s']:.2f} s; first call in a fresh process, import included: "
        f"{waits['first_call_warm_cache_s']:.2f} s with compiled code cached, "
        f"{waits['first_call_empty_cache_s']:.1f} s without"
    )


def main(
    repeats: Annotated[int, typer.Option(help="Rounds; the medians are reported.")] = 5,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
    peer_python: Annotated[
        str, typer.Option(help="Interpreter that has MuJoCo and diffrax.", envvar="PEER_PYTHON")
    ] = sys.executable,
) -> None:
    """Measure and print."""
    rtol = loosest_rtol()
    rows = measure_rows(rtol, repeats, peer_python)
    batch_speed(rtol, 4)
    batch = statistics.median(batch_speed(rtol) for _ in range(repeats))
    waits = latencies(min(repeats, 3))
    if as_json:
        document: dict[str, Any] = {
            "rows": [asdict(row) for row in rows], "batch_simulated_s_per_s": batch, **waits,
        }  # fmt: skip
        print(json.dumps(document, indent=2))
    else:
        show(rows, batch, waits)


if __name__ == "__main__":
    typer.run(main)
