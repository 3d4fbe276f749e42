"""The command that simulates the rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drill_env._errors import InputError
from drill_env.cli._common import (
    JsonOption,
    MapOption,
    RigOption,
    numbers,
    output_file,
    print_json,
    remarks,
    rig_from,
    tell,
)

if TYPE_CHECKING:
    import pandas as pd

    from drill_env._types import FloatArray
    from drill_env.integrator import Trajectory
    from drill_env.parameters import Rig


OutOption = Annotated[Path, typer.Option(help="Table to write: .csv, .csv.gz or .parquet.")]
VoltsOption = Annotated[float | None, typer.Option(help="Constant voltage, V.")]
SecondsOption = Annotated[float | None, typer.Option(help="Duration, s.")]
InputOption = Annotated[
    Path | None, typer.Option("--input", help="Recording whose voltage is played.")
]
RateOption = Annotated[
    float | None,
    typer.Option(help="Samples per second; 200, or the times of --input.", show_default=False),
]
InitialOption = Annotated[
    str | None, typer.Option(help="Start: twist,omega_u,omega_l in rad and rad/s; rest by default.")
]
EncoderOption = Annotated[
    bool, typer.Option("--encoder", help="Write encoder angles and filtered velocities.")
]
CountsOption = Annotated[int, typer.Option(help="Encoder counts per revolution.")]


def simulate_command(
    out: OutOption,
    volts: VoltsOption = None,
    seconds: SecondsOption = None,
    source: InputOption = None,
    mapping: MapOption = None,
    rig: RigOption = None,
    rate: RateOption = None,
    initial: InitialOption = None,
    encoder: EncoderOption = False,
    counts: CountsOption = 8192,
    as_json: JsonOption = False,
) -> None:
    """Simulate the rig under a constant or recorded voltage, exactly.

    Writes t,u,theta_u,theta_l,omega_u,omega_l, exact unless --encoder is given: row i holds
    the state at t and the voltage held from there on.

    Example: drill-env simulate --volts 3.5 --seconds 60 --out run.csv
    """
    from drill_env._tables import check_table_name, write_table

    check_table_name(output_file(out))
    with remarks():
        plant = rig_from(rig)
        if source is None:
            trajectory = _constant(plant, volts, seconds, rate, _start(initial))
        elif volts is None:
            trajectory = _played(plant, source, mapping, seconds, rate, _start(initial))
        else:
            raise InputError("--volts and --input are both given: give one of them")
        write_table(run_table(trajectory, counts if encoder else None), out)
    summary = run_summary(trajectory, out)
    if as_json:
        print_json(summary)
    else:
        tell(_sentence(summary))


def _sentence(summary: dict[str, Any]) -> str:
    return (
        f"{summary['samples']} samples over {summary['seconds']:g} s written to {summary['out']}; "
        f"omega_l from {summary['omega_l_min']:.4f} to {summary['omega_l_max']:.4f} rad/s; sticks "
        f"{summary['sticks']}, break-aways {summary['break_aways']}, "
        f"reversals {summary['reversals']}"
    )


def _start(initial: str | None) -> FloatArray | None:
    import numpy as np

    if initial is None:
        return None
    values = numbers(initial, "--initial")
    if len(values) not in (3, 4):
        raise InputError(f"--initial has {len(values)} numbers: give twist,omega_u,omega_l")
    return np.append(values, 0.0)[:4]


def _constant(
    rig: Rig,
    volts: float | None,
    seconds: float | None,
    rate: float | None,
    start: FloatArray | None,
) -> Trajectory:
    from drill_env.integrator import simulate

    if volts is None:
        raise InputError("no voltage: give --volts with --seconds, or --input REC.csv")
    if seconds is None:
        raise InputError("--volts needs --seconds: how long to simulate")
    return simulate(rig, volts, seconds, rate=rate, initial=start)


def _played(
    rig: Rig,
    source: Path,
    mapping: list[str] | None,
    seconds: float | None,
    rate: float | None,
    start: FloatArray | None,
) -> Trajectory:
    import numpy as np

    from drill_env.identification.drive import driven_rig
    from drill_env.identification.initial_state import state_at, with_led_disc
    from drill_env.identification.known_loads import loaded
    from drill_env.integrator import sampled_voltage, simulate
    from drill_env.recordings import parse_map, read_recording

    recording = read_recording(source, parse_map(mapping or []), need=("u",))
    assert recording.u is not None
    begin, last = float(recording.t[0]), float(recording.t[-1])
    length = last - begin if seconds is None else seconds
    if seconds is None and begin + length < last:
        # Rounding must not cost the last row.
        length = float(np.nextafter(length, np.inf))
    times = recording.t[recording.t <= begin + length] if rate is None else None
    drive = sampled_voltage(recording.t, recording.u)
    rig = driven_rig(rig, [recording])
    if recording.drive == "motion":
        whole = state_at(recording, rig, 0)
        start = whole if start is None else with_led_disc(recording, start)
    rig = loaded(rig, recording, begin)
    return simulate(rig, drive, length, t_start=begin, t_eval=times, rate=rate, initial=start)


def run_table(trajectory: Trajectory, counts: int | None) -> pd.DataFrame:
    """Columns of a written run; through an encoder of so many `counts`, if given."""
    import numpy as np
    import pandas as pd

    from drill_env.sensors import Encoder, filter_velocity, read_encoder

    theta_u, theta_l = trajectory.readings.T
    omega_u, omega_l = trajectory.omega_u, trajectory.omega_l
    if counts is not None:
        if len(trajectory.t) < 2:
            raise InputError("--encoder needs two samples or more: lengthen the run")
        rate = 1.0 / float(np.diff(trajectory.t).mean())
        device = Encoder(counts_per_rev=counts, rate_hz=rate, cutoff_hz=min(5.0, 0.4 * rate))
        speeds = trajectory.omega_u[0], trajectory.omega_l[0]
        theta_u, theta_l = read_encoder(theta_u, device), read_encoder(theta_l, device)
        omega_u = filter_velocity(theta_u, device, speeds[0])
        omega_l = filter_velocity(theta_l, device, speeds[1])
    return pd.DataFrame(
        {
            "t": trajectory.t,
            "u": trajectory.u,
            "theta_u": theta_u,
            "theta_l": theta_l,
            "omega_u": omega_u,
            "omega_l": omega_l,
        }
    )


def run_summary(trajectory: Trajectory, out: Path) -> dict[str, Any]:
    """What a run came to, in a few numbers."""
    from drill_env.integrator import Disc, Kind

    lower = trajectory.events.where(Disc.LOWER)
    return {
        "out": out,
        "seconds": float(trajectory.t[-1] - trajectory.t[0]),
        "samples": len(trajectory.t),
        "omega_l_min": float(trajectory.omega_l.min()),
        "omega_l_max": float(trajectory.omega_l.max()),
        "sticks": int((lower.kind == Kind.STICK).sum()),
        "break_aways": int((lower.kind == Kind.SLIP).sum()),
        "reversals": int((lower.kind == Kind.REVERSAL).sum()),
        "steps": trajectory.steps,
    }
