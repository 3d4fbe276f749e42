"""Long commands at small settings, for `benchmarks.fuzz.killed`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from drill_env import Rig
from drill_env._files import make_folder
from drill_env.integrator import sampled_voltage, simulate

ROOT = Path(__file__).resolve().parents[2]
CLI = (sys.executable, "-m", "drill_env.cli.main")
TRAIN = (
    sys.executable, str(ROOT / "train.py"), "--num-envs", "64", "--episode-seconds", "2",
    "--batch-size", "1280", "--n-epochs", "2", "--total-steps", "15000", "--skip-table",
    "--checkpoint-steps", "1300",
)  # fmt: skip
RIG = Rig(clamp=True)
# Writes over its own files until it is ended.
WRITER = """
import itertools, sys
from pathlib import Path
from drill_env._ending import ending_tidily
from drill_env._files import write_texts
with ending_tidily():
    try:
        for k in itertools.count():
            write_texts({Path(sys.argv[1]) / f"{name}.json": f'["{k % 2}"' + ', "x"' * 200_000 + ']'
                         for name in "ab"})
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        sys.exit(130)
"""


@dataclass(frozen=True, slots=True)
class Work:
    """A command.

    Attributes:
        name: of it.
        argv: what is run, given the folder of its inputs and that of its outputs.
        goes_on: options that continue what an earlier run has left, if there are such.
        endless: whether it only ends when it is ended.
        lingers: whether a command that it has begun ends by itself where it is killed.
    """

    name: str
    argv: Callable[[Path, Path], list[str]]
    goes_on: tuple[str, ...] = ()
    endless: bool = False
    lingers: bool = False


def recordings(folder: Path) -> None:
    """One to fit, one to judge by, and both as a case of `benchmarks.concealed.run`."""
    rng = np.random.default_rng(0)
    case = make_folder(folder / "cases" / "case-0")
    for stem in ("fit-1", "holdout-1"):
        t = np.arange(0.0, 12.0, 0.04)
        volts = np.repeat(rng.uniform(1.0, 5.0, 12), 25)
        run = simulate(RIG, sampled_voltage(t, volts), 12.0, t_eval=t)
        angles = np.column_stack([run.theta_u, run.theta_l]) + 1e-3 * rng.standard_normal(
            (len(t), 2)
        )
        rows = np.column_stack([t, volts, angles])
        names = "t,u,theta_u,theta_l"
        np.savetxt(case / f"{stem}.csv", rows, "%.6f", ",", header=names, comments="")


def _pair(inputs: Path) -> list[str]:
    case = inputs / "cases" / "case-0"
    return [str(case / "fit-1.csv"), "--holdout", str(case / "holdout-1.csv")]


WORKS = {
    work.name: work
    for work in (
        Work(
            "compare", lambda _, out: [
                *CLI, "compare", "--controllers", "open-loop,pi", "--setpoints", "2,5", "--seconds",
                "60", "--window", "10", "--out", str(out),
            ],
        ),
        Work(
            "protocol", lambda _, out: [
                *CLI, "compare", "--levels", "L0,L2", "--controllers", "pi,lqi", "--setpoints",
                "2,5", "--plants", "10", "--starts", "rest,limit_cycle", "--out", str(out),
            ],
        ),
        Work(
            "bifurcation", lambda _, out: [*CLI, "bifurcation", "--to", "5", "--out", str(out)],
        ),
        Work(
            "identify", lambda inputs, out: [
                *CLI, "identify", *_pair(inputs), "--fix", "Ju=0.4765", "--report", str(out),
            ],
        ),
        Work(
            "diagnose", lambda inputs, out: [
                *CLI, "diagnose", *_pair(inputs), "--most", "1", "--out", str(out),
            ],
        ),
        Work(
            "concealed", lambda inputs, out: [
                sys.executable, "-m", "benchmarks.concealed.run", "--cases", str(inputs / "cases"),
                "--out", str(out),
            ],
            lingers=True,
        ),
        Work(
            "design", lambda inputs, out: [
                *CLI, "design-experiment", "--recordings", _pair(inputs)[0], "--seconds", "20",
                "--variants", "2", "--out", str(out / "next.csv"),
            ],
        ),
        Work("train", lambda _, out: [*TRAIN, "--out", str(out)], goes_on=("--resume",)),
        Work(
            "writing", lambda _, out: [sys.executable, "-c", WRITER, str(out)],
            endless=True,
        ),
    )
}  # fmt: skip
