"""A child that reads binary files one after another: to start one for each takes far longer.

What it says of a file that is right or damaged stands. Where it ends, or runs out of memory or
time, a fresh one reads that file again, and only that counts: files before it are not to blame.
"""

from __future__ import annotations

import faulthandler
import json
import math
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from drill_env import InputError
from drill_env.recordings import _read_apart, apart

MOST_FILES = 500
"""Files of one child: what its libraries keep stays small."""
SECONDS, MEMORY = 4, 1_000_000_000
_SURE = (0, _read_apart.DAMAGED, _read_apart.NEWER_MAT, _read_apart.REFUSED)


class Child:
    """A fork of this process that reads."""

    def __init__(self) -> None:
        ours, theirs = os.pipe(), os.pipe()
        self.pid, self.read = os.fork(), 0
        if self.pid == 0:
            os.close(ours[1])
            os.close(theirs[0])
            try:
                _serve(ours[0], theirs[1])
            finally:
                os._exit(70)
        os.close(ours[0])
        os.close(theirs[1])
        self._to, self._from = ours[1], theirs[0]

    def ask(self, kind: apart.Kind, path: Path, wanted: Sequence[str]) -> int:
        """Exit status of the reader, negative for a signal that ended it."""
        self.read += 1
        os.write(self._to, json.dumps([kind, str(path), list(wanted)]).encode() + b"\n")
        answer = os.read(self._from, 1)
        if answer:
            return answer[0]
        return os.waitstatus_to_exitcode(self.close())

    def close(self) -> int:
        """End it; returns what the system says of how it ended.

        That its pipe is closed tells it nothing: forks that came later hold it open.
        """
        for end in (self._to, self._from):
            os.close(end)
        os.kill(self.pid, signal.SIGKILL)
        _, ended = os.waitpid(self.pid, 0)
        return ended


def _serve(asked: int, answers: int) -> None:
    faulthandler.disable()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)
    sys.stderr = open(2, "w", encoding="utf-8", closefd=False)
    _read_apart.confine = _confined
    with os.fdopen(asked, encoding="utf-8") as lines:
        for line in lines:
            kind, path, wanted = json.loads(line)
            for place, suffix in ((1, ".out"), (2, ".err")):
                with Path(path).with_suffix(suffix).open("wb") as stream:
                    os.dup2(stream.fileno(), place)
            given = apart._LIMITS | {"memory": MEMORY, "seconds": SECONDS}
            status = _read_apart.main(kind, Path(path), given, wanted)
            sys.stdout.flush()
            os.write(answers, bytes([status]))
    os._exit(0)


def _confined(memory: int, seconds: int) -> None:
    """The limits of the program, but such that the next file may get its own."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    most = pages * resource.getpagesize() + memory
    resource.setrlimit(resource.RLIMIT_AS, (most if hard < 0 else min(most, hard), hard))
    soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (math.ceil(time.process_time()) + seconds, hard))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


class Reader:
    """Takes the place of `apart._run`."""

    def __init__(self) -> None:
        self.child: Child | None = None
        self.owner = 0

    def __call__(self, path: Path, kind: apart.Kind, wanted: Sequence[str]) -> bytes:
        status = self._ask(path, kind, wanted)
        if status not in _SURE:
            self._close()
            status = self._ask(path, kind, wanted)
            self._close()
        if status:
            told = path.with_suffix(".err").read_bytes()
            raise InputError(f"{path}: {apart._reason(status, kind, told)}")
        return path.with_suffix(".out").read_bytes()

    def _ask(self, path: Path, kind: apart.Kind, wanted: Sequence[str]) -> int:
        if self.child is not None and (self.child.read >= MOST_FILES or self.owner != os.getpid()):
            self._close()
        if self.child is None:
            self.child, self.owner = Child(), os.getpid()
        child = self.child
        try:
            status = child.ask(kind, path, wanted)
        except BaseException:
            self.child = None
            child.close()
            raise
        if status < 0:
            self.child = None
        return status

    def _close(self) -> None:
        if self.child is not None and self.owner == os.getpid():
            self.child.close()
        self.child = None
