"""`drill-env diagnose`: what the model leaves out of recordings."""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from drill_env._errors import InputError
from drill_env.cli._common import (
    JsonOption,
    MapOption,
    RigOption,
    first_interrupt,
    output_folder,
    print_json,
    progress_bar,
    remarks,
    rig_from,
    stages,
)
from drill_env.cli._recordings import look_over, read_set
from drill_env.parameters import Rig


class Law(StrEnum):
    """Friction laws to start from."""

    HUMPED = "humped"
    STRIBECK = "stribeck"
    COULOMB = "coulomb"


FitArgument = Annotated[
    list[Path], typer.Argument(help="Recordings to fit, or one folder of recordings.")
]
HoldoutOption = Annotated[
    list[Path] | None,
    typer.Option(metavar="HOLD...", help="Recordings to judge by.", show_default=False),
]
OutOption = Annotated[Path, typer.Option(help="Folder for page, JSON and rig file.")]
LeaveOption = Annotated[
    list[str] | None,
    typer.Option(help="Effect that the library shall lack, repeatable.", show_default=False),
]
LawOption = Annotated[
    Law | None,
    typer.Option(help="Friction law to start from, with the paper's rig.", show_default=False),
]
MostOption = Annotated[int, typer.Option(min=1, help="Effects that are looked for.")]
DoubtOption = Annotated[
    float, typer.Option(help="How far the rig's parameters may be off: a share, one sigma.")
]
FixOption = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=VALUE",
        help="A parameter that is held; dTsu=0 is a model without it. Repeatable.",
        show_default=False,
    ),
]
StrictOption = Annotated[
    bool,
    typer.Option(
        "--strict", help="Refuse a recording that no such rig can make; otherwise it is a warning."
    ),
]
ThoroughOption = Annotated[
    bool,
    typer.Option("--thorough", help="Search to the end, not for two minutes at most."),
]
SeedOption = Annotated[int, typer.Option(min=0, help="Seed of the noise floor and intervals.")]


def diagnose_command(
    fit: FitArgument,
    out: OutOption = Path("report"),
    holdout: HoldoutOption = None,
    rig: RigOption = None,
    start_friction: LawOption = None,
    leave_out: LeaveOption = None,
    most: MostOption = 2,
    mapping: MapOption = None,
    doubt: DoubtOption = 0.05,
    fix: FixOption = None,
    seed: SeedOption = 0,
    strict: StrictOption = False,
    thorough: ThoroughOption = False,
    as_json: JsonOption = False,
) -> None:
    """Find the physics that the rig's model leaves out of recordings, and model it.

    The rig is fitted first; then every effect of the library is scored, the best are fitted
    together with the rig and the noise, and what the data demand is kept if it helps on
    recordings that were held out. Writes index.html, diagnosis.json and rig-extended.toml. Four
    recordings of a minute take about a minute; after two it searches no further unless --thorough
    is given. An interrupt ends the search with what it knows.

    Example: drill-env diagnose fit-*.csv --holdout hold.csv --out report
    """
    from drill_env.diagnosis.bounded import bounded
    from drill_env.diagnosis.diagnose import diagnose
    from drill_env.diagnosis.doubtful import with_remarks
    from drill_env.diagnosis.options import DiagnosisOptions
    from drill_env.report.diagnosis_files import diagnosis_texts, write_diagnosis

    output_folder(out)
    options = DiagnosisOptions(
        leave_out=tuple(leave_out or ()),
        most=most,
        given_rig=rig is not None,
        fixed=_fixed(fix or []),
        doubt=doubt,
        seed=seed,
    )
    if thorough:
        options = replace(options, seconds=math.inf)
    start = _start(rig, start_friction)
    # What the recordings look like is told before the minutes of work.
    with remarks():
        recordings = read_set(fit, mapping or [], holdout or [])
        known = None if rig is None else start
        doubts = look_over(recordings, known, incomplete=True, strict=strict)
        fitted, held = bounded(recordings.fit, recordings.holdout)
    with remarks(), progress_bar() as bar, first_interrupt() as asked:
        report = stages(bar, options.seconds, asked)
        found = diagnose(fitted, start, held, options=options, report=report)
        found = replace(found, result=with_remarks(found.result, doubts))
        report("writing the report")
        write_diagnosis(diagnosis_texts(found), out)
    if as_json:
        print_json(found.result.as_dict())
        return
    for line in found.result.sentences:
        typer.echo(line)
    typer.echo(f"Report: {out / 'index.html'}")


def _fixed(texts: list[str]) -> dict[str, float]:
    from drill_env.cli._identify_rig import pairs

    return {name: value for name, (value,) in pairs(texts, "--fix", 1).items()}


def _start(path: Path | None, law: Law | None) -> Rig:
    start = rig_from(path)
    if law is None or law.value == start.friction:
        return start
    if path is not None:
        raise InputError("--start-friction goes with the paper's rig: write the law in the file")
    if law is Law.COULOMB:
        return start.replace(friction="coulomb", Tsl=0.05, bl=0.002)
    return start.replace(friction="stribeck", Tsl=0.08, T1=-0.05, beta1=0.3, bl=0.002)
