"""The command that proposes the next experiment."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from drill_env._errors import InputError
from drill_env._tables import check_table_name, write_table
from drill_env.cli._common import (
    JsonOption,
    MapOption,
    output_file,
    print_json,
    progress_bar,
    remarks,
    rig_from,
    show,
    tell,
)
from drill_env.parameters import SYMBOLS, Rig

if TYPE_CHECKING:
    from rich.table import Table

    from drill_env.identification.experiment import Plan
    from drill_env.identification.knowledge import Knowledge
    from drill_env.recordings.signals import SignalKind

RigArgument = Annotated[
    Path | None,
    typer.Argument(metavar="[RIG]", help="Rig file; the paper's by default.", show_default=False),
]
EstimateOption = Annotated[
    Path | None, typer.Option(metavar="JSON", help="What identify wrote, instead of a rig file.")
]
RecordingsOption = Annotated[
    list[Path] | None,
    typer.Option(metavar="FIT", help="Recording to fit first, repeatable.", show_default=False),
]
FixOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME", help="Parameter known to be as in RIG, repeatable.", show_default="Ju"
    ),
]
MenuOption = Annotated[str | None, typer.Option(help="Kinds of signal.", show_default="all")]
CriterionOption = Annotated[
    str, typer.Option(help="D for all parameters together, or the one whose interval matters.")
]
OutOption = Annotated[
    Path | None, typer.Option(help="Voltage to play (.csv .csv.gz .parquet).", show_default=False)
]
_SHOWN = 8
# A short recording may have several minima, and a design from the wrong one is worthless.
_STARTS = 3


def design_command(
    rig: RigArgument = None,
    estimate: EstimateOption = None,
    recordings: RecordingsOption = None,
    mapping: MapOption = None,
    fix: FixOption = None,
    menu: MenuOption = None,
    seconds: Annotated[float, typer.Option(help="Duration of the experiment, s.")] = 60.0,
    rate: Annotated[float, typer.Option(help="Samples per second.")] = 200.0,
    limit: Annotated[float, typer.Option(help="Largest voltage, V.")] = 5.0,
    criterion: CriterionOption = "D",
    variants: Annotated[int, typer.Option(help="Variants of each kind.")] = 6,
    seed: Annotated[int, typer.Option(help="Of the variants.")] = 0,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Propose the voltage that tells most of what is not yet known of a rig.

    Each signal of a menu is simulated with the estimate, and what its recording would tell
    is added to what is known. Without --estimate or --recordings every parameter but Ju is
    taken as known to 30 % only.

    Example: drill-env design-experiment --estimate estimate.json --out next.csv
    """
    if out is not None:
        output_file(out)
        check_table_name(out)
    kinds = _kinds(menu)
    with remarks():
        from drill_env.identification.experiment import design
        from drill_env.identification.signal_menu import menu as signal_menu

        signals = signal_menu(
            kinds, seconds=seconds, rate=rate, limit=limit, variants=variants, seed=seed
        )
        knowledge = _knowledge(rig, estimate, recordings or [], mapping, fix)
        with progress_bar() as bar:
            task = bar.add_task("signals", total=len(signals))
            plan = design(
                knowledge, signals, criterion=criterion,
                progress=lambda done, _: bar.update(task, completed=done),
            )  # fmt: skip
        if out is not None:
            _write(plan, out)
    if as_json:
        print_json({**plan.as_dict(), "out": None if out is None else str(out)})
        return
    _show(plan)
    if out is not None:
        tell(f"voltage: {out}")


def _kinds(text: str | None) -> list[SignalKind]:
    from drill_env.recordings.signals import SIGNAL_KINDS

    if text is None:
        return list(SIGNAL_KINDS)
    # Unknown ones are the menu's to refuse.
    return [cast("SignalKind", part.strip()) for part in text.split(",") if part.strip()]


def _knowledge(
    path: Path | None,
    estimate: Path | None,
    recordings: list[Path],
    mapping: list[str] | None,
    fix: list[str] | None,
) -> Knowledge:
    if estimate is not None:
        given = {"RIG": path, "--recordings": recordings, "--fix": fix}
        clash = [name for name, value in given.items() if value]
        if clash:
            raise InputError(
                f"--estimate already holds what {clash[0]} would say: give one of them"
            )
        from drill_env.identification.estimate_file import load_knowledge

        return load_knowledge(estimate)
    rig, fixed = rig_from(path), fix or ["Ju"]
    unknown = [name for name in fixed if name not in SYMBOLS]
    if unknown:
        raise InputError(f"--fix {unknown[0]}: give one of {', '.join(SYMBOLS)}")
    if recordings:
        return _fitted(rig, recordings, mapping, fixed)
    from drill_env.identification.knowledge import weak_knowledge

    return weak_knowledge(rig, fixed=fixed)


def _fitted(rig: Rig, paths: list[Path], mapping: list[str] | None, fixed: list[str]) -> Knowledge:
    from drill_env.identification.drive import motion_driven
    from drill_env.identification.estimate import FitOptions, identify
    from drill_env.identification.knowledge import knowledge_of
    from drill_env.recordings import parse_map, read_recording

    columns = parse_map(mapping or [])
    measured = [read_recording(path, columns, need=("u",)) for path in paths]
    if motion_driven(measured):
        raise InputError(f"{paths[0]}: u=unknown is no voltage, and what is planned is one")
    with progress_bar() as bar:
        task = bar.add_task("fit", total=None)
        found = identify(
            measured, rig, fixed={name: getattr(rig, name) for name in fixed},
            options=FitOptions(starts=_STARTS),
            progress=lambda start, step, value: bar.update(task, completed=step),
        )  # fmt: skip
    return knowledge_of(found)


def _write(plan: Plan, out: Path) -> None:
    import pandas as pd

    from drill_env.recordings.signals import signal_samples

    t, u = signal_samples(plan.best.signal)
    write_table(pd.DataFrame({"t": t, "u": u}), out)


def _show(plan: Plan) -> None:
    from rich.table import Table

    found = plan.as_dict()
    for line in found["residual_shape"]:
        typer.echo(line)
    table = Table(title="Intervals (95 %), now and with the proposed signal", title_justify="left")
    table.add_column("parameter")
    for name in ("value", "now +-", "expected +-", "narrower by"):
        table.add_column(name, justify="right")
    for name, entry in found["parameters"].items():
        now, after = entry["half_width"], entry["expected_half_width"]
        about = "~" if entry["rough"] else ""
        table.add_row(
            name, f"{entry['value']:.5g}", f"{now:.2g}", f"{about}{after:.2g}",
            f"{about}{1.0 / (1.0 - entry['expected_shrink']):.3g}x",
        )  # fmt: skip
    show(table)
    if plan.rough:
        typer.echo("~ told too little now for more than the order of magnitude")
    show(_ranking(plan))
    typer.echo(f"play: drill-env signal {plan.best.signal.text}")


def _ranking(plan: Plan) -> Table:
    from rich.table import Table

    one = plan.criterion if plan.criterion in plan.knowledge.free else None
    table = Table(title=f"Best of {len(plan.proposals)} signals", title_justify="left")
    table.add_column("signal")
    table.add_column("intervals narrower by (mean)", justify="right")
    if one:
        table.add_column(f"that of {one}", justify="right")
    for proposal in plan.proposals[:_SHOWN]:
        own = [f"{1.0 / (1.0 - plan.shrink(proposal)[one]):.3g}x"] if one else []
        table.add_row(
            proposal.signal.text, f"{1.0 / (1.0 - plan.mean_shrink(proposal)):.3g}x", *own
        )
    return table
