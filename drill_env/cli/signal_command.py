"""The command that writes a voltage to play on the rig."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from drill_env.cli._common import JsonOption, output_file, print_json, tell


class Kind(StrEnum):
    """The kinds of signal, as typed."""

    QUASI_RANDOM = "quasi-random"
    HARMONIC = "harmonic"
    CONSTANT = "constant"
    RAMP = "ramp"
    PARABOLIC = "parabolic"
    CHIRP = "chirp"
    STEPS = "steps"


KindArgument = Annotated[Kind, typer.Argument(metavar="KIND", help="|".join(k.value for k in Kind))]
OutOption = Annotated[Path, typer.Option(help="Table to write: .csv, .csv.gz or .parquet.")]
SecondsOption = Annotated[float, typer.Option(help="Duration, s.")]
RateOption = Annotated[float, typer.Option(help="Samples per second.")]
LimitOption = Annotated[float, typer.Option(help="Largest voltage of the drive, V.")]
OffsetOption = Annotated[
    float | None, typer.Option(help="Centre or start, V.", show_default="a share of the limit")
]
AmplitudeOption = Annotated[
    float | None,
    typer.Option(help="Largest departure from the offset, V.", show_default="a share of the limit"),
]
SeedOption = Annotated[int, typer.Option(help="Of random levels and holding times.")]
DwellOption = Annotated[
    float | None,
    typer.Option(
        help="Mean time a random level is held, s.", show_default="1.5 quasi-random, 3 steps"
    ),
]
SmoothingOption = Annotated[
    float | None, typer.Option(help="Lag of quasi-random levels, s.", show_default="0.25")
]
FrequencyOption = Annotated[
    float | None,
    typer.Option(
        help="Of harmonic, or where chirp begins, Hz.", show_default="0.2 harmonic, 0.02 chirp"
    ),
]
FrequencyEndOption = Annotated[
    float | None, typer.Option(help="Where chirp ends, Hz.", show_default="1")
]


def signal_command(
    kind: KindArgument,
    out: OutOption,
    seconds: SecondsOption = 50.0,
    rate: RateOption = 200.0,
    limit: LimitOption = 5.0,
    offset: OffsetOption = None,
    amplitude: AmplitudeOption = None,
    seed: SeedOption = 0,
    dwell: DwellOption = None,
    smoothing: SmoothingOption = None,
    frequency: FrequencyOption = None,
    frequency_end: FrequencyEndOption = None,
    as_json: JsonOption = False,
) -> None:
    """Write a voltage to play on the rig: columns t (s) and u (V), held from row to row.

    The signals of the paper's validation (quasi-random, harmonic, constant, ramp, parabolic)
    and two more, chirp and steps. The same seed gives the same signal.

    Example: drill-env signal quasi-random --seed 1 --out play.csv
    """
    import pandas as pd

    from drill_env._tables import check_table_name, write_table
    from drill_env.recordings.signals import Signal, signal_samples

    check_table_name(output_file(out))
    given: dict[str, Any] = {
        "seconds": seconds, "rate": rate, "limit": limit, "offset": offset, "amplitude": amplitude,
        "seed": seed, "dwell": dwell, "smoothing": smoothing, "frequency": frequency,
        "frequency_end": frequency_end,
    }  # fmt: skip
    signal = Signal(kind.value, **{name: v for name, v in given.items() if v is not None})
    t, u = signal_samples(signal)
    write_table(pd.DataFrame({"t": t, "u": u}), out)
    lowest, highest = float(u.min()), float(u.max())
    if as_json:
        print_json(
            {"signal": signal.text, "out": out, "samples": len(t), "seconds": signal.seconds,
             "u_min": lowest, "u_max": highest}
        )  # fmt: skip
    else:
        tell(
            f"{signal.text}: {len(t)} samples between {lowest:.4g} and {highest:.4g} V "
            f"written to {out}"
        )
