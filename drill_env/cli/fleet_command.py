"""`drill-env fleet`: what the models of many rigs leave out of their recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drill_env.cli._common import (
    JsonOption,
    output_folder,
    print_json,
    rig_from,
    show,
    tell,
)
from drill_env.cli._engine_options import (
    AddressOption,
    EngineKind,
    EngineOption,
    JobsOption,
    counted,
    engine_of,
)
from drill_env.cli.diagnose_command import DoubtOption, LeaveOption, MostOption, SeedOption

if TYPE_CHECKING:
    from rich.table import Table

    from drill_env.fleet import Fleet

FolderArgument = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER", help="Folder with one folder for each rig.", show_default=False
    ),
]
OutOption = Annotated[Path, typer.Option(help="Folder for tables and reports.")]
StartOption = Annotated[
    Path | None,
    typer.Option("--rig", help="Start of rigs without a rig.toml; the paper's rig by default."),
]
_SHOWN = 100
_COLUMNS = ("rig", "verdict", "missing", "sure", "numbers", "component", "since", "CPU s", "error")


def fleet_command(
    folder: FolderArgument,
    out: OutOption = Path("fleet"),
    rig: StartOption = None,
    leave_out: LeaveOption = None,
    most: MostOption = 2,
    doubt: DoubtOption = 0.05,
    seed: SeedOption = 0,
    jobs: JobsOption = None,
    engine: EngineOption = EngineKind.LOCAL,
    address: AddressOption = None,
    as_json: JsonOption = False,
) -> None:
    """Diagnose many rigs, each from its own folder, and put them on one table.

    A rig's folder holds fit*.csv and hold*.csv or a recordings.toml, and rig.toml if the rig is
    known. A rig that was done before is not done again unless its files changed; one with bad files
    has its error in the table. Dates of recordings tell since when something is missing.

    Writes fleet.csv, fleet.parquet, rigs/NAME with each report and parts/rig=NAME/part.parquet,
    which pandas, polars and DuckDB read as one table.

    Example: drill-env fleet rigs/ --out fleet --jobs 4
    """
    from drill_env.diagnosis.options import DiagnosisOptions
    from drill_env.fleet import FleetSettings, run_fleet

    output_folder(out)
    runs_at = engine_of(jobs, engine, address)
    options = DiagnosisOptions(leave_out=tuple(leave_out or ()), most=most, doubt=doubt, seed=seed)
    settings = FleetSettings(rig_from(rig), options)
    with counted("rigs") as watch:
        found = run_fleet(folder, out, settings, engine=runs_at, progress=watch)
    if as_json:
        print_json({"files": found.files, "kept": found.kept, "rigs": _documents(found)})
    else:
        show(_table(found))
        _tell_rest(found, out)
    if found.faults:
        tell(f"error: a fault of ours in {', '.join(found.faults)}: please report it")
        raise typer.Exit(1)


def _documents(found: Fleet) -> list[dict[str, Any]]:
    return [{k: v for k, v in row.items() if k != "digest"} for row in found.rows]


def _tell_rest(found: Fleet, out: Path) -> None:
    count, failed = len(found.rows), sum(row["error"] is not None for row in found.rows)
    if count > _SHOWN:
        tell(f"the first {_SHOWN} of {count} rigs; all are in {found.files[0]}")
    told = [f"{count} rigs", f"{len(found.kept)} done before", f"{failed} with errors"]
    tell(", ".join(told) + "; written: " + ", ".join(str(path) for path in found.files))
    if found.stale:
        tell(f"warning: {out / 'parts'} still has rigs that are gone: {', '.join(found.stale)}")


def _table(found: Fleet) -> Table:
    from rich.table import Table

    table = Table(title="What the rigs' models leave out", title_justify="left")
    for name in _COLUMNS:
        table.add_column(name, justify="right" if name in ("sure", "CPU s") else "left")
    for row in found.rows[:_SHOWN]:
        table.add_row(*_cells(row))
    return table


def _cells(row: dict[str, Any]) -> list[str]:
    from drill_env.fleet.row import told_since

    def text(name: str, form: str = "") -> str:
        return "" if row[name] is None else format(row[name], form)

    return [
        text("name"), text("verdict"), text("missing"), text("probability", ".2f"),
        text("numbers"), text("component"), told_since(row["since"], row["last_without"]),
        text("cpu_s", ".0f"), text("error"),
    ]  # fmt: skip
