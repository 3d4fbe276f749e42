"""AUTO-07p (Debian packages auto-07p and gfortran) on the rig with smoothed friction."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from drill_env.dynamics import equilibrium_speed, equilibrium_state
from drill_env.parameters import Rig

from .common import NotInstalledError

RIG = Rig()
TO_VOLTS, NTST, COLLOCATION = 20.0, 200, 4
# The steep tanh needs a finer mesh before AUTO's own error is small beside that of eps.
FINE_NTST = 1000
AUTO_LIB = Path("/usr/lib/auto-07p/lib")

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
ISW=1, IPLT=0, NBC=0, NINT=0, NMX={nmx}, NPR=0, MXBF=0, IID=0, ITMX=8, ITNW=7, NWTN=3, JAC=0,
RL0=0.1, RL1=20.5, EPSL={tol}, EPSU={tol}, EPSS={locate}, DS=0.01, DSMIN=1e-6, DSMAX={dsmax},
IADS=1, UZR={{{at}}}, UZSTOP={{12: {stop}}}
"""
# AUTO's own default, and the one with which it needs the fewest points and the least time.
DEFAULT_STEP, LONG_STEP = 0.1, 1.0
AT = (1.0, 3.0, 5.0)


@dataclass
class AutoRun:
    """What AUTO found at one eps, and how long it took."""

    eps: float
    seconds: float
    cycles: int
    hopf: list[float]
    fold: float
    periods: dict[float, float]


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
    command = [
        "gfortran",
        "-O2",
        "-fopenmp",
        "-w",
        "-ffree-line-length-none",
        "model.f90",
        *objects,
        "-o",
        "model",
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise NotInstalledError(f"model does not compile: {done.stderr.strip()[-200:]}")
    return time.perf_counter() - start


def auto_step(folder: Path, constants: str, restart: Path | None = None) -> float:
    """One AUTO run; returns its seconds."""
    (folder / "fort.2").write_text(constants)
    if restart is not None:
        shutil.copy(restart, folder / "fort.3")
    # On one thread AUTO is fastest here: its threads wait for each other.
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    start = time.perf_counter()
    subprocess.run(["./model"], cwd=folder, env=environment, check=True, capture_output=True)
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


def run_auto(folder: Path, eps: float, dsmax: float, periods: bool = False) -> AutoRun:
    """Equilibria, then the cycles from the lower Hopf point to the upper one.

    Args:
        folder: of the executable.
        eps: it was compiled with.
        dsmax: largest step along the branch.
        periods: also stop at the voltages of `AT`, on a finer mesh, which costs AUTO time.
    """
    mesh = {"ntst": FINE_NTST if periods else NTST, "ncol": COLLOCATION}
    seconds = auto_step(folder, EQUILIBRIA.format(**mesh))
    hopf = sorted(rows_of(folder, 3), key=lambda row: row[4])
    shutil.copy(folder / "fort.8", folder / "equilibria")
    asked = f"1: [{', '.join(map(str, AT))}]" if periods else ""
    constants = CYCLES.format(
        label=int(hopf[0][3]), stop=0.97 * hopf[-1][-1], at=asked, nmx=4000 if periods else 1000,
        dsmax=dsmax, tol=1e-10 if periods else 1e-7,
        locate=1e-9 if periods else 1e-5, **mesh,
    )  # fmt: skip
    seconds += auto_step(folder, constants, folder / "equilibria")
    found = {v: row[9] for v in AT for row in rows_of(folder, 4) if abs(row[4] - v) < 1e-4}
    fold = max((row[4] for row in rows_of(folder, 5)), default=float("nan"))
    return AutoRun(
        eps, seconds, len(rows_of(folder)), [row[4] for row in hopf], fold, found
    )  # fmt: skip
