"""The command that draws the bifurcation diagram."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drill_env._errors import InputError
from drill_env.cli._bifurcation_modes import (
    basin_report,
    map_report,
    parameter_report,
)
from drill_env.cli._common import (
    JsonOption,
    RigOption,
    output_folder,
    print_json,
    progress_bar,
    rig_from,
    show,
    tell,
)
from drill_env.cli._controlled_mode import controlled_report
from drill_env.cli._engine_options import (
    AddressOption,
    EngineKind,
    EngineOption,
    JobsOption,
    engine_of,
)
from drill_env.cli._extended_mode import extended_report

if TYPE_CHECKING:
    import pandas as pd

    from drill_env.continuation import Diagram
    from drill_env.parameters import Rig
    from drill_env.recordings import Recording

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
        str | None,
        typer.Option(
            help="Continue in this rig key, or EFFECT.KEY; with --volts and --range LOW,HIGH."
        ),
    ] = None,
    between: Annotated[
        str | None,
        typer.Option(
            "--range", help="low,high of --parameter, low,high,n of --map or set points low,high."
        ),
    ] = None,
    volts: Annotated[float | None, typer.Option(help="Voltage for --parameter or --basin.")] = None,
    map_: Annotated[
        str | None,
        typer.Option(
            "--map", help="Map vibration over this rig key, or EFFECT.KEY; with --range LOW,HIGH,N."
        ),
    ] = None,
    basin: Annotated[
        str | None,
        typer.Option(help="Half widths twist,omega_u,omega_l of a box of starts at --volts."),
    ] = None,
    starts: Annotated[int, typer.Option(help="Number of starts for --basin.")] = 500,
    seed: Annotated[int, typer.Option(help="Seed of the starts.")] = 0,
    controller: Annotated[
        str | None,
        typer.Option(help="Controlled rig over the set point: controller, agent or its folder."),
    ] = None,
    voltage_limit: Annotated[float, typer.Option(help="V, for --controller; up to 15.")] = 5.0,
    jobs: JobsOption = None,
    engine: EngineOption = EngineKind.LOCAL,
    address: AddressOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the bifurcation diagram: equilibria, limit cycles, special points.

    Writes diagram.csv, diagram.parquet, points.json, diagram.png (Fig. 4 of the paper),
    diagram.html (interactive) and, on request, maps, basins and recorded points.

    --map and --basin run in parallel: --jobs, --engine.

    Of a rig with effects in its file it gives also what the rig settles on while the voltage is
    raised and lowered, and no diagram.html.

    Example: drill-env bifurcation --to 15 --out out/bifurcation
    """
    modes = {"--parameter": parameter, "--map": map_, "--basin": basin, "--controller": controller}
    if len(given := [name for name, value in modes.items() if value is not None]) > 1:
        raise InputError(f"{' and '.join(given)} are both given: give one of them")
    plant = rig_from(rig)
    output_folder(out)
    runs_at = engine_of(jobs, engine, address)
    if parameter is not None:
        report = parameter_report(plant, parameter, between, volts, out)
    elif map_ is not None:
        report = map_report(plant, map_, between, to, out, runs_at)
    elif basin is not None:
        report = basin_report(plant, basin, volts, starts, seed, out, runs_at)
    elif controller is not None:
        report = controlled_report(plant, controller, between, voltage_limit, out)
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

    read = _recordings(recorded)
    if rig.effects:
        return extended_report(rig, to, recorded_points(read) if read else None, out)
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


def _recordings(paths: list[Path]) -> list[Recording]:
    from drill_env.recordings import RecordingWarning, read_recording

    with warnings.catch_warnings(record=True) as remarks:
        warnings.simplefilter("always", RecordingWarning)
        read = [read_recording(path, need=("u",)) for path in paths]
    for remark in remarks:
        # A constant voltage is what this command asks for.
        if getattr(remark.message, "code", "") != "constant":
            tell(f"warning: {remark.message}")
    return read


def _write(diagram: Diagram, measured: pd.DataFrame | None, out: Path) -> list[Path]:
    import json

    from drill_env._files import make_folder, write_text
    from drill_env._tables import write_table
    from drill_env.continuation.tables import diagram_table, point_documents
    from drill_env.report.bifurcation_page import save_diagram_page
    from drill_env.report.bifurcation_picture import save_diagram_picture

    make_folder(out)
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


def _tell(report: dict[str, Any]) -> None:
    from rich.table import Table

    if report.get("points"):
        table = Table(title="Special points", title_justify="left")
        where = "rad/s set" if "controller" in report else "V or value"
        for name in ("", "kind", where, "min rad/s", "max rad/s", "period s"):
            table.add_column(name, justify="right" if " " in name else "left")
        for p in report["points"]:
            period = "" if p["period_s"] is None else f"{p['period_s']:.7f}"
            place = p["setpoint"] if "setpoint" in p else p["parameter"]
            table.add_row(
                p.get("name") or "", p["kind"], f"{place:.8f}", f"{p['min']:.6f}",
                f"{p['max']:.6f}", period,
            )  # fmt: skip
        show(table)
    elif "points" in report:
        typer.echo("no special points in this range")
    if "share_to_equilibrium" in report:
        typer.echo(
            f"{report['share_to_equilibrium']:.3f} of the box goes to the equilibrium "
            f"(95 %: {report['low']:.3f} to {report['high']:.3f}); "
            + ", ".join(f"{name}: {count}" for name, count in report["fates"].items())
        )
    for failure in report.get("failures", []):
        tell(f"warning: {failure}")
    tell("written: " + ", ".join(str(path) for path in report["files"]))
