"""Odd places to run in: `python -m benchmarks.fuzz.places` (minutes: it compiles anew).

No folder to write to, no room, no home, no cache, an empty cache that two processes fill, two
threads.
"""

from __future__ import annotations

import ctypes
import functools
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fuzz.left import broken, leftovers
from benchmarks.fuzz.works import ROOT, WORKS, recordings
from drill_env import Rig
from drill_env._files import make_folder
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.integrator import simulate
from drill_env.recordings import read_recording

ROOM = 200
"""Bytes of a file: less than any result."""
PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1
FILTER = """
import numpy as np
from drill_env.sensors import Encoder, filter_velocity
print(filter_velocity(np.sin(np.arange(200) / 20.0), Encoder()).tobytes().hex())
"""
MOTION = """
from drill_env import Rig, simulate
rig = Rig(effects=({"id": "unbalance", "torque": 0.01, "phase": 0.0},))
print(simulate(rig, 3.5, 5.0).state.tobytes().hex())
"""


def _bound(room: int | None) -> None:
    """Take from the superuser what lets him write where nobody may; leave files so many bytes."""
    if room is not None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))
    if os.getuid() == 0:
        ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0)


def run(
    argv: list[str],
    cwd: Path,
    extra: Mapping[str, str],
    root: Path = ROOT,
    room: int | None = None,
) -> subprocess.Popen[str]:
    """A process for which permissions hold, whoever starts it.

    Args:
        argv: what is run.
        cwd: where.
        extra: environment variables.
        root: of the code.
        room: bytes that a file may have; to write more fails as on a full disk.
    """
    return subprocess.Popen(
        argv, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(root), **extra},
        preexec_fn=functools.partial(_bound, room),
    )  # fmt: skip


def refused(name: str, folder: Path, out: Path, room: int | None = None) -> tuple[int, str]:
    """Exit status and error of a work that cannot write to `out`, or not so much."""
    process = run(WORKS[name].argv(folder / "inputs", out), folder, {}, room=room)
    _, err = process.communicate(timeout=300)
    return process.returncode, err


def one_error(status: int, err: str) -> bool:
    """Whether a work has ended as bad input does."""
    last = err.strip().splitlines()[-1:]
    return status == 2 and "Traceback" not in err and last[0].startswith("error: ")


def half_there(out: Path) -> list[str]:
    """Files that cannot be read, and those that were never put in place."""
    return [*(path.name for path in leftovers(out)), *broken(out)]


def unwritable(folder: Path) -> tuple[Path, Path]:
    """A folder that cannot be written and a path that is a file; `folder` gets the inputs."""
    recordings(folder / "inputs")
    locked, taken = folder / "locked", folder / "taken"
    locked.mkdir()
    taken.write_text("a file", encoding="utf-8")
    locked.chmod(0o555)
    return locked / "out", taken


def without_cache(folder: Path) -> str:
    """What a filter gives where neither a cache nor a home can be written."""
    for name in ("drill_env", "agents", "baselines"):
        shutil.copytree(
            ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "*.md")
        )
    for path in (folder, *folder.rglob("*")):
        path.chmod(0o555 if path.is_dir() else 0o444)
    homes = ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")
    extra = {name: str(folder / "nowhere") for name in homes}
    process = run([sys.executable, "-c", FILTER], Path("/"), extra, folder)
    found, err = process.communicate(timeout=600)
    for path in (folder, *folder.rglob("*")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    return found if process.returncode == 0 else err


def plain(code: str) -> str:
    """What code prints in a process as it is."""
    argv, environment = [sys.executable, "-c", code], {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        argv, env=environment, capture_output=True, text=True, check=True, timeout=900
    ).stdout


def both_cold(folder: Path) -> list[str]:
    """What two processes print that fill an empty cache at once, and one that finds it filled."""
    cache = folder / "cache"
    cache.mkdir()
    extra = {"NUMBA_CACHE_DIR": str(cache)}
    pair = [run([sys.executable, "-c", MOTION], folder, extra) for _ in range(2)]
    found = [process.communicate(timeout=1800) for process in pair]
    third = run([sys.executable, "-c", MOTION], folder, extra).communicate(timeout=900)
    return [out or err for out, err in [*found, third]]


def in_threads(work: Callable[[], Any], count: int = 2) -> list[Any]:
    """What `work` returns in each of several threads that begin at once."""
    gate, found = threading.Barrier(count), [None] * count

    def one(place: int) -> None:
        gate.wait()
        found[place] = work()

    threads = [threading.Thread(target=one, args=(place,)) for place in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return found


def moved() -> bytes:
    """Bits of a motion with effects."""
    effects = ({"id": "friction_lag", "time_constant": 0.02}, {"id": "input_delay", "delay": 0.03})
    return simulate(Rig(effects=effects), lambda t: 3.0 + np.sin(t), 10.0).state.tobytes()


def diagnosed(case: Path) -> str:
    """What a diagnosis says."""
    fit, held = ([read_recording(case / f"{name}.csv")] for name in ("fit-1", "holdout-1"))
    found = diagnose(fit, Rig(), held, options=DiagnosisOptions(most=1))
    return repr(found.result.as_dict())


def main() -> int:
    """Try each place; 1 if one of them failed."""
    failed = False

    def told(name: str, right: bool, detail: object = "") -> None:
        nonlocal failed
        failed = failed or not right
        print(f"{name}: {'as it should be' if right else f'WRONG: {detail}'}", flush=True)

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for out in unwritable(folder):
            for work in WORKS:
                if work == "writing":
                    continue
                status, err = refused(work, folder, out)
                right = one_error(status, err)
                told(f"{work} into {out.name}", right, f"{status} {err[-800:]}")
        for work in WORKS:
            if work == "writing":
                continue
            out = make_folder(folder / "full" / work)
            status, err = refused(work, folder, out, ROOM)
            half = half_there(out)
            right = one_error(status, err) and not half
            told(f"{work} on a full disk", right, f"{status} {err[-800:]} {half}")
        case = folder / "inputs" / "cases" / "case-0"
        alone = moved(), diagnosed(case)
        told("two threads that simulate", in_threads(moved) == [alone[0]] * 2)
        together = in_threads(lambda: diagnosed(case))
        told("two threads that diagnose", together == [alone[1]] * 2)
    with tempfile.TemporaryDirectory() as name:
        found = without_cache(Path(name))
        told("no cache and no home", found == plain(FILTER), found[-800:])
    with tempfile.TemporaryDirectory() as name:
        found = both_cold(Path(name))
        told("two cold processes", found == [plain(MOTION)] * 3, [text[-300:] for text in found])
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
