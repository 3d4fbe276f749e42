"""Diagnose every case, each in a process of its own that is given copies of its recordings only.

`python -m benchmarks.concealed.run --cases DIR --out REPORTS`. Cases that are done are not done
again; each leaves `run.json` with its exit status, CPU and wall seconds.
"""

from __future__ import annotations

import functools
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections import deque
from pathlib import Path
from typing import Annotated, Any

import typer

from drill_env._ending import ending_tidily
from drill_env._engine import run
from drill_env._errors import InputError
from drill_env._files import make_folder, write_text
from drill_env.cli._engine_options import (
    AddressOption,
    EngineKind,
    EngineOption,
    JobsOption,
    counted,
    engine_of,
)

_OPTIONS = {"leave_out": "--leave-out", "start_friction": "--start-friction"}
_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
TOOL = (str(Path(sys.executable).parent / "drill-env"), "diagnose")


def command(tool: tuple[str, ...], case: Path, out: Path) -> list[str]:
    """What diagnoses a case."""
    found = [*tool, *(str(p) for p in sorted(case.glob("fit-*.csv")))]
    for path in sorted(case.glob("holdout-*.csv")):
        found += ["--holdout", str(path)]
    public = case / "case.json"
    told = json.loads(public.read_text(encoding="utf-8")) if public.exists() else {}
    for name, value in told.items():
        for one in value.split():
            found += [_OPTIONS[name], one]
    return [*found, "--out", str(out)]


def diagnose(tool: tuple[str, ...], case: Path, out: Path, limit: float) -> dict[str, Any]:
    """Diagnose one case and say what it took.

    Args:
        tool: command in front of the recordings.
        case: folder of the case.
        out: where its report goes.
        limit: wall seconds after which it is given up.
    """
    environment = {**os.environ, **dict.fromkeys(_ONE_THREAD, "1")}
    with tempfile.TemporaryDirectory() as hidden:
        copy = _copied(case, Path(hidden))
        log = Path(hidden) / "log"
        began = time.perf_counter()
        with log.open("wb") as stream:
            process = subprocess.Popen(
                command(tool, copy, out.resolve()), cwd=hidden, env=environment,
                stdout=stream, stderr=subprocess.STDOUT,
            )  # fmt: skip
            status, usage = _wait(process, began + limit)
        tail = log.read_text(encoding="utf-8", errors="replace")[-2000:]
    return {
        "exit_status": status, "cpu_s": usage.ru_utime + usage.ru_stime,
        "wall_s": time.perf_counter() - began, "output_tail": tail,
    }  # fmt: skip


def _copied(case: Path, folder: Path) -> Path:
    """A copy beside which no other case lies."""
    try:
        return Path(shutil.copytree(case, folder / "case"))
    except OSError as error:
        raise InputError(
            f"cannot copy it into the temporary folder {folder}: make room there, or set "
            "TMPDIR to another place"
        ) from error


def _wait(process: subprocess.Popen[bytes], deadline: float) -> tuple[int, Any]:
    # wait4 alone tells the CPU of one child among several.
    while True:
        ended, status, usage = os.wait4(process.pid, os.WNOHANG)
        if ended:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, usage
        if time.perf_counter() > deadline:
            process.kill()
            deadline = float("inf")
        time.sleep(0.02)


def _one(out: Path, limit: float, case: Path) -> None:
    out = out / case.name
    done = out / "run.json"
    if done.exists() and json.loads(done.read_text(encoding="utf-8"))["exit_status"] == 0:
        return
    make_folder(out)
    write_text(done, json.dumps(diagnose(TOOL, case, out, limit), indent=1) + "\n")


def main(
    cases: Annotated[Path, typer.Option(help="Folder of the cases.")],
    out: Annotated[Path, typer.Option(help="Folder of the reports.")],
    jobs: JobsOption = None,
    engine: EngineOption = EngineKind.LOCAL,
    address: AddressOption = None,
    limit: Annotated[float, typer.Option(help="Wall seconds a case.")] = 600.0,
    first: Annotated[int, typer.Option(help="Only so many; 0 for all.")] = 0,
) -> None:
    """Diagnose the cases that are not done yet."""
    folders = sorted(cases.glob("case-*"))[: first or None]
    try:
        make_folder(out)
        once = functools.partial(_one, out.resolve(), limit)
        with counted("cases") as watch:
            runs_at = engine_of(jobs, engine, address)
            deque(run(once, [f.resolve() for f in folders], runs_at, progress=watch), 0)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(2) from error
    except KeyboardInterrupt:
        print("interrupted; run again to go on", file=sys.stderr)
        raise
    records = [json.loads((out / f.name / "run.json").read_text(encoding="utf-8")) for f in folders]
    failed = [f.name for f, r in zip(folders, records, strict=True) if r["exit_status"]]
    print(f"{len(folders)} cases, {len(failed)} failed{': ' if failed else ''}{', '.join(failed)}")


if __name__ == "__main__":
    with ending_tidily():
        typer.run(main)
