"""What every adapter shares: the printed parameters, and how a foreign process is asked."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# Equations (6) and (8).
KM, JU, TSU, DTSU, BU, DBU = 3.5693, 0.4765, 0.3212, 0.0095, 1.9833, -0.0167
JL, KTHETA, TSL, T1, T2 = 0.0326, 0.078, 0.0094, 0.0826, -0.291
BETA1, BETA2, BL = 6.3598, 0.0768, 0.0042


@dataclass(frozen=True)
class Peer:
    """One row of the table.

    Attributes:
        name: what is measured, tolerances included.
        measure: (volts, sample times) -> (wall seconds, omega_l at the samples), any
            compilation done before the clock starts.
    """

    name: str
    measure: Callable[[float, Sequence[float]], tuple[float, list[float]]]


class NotInstalledError(Exception):
    """The peer is absent on this machine."""


def ask(python: Sequence[str], script: str, volts: float, times: Sequence[float]) -> Any:
    """Run an adapter as a script of its own: JSON request on stdin, JSON answer on stdout."""
    done = subprocess.run(
        [*python, str(Path(__file__).with_name(script))],
        input=json.dumps({"volts": volts, "times": list(times)}),
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    if done.returncode:
        tail = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise (NotInstalledError if "No module named" in tail else RuntimeError)(tail)
    answer = json.loads(done.stdout.strip().splitlines()[-1])
    return answer["wall"], answer["omega_l"]


def serve(run: Callable[[float, list[float]], tuple[float, list[float]]]) -> None:
    """The other side of `ask`."""
    request = json.load(sys.stdin)
    wall, omega_l = run(request["volts"], request["times"])
    print(json.dumps({"wall": wall, "omega_l": [float(w) for w in omega_l]}))
