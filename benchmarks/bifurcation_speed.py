"""Time of the whole bifurcation diagram: ours, unsmoothed, beside AUTO-07p on a smoothed rig.

    python benchmarks/bifurcation_speed.py [--json] [--repeats 5] [--eps 1e-3]

Both compute Fig. 4: equilibria to 20 V, the cycles B -> C -> D, their Floquet multipliers
and special points. AUTO needs a smooth system: sign(omega) becomes tanh(omega / eps). AUTO
(Debian packages auto-07p and gfortran) is optional; its compilation is timed apart.
"""

from __future__ import annotations

import json
import shutil
import statistics
import subprocess
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from drill_env.continuation import Diagram, bifurcation_diagram
from drill_env.continuation.branch import Corrector
from drill_env.continuation.cycle import PeriodMap
from drill_env.dynamics import equilibrium_speed, equilibrium_state
from drill_env.parameters import Rig

TO_VOLTS, NTST, COLLOCATION = 20.0, 200, 4
BAR = 1.0 / 3.0
AUTO_LIB = Path("/usr/lib/auto-07p/lib")
RIG = Rig()

MODEL = """
subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: w, s, upper, lower
  w = abs(u(3))
  s = tanh(u(2) / {eps})
  upper = s * {Tsu} + {dTsu} + ({bu} + s * {dbu}) * u(2)
  lower = {Tsl} + {bl} * w + {T1} * tanh(0.5d0 * {beta1} * w) + {T2} * tanh(0.5d0 * {beta2} * w)
  lower = lower * tanh(u(3) / {eps})
  f(1) = u(2) - u(3)
  f(2) = ({km} * par(1) - {ktheta} * u(1) - upper) / {Ju}
  f(3) = ({ktheta} * u(1) - lower) / {Jl}
end subroutine
subroutine stpnt(ndim, u, par, t)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  par(1) = {volts}
  u(1) = {twist}
  u(2) = {omega}
  u(3) = {omega}
end subroutine
subroutine pvls(ndim, u, par)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(in) :: u(ndim)
  double precision, intent(inout) :: par(*)
  double precision, external :: getp
  par(12) = getp('MIN', 3, u)
end subroutine
subroutine bcnd
end subroutine
subroutine icnd
end subroutine
subroutine fopt
end subroutine
"""

EQUILIBRIA = """
NDIM=3, IPS=1, IRS=0, ILP=1, ICP=[1], NTST={ntst}, NCOL={ncol}, IAD=3, ISP=1, ISW=1,
IPLT=0, NBC=0, NINT=0, NMX=600, NPR=0, MXBF=0, IID=0, ITMX=8, ITNW=5, NWTN=3, JAC=0,
RL0=0.1, RL1=20.5, EPSL=1e-09, EPSU=1e-09, EPSS=1e-07, DS=-0.05, DSMIN=1e-6, DSMAX=0.5, IADS=1
"""
# Cycles end where the smallest speed comes close to that of the equilibrium D: AUTO would
# otherwise retrace the branch through the Hopf point.
CYCLES = """
NDIM=3, IPS=2, IRS={label}, ILP=1, ICP=[1, 11, 12], NTST={ntst}, NCOL={ncol}, IAD=3, ISP=2,
ISW=1, IPLT=0, NBC=0, NINT=0, NMX=900, NPR=0, MXBF=0, IID=0, ITMX=8, ITNW=5, NWTN=3, JAC=0,
RL0=0.1, RL1=20.5, EPSL=1e-07, EPSU=1e-07, EPSS=1e-05, DS=0.01, DSMIN=1e-6, DSMAX={dsmax}, IADS=1,
UZR={{1: [{at}]}}, UZSTOP={{12: {stop}}}
"""
AT = (1.0, 3.0, 5.0)


class NotInstalledError(Exception):
    """AUTO-07p or a Fortran compiler is missing."""


@dataclass
class AutoRun:
    """What AUTO found at one eps, and how long it took."""

    eps: float
    seconds: float
    compile_s: float
    cycles: int
    hopf: list[float]
    fold: float
    peaks: dict[float, float]


def compile_auto(folder: Path, eps: float) -> float:
    """Build the executable; returns the seconds it took."""
    if not AUTO_LIB.is_dir() or shutil.which("gfortran") is None:
        raise NotInstalledError("Debian packages auto-07p and gfortran")
    omega = equilibrium_speed(RIG, TO_VOLTS)
    values = {"eps": eps, "volts": TO_VOLTS, "omega": omega}
    values |= {"twist": float(equilibrium_state(RIG, omega)[0])}
    values |= {name: getattr(RIG, name) for name in type(RIG).__dataclass_fields__}
    text = {k: f"({v:.17e})".replace("e", "d") for k, v in values.items() if type(v) is float}
    (folder / "model.f90").write_text(MODEL.format(**text))
    start = time.perf_counter()
    objects = [str(path) for path in sorted(AUTO_LIB.glob("*.o"))]
    command = ["gfortran", "-O2", "-fopenmp", "-w", "-ffree-line-length-none", "model.f90", *objects, "-o", "model"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise NotInstalledError(f"model does not compile: {done.stderr.strip()[-200:]}")
    return time.perf_counter() - start


def auto_step(folder: Path, constants: str, restart: Path | None = None) -> float:
    """One AUTO run; returns its seconds."""
    (folder / "fort.2").write_text(constants)
    if restart is not None:
        shutil.copy(restart, folder / "fort.3")
    start = time.perf_counter()
    subprocess.run(["./model"], cwd=folder, check=True, capture_output=True)
    return time.perf_counter() - start


def rows_of(folder: Path, kind: int | None = None) -> list[list[float]]:
    """Rows of fort.7, of one special kind (AUTO's TY: 3 Hopf, 5 fold, 4 asked for) or all."""
    rows = []
    for line in (folder / "fort.7").read_text().splitlines():
        words = line.split()
        if len(words) < 5 or words[0] == "0":
            continue
        if kind is None or abs(int(words[2])) % 10 == kind:
            rows.append([float(word) for word in words])
    return rows


def run_auto(folder: Path, eps: float, compile_s: float, dsmax: float) -> AutoRun:
    """Equilibria, then the cycles from the lower Hopf point to the upper one."""
    common = {"ntst": NTST, "ncol": COLLOCATION}
    seconds = auto_step(folder, EQUILIBRIA.format(**common))
    hopf = sorted(rows_of(folder, 3), key=lambda row: row[4])
    shutil.copy(folder / "fort.8", folder / "equilibria")
    stop = 0.97 * hopf[-1][-1]
    constants = CYCLES.format(
        label=int(hopf[0][3]), dsmax=dsmax, stop=stop, at=", ".join(map(str, AT)), **common
    )
    seconds += auto_step(folder, constants, folder / "equilibria")
    folds = [row[4] for row in rows_of(folder, 5)]
    asked = {row[4]: row for row in rows_of(folder, 4)}
    peaks = {v: row[8] for v in AT for u, row in asked.items() if abs(u - v) < 1e-4}
    every = rows_of(folder)
    return AutoRun(
        eps, seconds, compile_s, len(every), [row[4] for row in hopf], max(folds), peaks
    )
