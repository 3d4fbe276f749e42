"""`drill-env check`: what recordings hold, and what is doubtful about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from drill_env.cli._common import JsonOption, MapOption, RigOption, print_json, remarks, show
from drill_env.cli._recordings import look_over, read_set
from drill_env.parameters import load_rig

if TYPE_CHECKING:
    from rich.table import Table

    from drill_env.recordings import Recording

RecordingsArgument = Annotated[
    list[Path], typer.Argument(metavar="REC...", help="Recordings, or one folder of recordings.")
]
_DRIVES = {
    "voltage": ("u", "V"), "torque": ("torque", "Nm"), "motion": ("acceleration_u", "rad/s^2"),
}  # fmt: skip


def check_command(
    recordings: RecordingsArgument,
    rig: RigOption = None,
    mapping: MapOption = None,
    as_json: JsonOption = False,
) -> None:
    """Read recordings as identify and diagnose do, and say what they hold.

    Lists rows, rate, gaps and the range of each channel in SI units; warnings tell what is
    doubtful: wrong units or signs, exchanged columns, lost rows. With --rig sizes are held against
    that rig, too.

    Example: drill-env check recordings/ --rig rig.toml
    """
    given = None if rig is None else load_rig(rig)
    with remarks():
        found = read_set(recordings, mapping or [])
        look_over(found, given, incomplete=True)
    rows = [
        {"role": role, "closed_loop": found.of(r).closed_loop, **_told(r)}
        for role in ("stage1", "fit", "holdout")
        for r in getattr(found, role)
    ]
    if as_json:
        print_json(rows)
    else:
        show(_table(rows))


def _told(recording: Recording) -> dict[str, Any]:
    drive, unit = _DRIVES[recording.drive]
    units = {"u": unit} | dict.fromkeys(recording.angles(), "rad")
    units |= dict.fromkeys(recording.velocities(), "rad/s")
    units |= dict.fromkeys(recording.loads(), "Nm") | {"bridge": ""}
    channels = recording.channels()
    return {
        "source": recording.source,
        "rows": len(recording),
        "seconds": recording.duration,
        "rate_hz": recording.rate,
        "gaps": len(recording.gaps),
        "added_inertia": {"u": recording.added_inertia_u, "l": recording.added_inertia_l},
        "effects": [str(effect["id"]) for effect in recording.effects],
        "channels": {
            drive if name == "u" else name: {
                "unit": units[name],
                "low": float(np.nanmin(channels[name])),
                "high": float(np.nanmax(channels[name])),
                "step": recording.quanta.get(name),
            }
            for name in channels
            if name != "t"
        },
    }


def _table(rows: Sequence[Mapping[str, Any]]) -> Table:
    from rich.table import Table

    table = Table(title="Recordings", title_justify="left")
    for head in ("file", "role", "rows", "s", "Hz", "gaps", "channels"):
        table.add_column(head, justify="left" if head in ("file", "role", "channels") else "right")
    for row in rows:
        lines = [_range(name, told) for name, told in row["channels"].items()]
        added = {disc: value for disc, value in row["added_inertia"].items() if value}
        lines += [f"added_inertia_{disc} {value:.4g} kg m^2" for disc, value in added.items()]
        lines += [f"known effect {name}" for name in row["effects"]]
        table.add_row(
            Path(row["source"]).name, row["role"] + (", closed loop" if row["closed_loop"] else ""),
            str(row["rows"]), f"{row['seconds']:.4g}", f"{row['rate_hz']:.5g}", str(row["gaps"]),
            "\n".join(lines),
        )  # fmt: skip
    return table


def _range(name: str, told: Mapping[str, Any]) -> str:
    step = "" if told["step"] is None else f", steps of {told['step']:.3g}"
    return f"{name} {told['low']:.4g} to {told['high']:.4g} {told['unit']}{step}"
