"""The other modes of the bifurcation command: parameter, map, basin, controller."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from drill_env._errors import InputError
from drill_env.cli._common import numbers, tell
from drill_env.cli._engine_options import counted

if TYPE_CHECKING:
    from drill_env._engine import Engine
    from drill_env.parameters import Rig


def parameter_report(
    rig: Rig, name: str, between: str | None, volts: float | None, out: Path
) -> dict[str, Any]:
    import pandas as pd

    from drill_env._files import make_folder
    from drill_env._tables import write_table
    from drill_env.continuation import parameter_diagram
    from drill_env.continuation.tables import cycle_rows, point_documents
    from drill_env.report.bifurcation_picture import save_parameter_picture

    if volts is None or between is None:
        raise InputError("--parameter needs --volts V and --range LOW,HIGH")
    ends = numbers(between, "--range")
    if len(ends) != 2:
        raise InputError(f"--range is {between!r}: give two numbers, low,high")
    found = parameter_diagram(rig, name, volts, ends[0], ends[1])
    make_folder(out)
    files = [out / f"{name}{end}" for end in ("-cycles.csv", "-equilibria.csv", ".png")]
    write_table(pd.DataFrame(list(cycle_rows(found.branches))), files[0])
    write_table(found.equilibria, files[1])
    save_parameter_picture(found, files[2])
    return {
        "files": files,
        "parameter": name,
        "volts": volts,
        "points": point_documents(found.points),
        "failures": list(found.failures),
    }


def map_report(
    rig: Rig, name: str, between: str | None, to: float, out: Path, engine: Engine
) -> dict[str, Any]:
    import numpy as np

    from drill_env._files import make_folder
    from drill_env._tables import write_table
    from drill_env.continuation import vibration_map
    from drill_env.report.map_picture import save_map_picture

    ends = [] if between is None else numbers(between, "--range")
    if len(ends) != 3 or ends[2] < 2:
        raise InputError("--map needs --range LOW,HIGH,N with N of 2 or more")
    values = np.linspace(ends[0], ends[1], round(ends[2]))
    with counted(f"map over {name}") as watch:
        table = vibration_map(rig, name, values, to, watch, engine)
    if (cut := int(table.reaches_end.sum())) > 0:
        tell(f"warning: at {cut} of {len(table)} values vibration goes on at {to:g} V: raise --to")
    make_folder(out)
    files = [out / f"map-{name}.csv", out / f"map-{name}.png"]
    write_table(table, files[0])
    save_map_picture(table, name, to, files[1])
    return {"files": files, "parameter": name, "rows": table.to_dict("records")}


def basin_report(
    rig: Rig, box: str, volts: float | None, starts: int, seed: int, out: Path, engine: Engine
) -> dict[str, Any]:
    from drill_env._files import make_folder
    from drill_env._tables import write_table
    from drill_env.continuation.basins import basins
    from drill_env.report.basin_picture import save_basin_picture

    widths = numbers(box, "--basin")
    if volts is None or len(widths) != 3:
        raise InputError("--basin needs three half widths, twist,omega_u,omega_l, and --volts V")
    with counted("following the starts") as watch:
        found = basins(rig, volts, (widths[0], widths[1], widths[2]), starts, seed, engine, watch)
    make_folder(out)
    files = [out / "basin.csv", out / "basin.png"]
    write_table(found.starts, files[0])
    save_basin_picture(found, files[1])
    counts = {str(k): int(v) for k, v in found.starts.fate.value_counts().items()}
    return {
        "files": files, "volts": volts, "box": list(found.box), "fates": counts,
        "share_to_equilibrium": found.share, "low": found.low, "high": found.high,
    }  # fmt: skip
