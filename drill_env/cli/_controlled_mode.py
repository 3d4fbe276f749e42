"""The bifurcation command for a rig under a controller."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drill_env._errors import InputError
from drill_env.cli._common import numbers, progress_bar, tell

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

    from drill_env.continuation.loop_diagram import LoopDiagram
    from drill_env.controllers import Controller
    from drill_env.environment.config import EnvConfig
    from drill_env.parameters import Rig

_ATTRACTORS = 42


def controlled_report(
    rig: Rig, name: str, between: str | None, limit: float, out: Path
) -> dict[str, Any]:
    import numpy as np

    from drill_env.benchmark.controlled_diagram import controlled_diagram
    from drill_env.continuation.loop_tables import loop_point_documents
    from drill_env.environment.config import EnvConfig

    config = EnvConfig(rig=rig, voltage_limit=limit)
    label, maker = _maker(name, config)
    low, high = _range(between, config)
    found = _continued(maker(config), config, low, high)
    setpoints = np.linspace(low, high, _ATTRACTORS)
    with progress_bar() as bar:
        task = bar.add_task("settling", total=None)

        def watch(start: str, done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, description=f"from {start}")

        growth = _growth(found, setpoints)
        settled = controlled_diagram(maker, config, setpoints, watch, growth)
    return {
        "files": _write(found, label, settled, config, out),
        "controller": label,
        "points": [] if found is None else loop_point_documents(found.points),
        "branches": [] if found is None else [
            {"cycles": len(b.points), "start": b.start, "end": b.end}
            for b in (found.equilibria, *found.branches)
        ],
        "failures": [] if found is None else list(found.failures),
        "rows": settled.to_dict("records"),
    }  # fmt: skip


def _maker(name: str, config: EnvConfig) -> tuple[str, Callable[[EnvConfig], Controller]]:
    from drill_env import baselines
    from drill_env.agents import find, load, names

    if name not in baselines.CONTROLLERS and (name in names() or Path(name).is_dir()):
        trained = load(name)
        return find(name).resolve().name, lambda _: trained
    baselines.make(name, config)
    return name, baselines.CONTROLLERS[name]


def _range(between: str | None, config: EnvConfig) -> tuple[float, float]:
    if between is None:
        return config.setpoint_range
    ends = numbers(between, "--range")
    if len(ends) != 2:
        raise InputError(f"--range is {between!r}: give two set points, low,high")
    return ends[0], ends[1]


def _continued(
    controller: Controller, config: EnvConfig, low: float, high: float
) -> LoopDiagram | None:
    from drill_env.continuation.loop_diagram import loop_diagram
    from drill_env.continuation.loop_law import HiddenMemoryError

    with progress_bar() as bar:
        task = bar.add_task("controlled cycles", total=None)
        try:
            return loop_diagram(
                controller, config, low, high,
                progress=lambda done: bar.update(task, completed=done),
            )  # fmt: skip
        except HiddenMemoryError as error:
            tell(f"warning: only what the loop settles on is shown: {error}")
            return None


def _growth(found: LoopDiagram | None, setpoints: np.ndarray) -> np.ndarray | None:
    """Growth rates of the equilibria (1/s), NaN where there is none."""
    import numpy as np

    from drill_env.continuation.flow import CycleError
    from drill_env.continuation.loop_equilibria import equilibrium_at, motion_of

    if found is None:
        return None
    rates = np.full(len(setpoints), np.nan)
    for i, setpoint in enumerate(setpoints.tolist()):
        try:
            rates[i] = motion_of(equilibrium_at(found.loop, setpoint)[1]).growth_rate
        except CycleError:
            continue
    return rates


def _write(
    found: LoopDiagram | None, name: str, settled: pd.DataFrame, config: EnvConfig, out: Path
) -> list[Path]:
    from drill_env._files import make_folder, write_text
    from drill_env._tables import write_table
    from drill_env.continuation import bifurcation_diagram
    from drill_env.continuation.loop_tables import both_tables, loop_point_documents
    from drill_env.report.controlled_page import save_controlled_page
    from drill_env.report.controlled_picture import save_controlled_picture

    open_loop = bifurcation_diagram(config.rig, config.voltage_limit)
    make_folder(out)
    files = [out / "attractors.csv", out / "diagram.png"]
    write_table(settled, files[0])
    save_controlled_picture(found, name, settled, open_loop, files[1])
    if found is None:
        return files
    table = both_tables(found, name, open_loop)
    more = [out / end for end in ("diagram.csv", "diagram.parquet", "points.json", "diagram.html")]
    write_table(table, more[0])
    write_table(table, more[1])
    documents = loop_point_documents(found.points)
    write_text(more[2], json.dumps(documents, indent=2) + "\n")
    save_controlled_page(found, name, table, more[3])
    return [*files, *more]
