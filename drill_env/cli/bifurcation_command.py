"""The command that draws the bifurcation diagram."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drill_env._errors import InputError
from drill_env.cli._common import (
    JsonOption,
    RigOption,
    numbers,
    output_folder,
    print_json,
    progress_bar,
    rig_from,
    show,
    tell,
)

if TYPE_CHECKING:
    import pandas as pd

    from drill_env.continuation import Diagram
    from drill_env.parameters import Rig

DEFAULT_OUT = Path("out/bifurcation")


def bifurcation_command(
    out: Annotated[Path, typer.Option(help="Folder for tables and pictures.")] = DEFAULT_OUT,
    to: Annotated[float, typer.Option(help="End of the voltage range, V.")] = 15.0,
    rig: RigOption = None,
    recorded: Annotated[
        list[Path] | None,
        typer.Option(help="Recording at constant voltage, laid over the diagram; repeatable."),
    ] = None,
    parameter: Annotated[
        str | None, typer.Option(help="Continue in this parameter instead, at --volts.")
    ] = None,
    between: Annotated[
        str | None, typer.Option("--range", help="low,high of --parameter or low,high,n of --map.")
    ] = None,
    volts: Annotated[float | None, typer.Option(help="Voltage for --parameter or --basin.")] = None,
    map_: Annotated[
        str | None, typer.Option("--map", help="Map vibration over voltage and this parameter.")
    ] = None,
    basin: Annotated[
        str | None,
        typer.Option(help="Half widths twist,omega_u,omega_l of a box of starts at --volts."),
    ] = None,
    starts: Annotated[int, typer.Option(help="Number of starts for --basin.")] = 500,
    seed: Annotated[int, typer.Option(help="Seed of the starts.")] = 0,
    controller: Annotated[
        str | None, typer.Option(help="Diagram of the controlled rig over the set point.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the bifurcation diagram: equilibria, limit cycles, special points.

    Writes diagram.csv, diagram.parquet, points.json, diagram.png (Fig. 4 of the paper),
    diagram.html (interactive) and, on request, maps, basins and recorded points.

    Example: drill-env bifurcation --to 15 --out out/bifurcation
    """
    from drill_env._files import make_folder

    modes = {"--parameter": parameter, "--map": map_, "--basin": basin, "--controller": controller}
    if len(given := [name for name, value in modes.items() if value is not None]) > 1:
        raise InputError(f"{' and '.join(given)} are both given: give one of them")
    plant = rig_from(rig)
    make_folder(output_folder(out))
    if parameter is not None:
        report = _parameter(plant, parameter, between, volts, out)
    elif map_ is not None:
        report = _map(plant, map_, between, to, out)
    elif basin is not None:
        report = _basin(plant, basin, volts, starts, seed, out)
    elif controller is not None:
        report = _controlled(plant, controller, out)
    else:
        report = _diagram(plant, to, recorded or [], out)
    if as_json:
        print_json(report)
    else:
        _tell(report)


def _diagram(rig: Rig, to: float, recorded: list[Path], out: Path) -> dict[str, Any]:
    from drill_env.continuation import bifurcation_diagram
    from drill_env.continuation.tables import point_documents
    from drill_env.identification.recorded_diagram import recorded_points
    from drill_env.recordings import read_recording

    read = [read_recording(path, need=("u",)) for path in recorded]
    with progress_bar() as bar:
        task = bar.add_task("limit cycles", total=None)
        diagram = bifurcation_diagram(
            rig, to, progress=lambda done: bar.update(task, completed=done)
        )
    measured = recorded_points(read, diagram) if read else None
    files = _write(diagram, measured, out)
    return {
        "files": files,
        "points": point_documents(diagram.points),
        "branches": [
            {"cycles": len(b.points), "start": b.start, "end": b.end} for b in diagram.branches
        ],
        "failures": list(diagram.failures),
        "recorded": [] if measured is None else measured.to_dict("records"),
    }


def _write(diagram: Diagram, measured: pd.DataFrame | None, out: Path) -> list[Path]:
    import json

    from drill_env._files import write_text
    from drill_env._tables import write_table
    from drill_env.continuation.tables import diagram_table, point_documents
    from drill_env.report.bifurcation_page import save_diagram_page
    from drill_env.report.bifurcation_picture import save_diagram_picture

    names = ("diagram.csv", "diagram.parquet", "points.json", "diagram.png", "diagram.html")
    files = [out / name for name in names]
    for path in files[:2]:
        write_table(diagram_table(diagram), path)
    write_text(files[2], json.dumps(point_documents(diagram.points), indent=2) + "\n")
    save_diagram_picture(diagram, files[3], measured)
    save_diagram_page(diagram, files[4])
    if measured is not None:
        files.append(out / "recorded.csv")
        write_table(measured, files[-1])
    return files


