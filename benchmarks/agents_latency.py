"""How long an agent takes for one voltage: in Python, as C and as ONNX.

python benchmarks/agents_latency.py [--agent encoders-ppo] [--calls 20000]
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from drill_env.agents import Agent, export, load

LOOP = """
#include "agent.h"
void loop(int n, const double *x, double *out)
{
    agent_state s;
    agent_reset(&s);
    for (int i = 0; i < n; i++)
        out[i] = agent_volts(&s, x[5 * i], x[5 * i + 1], x[5 * i + 2], x[5 * i + 3], x[5 * i + 4]);
}
"""


def python_times(agent: Agent, rows: np.ndarray) -> np.ndarray:
    agent.reset(1)
    times = np.empty(len(rows))
    for i, row in enumerate(rows):
        began = time.perf_counter()
        agent.act(row[None])
        times[i] = time.perf_counter() - began
    return 1e6 * times


def c_times(agent: Agent, rows: np.ndarray, folder: Path) -> np.ndarray:
    """Means over blocks of 100 calls: one call is shorter than the clock."""
    export.to_c(agent, folder / "agent.h")
    (folder / "loop.c").write_text(LOOP)
    library = folder / "loop.so"
    flags = ["-std=c99", "-O2", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, folder / "loop.c", "-o", library, "-lm"], check=True)
    call = ctypes.CDLL(str(library)).loop
    pointer = ctypes.POINTER(ctypes.c_double)
    seen, out = np.ascontiguousarray(rows[:, :5]), np.zeros(100)
    times = []
    for block in np.array_split(seen, len(seen) // 100):
        began = time.perf_counter()
        call(len(out), np.ascontiguousarray(block[:100]).ctypes.data_as(pointer),
             out.ctypes.data_as(pointer))  # fmt: skip
        times.append(1e4 * (time.perf_counter() - began))
    return np.array(times)


def onnx_times(agent: Agent, rows: np.ndarray, folder: Path) -> np.ndarray:
    import onnxruntime

    export.to_onnx(agent, folder / "agent.onnx")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(folder / "agent.onnx"), options)
    times, memory = np.empty(len(rows)), np.zeros((1, 2))
    for i, row in enumerate(rows):
        began = time.perf_counter()
        _, memory = session.run(None, {"observation": row[None], "memory": memory})
        times[i] = time.perf_counter() - began
    return 1e6 * times


def main(
    agent: Annotated[str, typer.Option(help="Name or folder.")] = "encoders-ppo",
    calls: Annotated[int, typer.Option(help="Voltages to ask for.")] = 20_000,
) -> None:
    made = load(agent)
    rng = np.random.default_rng(0)
    measured = 1 if made.view == "surface" else 3
    width = measured + 2 + made.history * (measured + 1)
    rows = rng.uniform(1.0, 5.0, (max(calls, 200), width))
    table = Table("one voltage", "median, us", "99 %, us")
    with tempfile.TemporaryDirectory() as name:
        found = {"Python, numpy": python_times(made, rows)}
        if made.view == "both":
            if shutil.which("cc"):
                found["C, -O2"] = c_times(made, rows, Path(name))
            found["ONNX Runtime, one thread"] = onnx_times(made, rows, Path(name))
    for label, times in found.items():
        table.add_row(label, f"{np.median(times):.1f}", f"{np.quantile(times, 0.99):.1f}")
    Console().print(table)


if __name__ == "__main__":
    typer.run(main)
