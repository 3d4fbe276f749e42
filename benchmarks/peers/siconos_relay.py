"""Siconos (Debian packages `siconos`, `libsiconos-kernel-dev`): Moreau-Jean at 1 ms, in C++.

The C++ program is compiled with `g++ -O2` outside the clock and times its own loop.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from peers.common import NotInstalledError, Peer

SOURCE = Path(__file__).with_name("siconos_relay.cpp")
HEADERS = Path("/usr/include/siconos")
STEP = 1e-3


def _compile() -> Path:
    if not HEADERS.is_dir() or shutil.which("g++") is None:
        raise NotInstalledError("no Siconos headers or no g++")
    program = Path(tempfile.mkdtemp(prefix="drill-env-siconos-")) / "siconos_relay"
    folders = [HEADERS, *(path for path in HEADERS.iterdir() if path.is_dir())]
    subprocess.run(
        ["g++", "-O2", "-std=c++17", *(f"-I{path}" for path in folders), str(SOURCE),
         "-o", str(program), "-lsiconos_kernel", "-lsiconos_numerics", "-lsiconos_externals"],
        check=True, capture_output=True,
    )  # fmt: skip
    return program


def peer() -> Peer:
    program = _compile()

    def measure(volts: float, times: Sequence[float]) -> tuple[float, list[float]]:
        interval = times[1] - times[0]
        request = [str(volts), str(STEP), str(times[-1]), str(interval)]
        text = subprocess.run(
            [str(program), *request], check=True, capture_output=True, text=True
        ).stdout
        # Siconos may print notices of its own before the numbers.
        numbers = [float(line) for line in text.split()[-(len(times) + 1) :]]
        return numbers[0], numbers[1:]

    return Peer("Siconos Moreau-Jean theta 0.5, 1 ms (C++)", measure)
