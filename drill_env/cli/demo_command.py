"""The main job from end to end: simulate, compare, find a hidden effect."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drill_env.cli._common import (
    JsonOption,
    output_folder,
    print_json,
    progress_bar,
    remarks,
    stages,
)
from drill_env.cli._demo_detective import detective_lines, find_hidden_effect
from drill_env.parameters import Rig

if TYPE_CHECKING:
    from drill_env.recordings import Channel, Recording

_EMPS = ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")
_EMPS_MAP: dict[Channel, str] = {"theta_u": "qm:m", "u": "vir"}


def demo_command(
    out: Annotated[Path, typer.Option(help="Folder for tables and pictures.")] = Path("out"),
    recordings: Annotated[
        Path | None,
        typer.Option(help="Folder of the EMPS benchmark (DATA_EMPS.mat), a real recording."),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run the main job: the rig simulated, controllers compared, a hidden effect found.

    With --recordings a real axis is identified too: the EMPS benchmark of
    nonlinearbenchmark.org.
    """
    from drill_env._files import make_folder

    with remarks(), progress_bar() as bar:
        tell_stage = stages(bar)
        # A wrong folder is told at once and leaves nothing behind.
        real = None if recordings is None else _emps(recordings)
        folder = make_folder(output_folder(out))
        tell_stage("simulating the rig")
        report: dict[str, Any] = {"simulation": _simulate(folder)}
        tell_stage("comparing controllers")
        report["comparison"] = _compare(folder)
        report["comparison_files"] = [folder / "compare" / f"compare.{e}" for e in ("csv", "png")]
        report["detective"] = find_hidden_effect(folder / "detective", tell_stage)
        if real is not None:
            tell_stage("identifying a real axis")
            report["recording"] = _identify(folder, *real)
    if as_json:
        print_json(report)
        return
    for line in _lines(report):
        typer.echo(line)


def _simulate(out: Path) -> dict[str, Any]:
    from drill_env._tables import write_table
    from drill_env.cli.simulate_command import run_summary, run_table
    from drill_env.integrator import simulate
    from drill_env.report.run_picture import save_run_picture

    run = simulate(Rig.paper(), 3.5, 60.0)
    write_table(run_table(run, None), out / "simulation.csv")
    save_run_picture(run, out / "simulation.png")
    return {
        "volts": 3.5,
        **run_summary(run, out / "simulation.csv"),
        "picture": out / "simulation.png",
    }


def _compare(out: Path) -> list[dict[str, Any]]:
    from drill_env import baselines
    from drill_env.benchmark import compare
    from drill_env.cli.compare_command import write_comparison
    from drill_env.environment.config import EnvConfig
    from drill_env.report.compare_table import vibration_free

    config = EnvConfig()
    runs = compare(baselines.CONTROLLERS, config)
    write_comparison(runs, config, out / "compare")
    runs = runs.assign(free=vibration_free(runs))
    return [
        {
            "controller": name,
            "start": start,
            "vibration_free": int(group.free.sum()),
            "setpoints": len(group),
            "median_severity_index": float(group.severity_index.median()),
        }
        for (name, start), group in runs.groupby(["controller", "start"], sort=False)
    ]


def _identify(out: Path, fit: Recording, held: list[Recording], gain: float) -> dict[str, Any]:
    from drill_env.identification.one_inertia import identify_one_inertia
    from drill_env.identification.replay import replay
    from drill_env.parameters import save_rig
    from drill_env.report.replay_picture import save_replay_picture

    result = identify_one_inertia([fit], gain, holdout=held)
    save_rig(result.rig, out / "identified-rig.toml")
    save_replay_picture(replay(fit, result.rig), out / "recording.png")
    return {
        **result.as_dict(),
        "rig_file": out / "identified-rig.toml",
        "picture": out / "recording.png",
    }


def _emps(folder: Path) -> tuple[Recording, list[Recording], float]:
    from drill_env.recordings import read_recording

    fit, *held = (read_recording(folder / name, _EMPS_MAP, need=("u", "theta_u")) for name in _EMPS)
    return fit, held, fit.constant("gtau")


def _lines(report: dict[str, Any]) -> Iterator[str]:
    run, found = report["simulation"], report.get("recording")
    yield (
        f"1. Simulation at {run['volts']} V, {run['seconds']:g} s: omega_l between "
        f"{run['omega_l_min']:.3f} and {run['omega_l_max']:.3f} rad/s, {run['reversals']} reversals"
    )
    yield f"   -> {run['out']}, {run['picture']}"
    yield "2. Controllers, set points free of vibration:"
    for row in report["comparison"]:
        yield (
            f"   {row['controller']:<15} from {row['start']:<12} "
            f"{row['vibration_free']:>2} of {row['setpoints']}  (median severity index "
            f"{row['median_severity_index']:.3f})"
        )
    yield f"   -> {', '.join(map(str, report['comparison_files']))}"
    yield from detective_lines(report["detective"])
    if found is None:
        return
    yield "4. A real axis (EMPS), one inertia identified:"
    for name, value in found["estimates"].items():
        yield f"   {name:<12} {value:.6g}"
    for label in ("fit_errors", "holdout_errors"):
        for source, share in found[label].items():
            name = "fitted" if label == "fit_errors" else "held out"
            yield f"   residual force, {name} {Path(source).name}: {share:.2%}"
    yield f"   -> {found['rig_file']}, {found['picture']}"
