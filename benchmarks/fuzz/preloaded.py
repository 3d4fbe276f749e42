"""Commands begun in copies of a process that has imported their libraries already.

Importing takes up to two thirds of a short command. The process learns what to import from the
first run of the command; each run is a fork of it in a session of its own, which runs the command's
module as `python -m` does and ends as Python ends.
"""

from __future__ import annotations

import atexit
import contextlib
import importlib
import json
import os
import runpy
import select
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

from benchmarks.fuzz.works import ROOT


class Process(Protocol):
    """What is asked of a process that was begun."""

    pid: int
    returncode: int | None

    def wait(self, timeout: float | None = None) -> int:
        """Wait until it ends."""
        ...


class Copy:
    """A command that runs in a copy."""

    def __init__(self, pid: int, answers: int) -> None:
        self.pid, self._answers = pid, answers
        self.returncode: int | None = None

    def wait(self, timeout: float | None = None) -> int:
        """Wait until it ends; raises TimeoutExpired as `subprocess` does."""
        if self.returncode is None:
            if not select.select([self._answers], [], [], timeout)[0]:
                raise subprocess.TimeoutExpired(str(self.pid), timeout or 0.0)
            self.returncode = _whole(self._answers)
        return self.returncode


class Preloaded:
    """Runs commands in turn, one at a time; a context, since a process of it stays.

    Args:
        scratch: an existing folder, in which the first run leaves what it has imported.
    """

    def __init__(self, scratch: Path) -> None:
        self._learned = scratch / "modules.json"
        self._server = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.fuzz.preloaded"], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, bufsize=0, cwd=ROOT,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
        )  # fmt: skip

    def start(self, argv: Sequence[str], folder: Path, log: Path) -> Copy:
        """Begin a command, `PYTHON -m MODULE ...` or `PYTHON SCRIPT ...`.

        Args:
            argv: the command.
            folder: where it runs.
            log: file of its standard error.
        """
        assert self._server.stdin is not None and self._server.stdout is not None
        asked = {"argv": list(argv[1:]), "folder": str(folder), "log": str(log)}
        asked["modules"] = str(self._learned)
        self._server.stdin.write(json.dumps(asked).encode() + b"\n")
        answers = self._server.stdout.fileno()
        return Copy(_whole(answers), answers)

    def __enter__(self) -> Preloaded:
        return self

    def __exit__(self, *_: Any) -> None:
        assert self._server.stdin is not None and self._server.stdout is not None
        self._server.stdin.close()
        self._server.wait()
        self._server.stdout.close()


def _whole(descriptor: int) -> int:
    """A whole number, one a line; it is read byte by byte, since the next may not be there yet."""
    return int(_line(descriptor))


def _line(descriptor: int) -> bytes:
    line = b""
    while not line.endswith(b"\n"):
        byte = os.read(descriptor, 1)
        if not byte:
            break
        line += byte
    return line


def _import(path: Path) -> None:
    # Names such as `__main__` or those of a library's own inventions are no modules.
    for name in json.loads(path.read_text(encoding="utf-8")):
        if name not in sys.modules:
            with contextlib.suppress(Exception):
                importlib.import_module(name)


def _write(path: Path) -> None:
    path.write_text(json.dumps(sorted(sys.modules)), encoding="utf-8")


def _settle(asked: dict[str, Any]) -> None:
    """Make a fork what a fresh process would be."""
    os.setsid()
    os.chdir(asked["folder"])
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.argv = list(asked["argv"])
    if not Path(asked["modules"]).exists():
        atexit.register(_write, Path(asked["modules"]))
    null, log = os.open(os.devnull, os.O_RDWR), os.open(asked["log"], os.O_WRONLY | os.O_CREAT)
    os.ftruncate(log, 0)
    # Told last: from here it may be killed.
    os.write(1, f"{os.getpid()}\n".encode())
    for place, stream in ((0, null), (1, null), (2, log)):
        os.dup2(stream, place)


def serve() -> dict[str, Any] | None:
    """Fork for each command asked for; a fork returns with its own, the process with None."""
    while line := _line(0):
        asked = json.loads(line)
        pid = os.fork()
        if pid == 0:
            return asked
        _, ended = os.waitpid(pid, 0)
        if Path(asked["modules"]).exists():
            _import(Path(asked["modules"]))
        os.write(1, f"{os.waitstatus_to_exitcode(ended)}\n".encode())
    return None


if __name__ == "__main__":
    command = serve()
    if command is not None:
        _settle(command)
        first, *others = command["argv"]
        if first == "-m":
            sys.argv = others
            runpy.run_module(others[0], run_name="__main__", alter_sys=True)
        else:
            runpy.run_path(first, run_name="__main__")
