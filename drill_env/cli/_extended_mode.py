"""The bifurcation command on a rig with effects."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drill_env.cli._common import progress_bar

if TYPE_CHECKING:
    import pandas as pd

    from drill_env.parameters import Rig


def extended_report(
    rig: Rig, to: float, measured: pd.DataFrame | None, out: Path
) -> dict[str, Any]:
    from drill_env._files import make_folder, write_text
    from drill_env._tables import write_table
    from drill_env.continuation.extended_diagram import extended_diagram, extended_table
    from drill_env.continuation.tables import point_documents
    from drill_env.report.extended_picture import save_extended_picture

    with progress_bar() as bar:
        task = bar.add_task("sweeping the voltage", total=None)
        cycles = bar.add_task("following limit cycles", total=None)
        diagram = extended_diagram(
            rig, to, progress=lambda done, total: bar.update(task, completed=done, total=total),
            traced=lambda count: bar.update(cycles, completed=count),
        )  # fmt: skip
    make_folder(out)
    names = ("diagram.csv", "diagram.parquet", "points.json", "diagram.png")
    files = [out / name for name in names]
    table = extended_table(diagram)
    for path in files[:2]:
        write_table(table, path)
    write_text(files[2], json.dumps(point_documents(diagram.points), indent=2) + "\n")
    save_extended_picture(diagram, files[3], measured)
    if measured is not None:
        files.append(out / "recorded.csv")
        write_table(measured, files[-1])
    return {
        "files": files,
        "points": point_documents(diagram.points),
        "attractors": diagram.attractors.to_dict("records"),
        "failures": list(diagram.remarks),
        "recorded": [] if measured is None else measured.to_dict("records"),
    }
