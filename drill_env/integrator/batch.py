"""Many rigs, voltages or starts at once, on all cores."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from drill_env._errors import InputError
from drill_env._threads import each
from drill_env._types import FloatArray, VoltageFunction
from drill_env.integrator.simulate import simulate
from drill_env.integrator.trajectory import Trajectory
from drill_env.integrator.voltage import Voltage
from drill_env.parameters import Rig


def simulate_batch(
    rigs: Rig | Sequence[Rig],
    voltages: float | VoltageFunction | Voltage | Sequence[float | VoltageFunction | Voltage],
    seconds: float,
    *,
    initial: FloatArray | Sequence[FloatArray] | None = None,
    threads: int | None = None,
    **options: Any,
) -> list[Trajectory]:
    """Run `simulate` for every rig, voltage and start; one of each serves all.

    The compiled code releases the interpreter's lock, so plain threads use all cores.

    Args:
        rigs: one rig, or n of them.
        voltages: one voltage, or n of them.
        seconds: duration of each run, s.
        initial: one state of shape (4,), or n of them, shape (n, 4); rest by default.
        threads: number of threads; all cores by default.
        **options: passed on to `simulate`.

    Returns:
        The trajectories in order.

    Raises:
        InputError: the lengths differ, or a run's arguments are out of range.
    """
    many: dict[str, list[Any]] = {
        "rigs": list(rigs) if isinstance(rigs, Sequence) else [rigs],
        "voltages": list(voltages) if isinstance(voltages, Sequence) else [voltages],
        "initial": [None] if initial is None else _starts(initial),
    }
    count = max(len(values) for values in many.values())
    for name, values in many.items():
        if len(values) not in (1, count):
            raise InputError(f"{name} has {len(values)} entries: give 1 or {count}")
        many[name] = values * count if len(values) == 1 else values

    def run(i: int) -> Trajectory:
        start = many["initial"][i]
        return simulate(many["rigs"][i], many["voltages"][i], seconds, initial=start, **options)

    return each(run, range(count), threads)


def _starts(initial: FloatArray | Sequence[FloatArray]) -> list[Any]:
    return [initial] if getattr(initial, "ndim", 2) == 1 else list(initial)
