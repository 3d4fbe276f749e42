"""Commands that take recordings: replay and identify."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from drill_env.cli._common import (
    JsonOption,
    MapOption,
    RigOption,
    SeveralHoldouts,
    output_file,
    print_json,
    remarks,
    rig_from,
    show,
    tell,
)

if TYPE_CHECKING:
    from rich.table import Table

    from drill_env.identification.replay import ReplayResult
    from drill_env.recordings import Channel, Recording

FitArgument = Annotated[list[Path], typer.Argument(metavar="FIT...", help="Recordings to fit.")]
OneInertiaOption = Annotated[
    bool, typer.Option("--one-inertia", help="Upper disc alone, or any single axis.")
]
GainOption = Annotated[float | None, typer.Option(help="Force or torque per volt; must be known.")]
GainColumnOption = Annotated[
    str | None, typer.Option(help="Take the gain from this number in the first FIT file.")
]
HoldoutOption = Annotated[
    list[Path] | None, typer.Option(metavar="HOLD...", help="Recordings to judge by, one or more.")
]
AsymmetricOption = Annotated[
    bool, typer.Option("--asymmetric", help="Friction apart for each direction.")
]
CutoffOption = Annotated[
    float | None, typer.Option(help="Low-pass in Hz.", show_default="100 or a tenth of the rate")
]
DecimationOption = Annotated[
    int | None, typer.Option(help="Keep one sample in so many.", show_default="rate/cutoff")
]
CentreOption = Annotated[
    bool,
    typer.Option("--centre-hold", help="Mean of the voltages held before and after a sample."),
]
ClosedLoopOption = Annotated[
    bool, typer.Option("--closed-loop", help="Fit the force of the simulated position loop.")
]
ReferenceOption = Annotated[
    str | None, typer.Option(metavar="COLUMN[:UNIT]", help="Position asked for in the loop.")
]
DisturbanceOption = Annotated[
    str | None, typer.Option(metavar="COLUMN", help="Voltage known to act beside the loop's.")
]
CompareOption = Annotated[
    bool, typer.Option("--compare", help="Compare friction with and without asymmetry (minutes).")
]
FixOption = Annotated[
    list[str] | None, typer.Option(metavar="NAME=VALUE", help="A given parameter; repeatable.")
]
FreeOption = Annotated[
    str | None, typer.Option(metavar="NAMES", help="Estimate only these, comma-separated.")
]
PriorOption = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME=MEAN:SD", help="What is known beforehand; repeatable."),
]
BoundsOption = Annotated[
    list[str] | None, typer.Option(metavar="NAME=LOW:HIGH", help="Limits; repeatable.")
]
Stage1Option = Annotated[
    list[Path] | None,
    typer.Option("--stage1", metavar="REC", help="Upper disc alone, fitted first; repeatable."),
]
LinkOption = Annotated[
    Literal["fixed", "prior", "free"], typer.Option(help="How the whole rig takes stage 1.")
]
FitMethodOption = Annotated[
    Literal["prediction_error", "multiple_shooting"], typer.Option(help="What is minimised.")
]
WindowOption = Annotated[float, typer.Option(help="s between starts of multiple shooting.")]
NoiseOption = Annotated[
    Literal["shared", "each"], typer.Option(help="One noise for all recordings, or each its own.")
]
StartsOption = Annotated[int, typer.Option(help="Number of starts, up to 30 % apart.")]
SeedOption = Annotated[int, typer.Option(help="Of the further starts.")]
ProfileOption = Annotated[
    str | None, typer.Option(metavar="NAMES", help="Profile likelihood of these parameters.")
]
LawsOption = Annotated[bool, typer.Option("--laws", help="Compare the friction laws.")]
ReportOption = Annotated[Path | None, typer.Option(help="Folder of the validation page.")]
EstimateOption = Annotated[Path | None, typer.Option(help="Estimate file to write (JSON).")]
RigOutOption = Annotated[Path | None, typer.Option(help="Rig file to write.")]


def register(app: typer.Typer) -> None:
    """Add ``replay`` and ``identify`` to a command line."""
    app.command("replay")(replay_command)
    app.command("identify", cls=SeveralHoldouts)(identify_command)


def replay_command(
    recording: Annotated[Path, typer.Argument(metavar="REC", help="Recording to replay.")],
    rig: RigOption = None,
    mapping: MapOption = None,
    horizon: Annotated[float, typer.Option(help="Prediction restarts every so many s.")] = 5.0,
    out: Annotated[Path | None, typer.Option(help="Picture to draw (.png .pdf .svg).")] = None,
    as_json: JsonOption = False,
) -> None:
    """Lay the simulation of a rig over a recording: error per channel and a picture.

    REC holds the columns t (s), u (V), theta_u, theta_l (rad) as CSV, Parquet, JSON or .mat;
    other names, units and channels (torque, omega_u, omega_l, load_u, load_l) by --map, and an
    inertia that was bolted on, --map added_inertia_l=0.01. The error is given for one free run from
    the first sample and for predictions that restart every --horizon seconds.

    Example: drill-env replay run.csv --rig rig.toml --out replay.png
    """
    from drill_env.identification.replay import replay

    if out is not None:
        output_file(out)
    with remarks():
        parameters = rig_from(rig)
        measured = _read([recording], mapping, ("u",))[0]
        result = replay(measured, parameters, horizon=horizon)
        for note in result.notes:
            warnings.warn(note, stacklevel=1)
        if out is not None:
            from drill_env.report.replay_picture import save_replay_picture

            save_replay_picture(result, out)
    if as_json:
        print_json({**result.as_dict(), "picture": None if out is None else str(out)})
        return
    show(_replay_table(result))
    if result.force_error is not None:
        typer.echo(f"relative force error (inverse dynamics): {100 * result.force_error:.3f} %")
    if out is not None:
        tell(f"picture: {out}")


def identify_command(
    fit: FitArgument,
    rig: RigOption = None,
    fix: FixOption = None,
    free: FreeOption = None,
    prior: PriorOption = None,
    bounds: BoundsOption = None,
    stage1: Stage1Option = None,
    link: LinkOption = "prior",
    method: FitMethodOption = "prediction_error",
    window: WindowOption = 5.0,
    noise: NoiseOption = "shared",
    starts: StartsOption = 1,
    seed: SeedOption = 0,
    holdout: HoldoutOption = None,
    mapping: MapOption = None,
    profile: ProfileOption = None,
    laws: LawsOption = False,
    report: ReportOption = None,
    estimate: EstimateOption = None,
    out: RigOutOption = None,
    as_json: JsonOption = False,
    one_inertia: OneInertiaOption = False,
    gain: GainOption = None,
    gain_column: GainColumnOption = None,
    asymmetric: AsymmetricOption = False,
    cutoff: CutoffOption = None,
    decimation: DecimationOption = None,
    centre_hold: CentreOption = False,
    closed_loop: ClosedLoopOption = False,
    reference: ReferenceOption = None,
    disturbance: DisturbanceOption = None,
    compare: CompareOption = False,
) -> None:
    """Identify a rig from recordings, and judge it on others.

    FIT are recordings with u (or torque) and theta_u, theta_l (or omega_u, omega_l), or one
    folder with a recordings.toml. All parameters but those of --fix are estimated, from --rig or
    the paper's rig on; 30 % off will do. One torque must be fixed, since volts and angles do not
    show its scale; a measured torque, a load and an added inertia that differs do.

    With --one-inertia: mass, viscous and Coulomb friction and offset of a single axis by
    inverse-dynamics least squares; its options are those from --gain on. With --closed-loop
    the position law is found in the FIT files, and what is fitted and judged is the force of
    the simulated loop.

    Examples:
    drill-env identify a.csv b.csv --holdout c.csv --fix Ju=0.4765 --report report/

    drill-env identify --one-inertia --gain 3.57 a.csv --holdout b.csv --out rig.toml
    """
    if not one_inertia:
        from drill_env.cli._identify_rig import RigFit, identify_rig
        from drill_env.identification.estimate import FitOptions

        options = FitOptions(method, window=window, noise=noise, starts=starts, seed=seed)
        identify_rig(
            RigFit(
                fit, options, stage1=stage1 or (), holdout=holdout or (), mapping=mapping or (),
                rig=rig, free=free, fixed=fix or (), priors=prior or (), bounds=bounds or (),
                link=link, profile=profile, laws=laws, out=out, estimate=estimate, report=report,
                as_json=as_json,
            )
        )  # fmt: skip
        return
    from drill_env.cli._identify_axis import AxisFit, identify_axis
    from drill_env.identification.inverse_dynamics import InverseOptions

    identify_axis(
        AxisFit(
            fit, InverseOptions(cutoff, decimation=decimation, centre_hold=centre_hold),
            holdout=holdout or (), mapping=mapping or (), gain=gain, gain_column=gain_column,
            asymmetric=asymmetric, closed_loop=closed_loop, reference=reference,
            disturbance=disturbance, compare=compare, out=out, as_json=as_json,
        )
    )  # fmt: skip


def _read(
    paths: list[Path], mapping: list[str] | None, need: tuple[Channel, ...]
) -> list[Recording]:
    from drill_env.recordings import parse_map, read_recording

    columns = parse_map(mapping or [])
    return [read_recording(path, columns, need=need) for path in paths]


def _replay_table(result: ReplayResult) -> Table:
    from rich.table import Table

    unit = "rad" if result.rig.inertias == 2 else "unit"
    table = Table(title=f"Replay of {Path(result.recording.source).name}", title_justify="left")
    table.add_column("channel")
    for name in (f"rms [{unit}]", f"max [{unit}]", "% of range"):
        table.add_column(name, justify="right")
    groups = [("free run", result.errors)]
    groups.append((f"restarted every {result.horizon:g} s", result.prediction_errors))
    for label, errors in groups:
        for name, e in errors.items():
            shown = f"{name} [{unit}/s]" if name.startswith("omega") else name
            table.add_row(f"{shown}, {label}", f"{e.rms:.4g}", f"{e.max:.4g}", f"{e.percent:.3f}")
    return table