def _parameter(
    rig: Rig, name: str, between: str | None, volts: float | None, out: Path
) -> dict[str, Any]:
    import pandas as pd

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


def _map(rig: Rig, name: str, between: str | None, to: float, out: Path) -> dict[str, Any]:
    import numpy as np

    from drill_env._tables import write_table
    from drill_env.continuation import vibration_map
    from drill_env.report.map_picture import save_map_picture

    ends = numbers(between or "", "--range")
    if len(ends) != 3 or ends[2] < 2:
        raise InputError("--map needs --range LOW,HIGH,N with N of 2 or more")
    values = np.linspace(ends[0], ends[1], round(ends[2]))
    with progress_bar() as bar:
        task = bar.add_task(f"map over {name}", total=len(values))
        table = vibration_map(
            rig, name, values, to, lambda done, _: bar.update(task, completed=done)
        )
    files = [out / f"map-{name}.csv", out / f"map-{name}.png"]
    write_table(table, files[0])
    save_map_picture(table, name, to, files[1])
    return {"files": files, "parameter": name, "rows": table.to_dict("records")}


def _basin(
    rig: Rig, box: str, volts: float | None, starts: int, seed: int, out: Path
) -> dict[str, Any]:
    from drill_env._tables import write_table
    from drill_env.continuation.basins import basins
    from drill_env.report.basin_picture import save_basin_picture

    widths = numbers(box, "--basin")
    if volts is None or len(widths) != 3:
        raise InputError("--basin needs three half widths, twist,omega_u,omega_l, and --volts V")
    found = basins(rig, volts, (widths[0], widths[1], widths[2]), starts, seed)
    files = [out / "basin.csv", out / "basin.png"]
    write_table(found.starts, files[0])
    save_basin_picture(found, files[1])
    counts = {str(k): int(v) for k, v in found.starts.fate.value_counts().items()}
    return {
        "files": files, "volts": volts, "box": list(found.box), "fates": counts,
        "share_to_equilibrium": found.share, "low": found.low, "high": found.high,
    }  # fmt: skip


def _controlled(rig: Rig, name: str, out: Path) -> dict[str, Any]:
    import numpy as np

    from drill_env import baselines
    from drill_env._tables import write_table
    from drill_env.benchmark.controlled_diagram import controlled_diagram
    from drill_env.continuation import bifurcation_diagram
    from drill_env.environment.config import EnvConfig
    from drill_env.report.bifurcation_picture import save_controlled_picture

    config = EnvConfig(rig=rig)
    baselines.make(name, config)
    table = controlled_diagram(baselines.CONTROLLERS[name], config, np.linspace(0.3, 8.5, 42))
    files = [out / f"controlled-{name}.csv", out / f"controlled-{name}.png"]
    write_table(table, files[0])
    diagram = bifurcation_diagram(rig, config.voltage_limit)
    save_controlled_picture(table, name, diagram, files[1])
    return {"files": files, "controller": name, "rows": table.to_dict("records")}


def _tell(report: dict[str, Any]) -> None:
    from rich.table import Table

    if "points" in report:
        table = Table(title="Special points", title_justify="left")
        for name in ("", "kind", "V or value", "min rad/s", "max rad/s", "period s"):
            table.add_column(name, justify="right" if " " in name else "left")
        for p in report["points"]:
            period = "" if p["period_s"] is None else f"{p['period_s']:.7f}"
            table.add_row(
                p["name"] or "", p["kind"], f"{p['parameter']:.8f}", f"{p['min']:.6f}",
                f"{p['max']:.6f}", period,
            )  # fmt: skip
        show(table)
    if "share_to_equilibrium" in report:
        typer.echo(
            f"{report['share_to_equilibrium']:.3f} of the box goes to the equilibrium "
            f"(95 %: {report['low']:.3f} to {report['high']:.3f}); {report['fates']}"
        )
    for failure in report.get("failures", []):
        tell(f"warning: {failure}")
    tell("written: " + ", ".join(str(path) for path in report["files"]))
