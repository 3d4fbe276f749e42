"""The detective on a real axis, EMPS, with one term of its friction left out of the model in turn.

python benchmarks/emps_left_out.py --recordings ../shared/recordings/emps [--json out.json]

Force errors are those of inverse dynamics after the published filters. "Least squares without" is
the best that the model without the term can do on the fit file, "fitted" what the detective's
fit of it comes to, "found" the same with what was found. The pulses file is never fitted.
"""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from drill_env.diagnosis.diagnose import Diagnosis, diagnose
from drill_env.diagnosis.force_error import force_error
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.identification.inverse_dynamics import InverseOptions, force_balance, relative_error
from drill_env.identification.one_inertia import identify_one_inertia
from drill_env.parameters import Rig
from drill_env.recordings import Recording, parse_map, read_recording

FILES = ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")
MAPS = ("u=vir", "theta_u=qm:m")
DOUBT, MOST = 0.5, 3


@dataclass(frozen=True)
class Case:
    """A term left out: what is 0 in the rig file, what is held with --fix, and its effect."""

    zero: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()
    leave_out: tuple[str, ...] = ()
    effect: str = ""
    published: str = "5.982"


CASES = {
    "Coulomb term": Case(("Tsu", "dTsu"), effect="upper_coulomb"),
    "viscous term": Case(("bu", "dbu"), effect="upper_viscous"),
    # The published symmetric model without its offset: the asymmetry is its other name.
    "offset": Case(("dTsu", "dbu"), ("dTsu", "dbu"), effect="upper_offset"),
    "offset, no asymmetry offered": Case(
        ("dTsu", "dbu"), ("dTsu", "dbu"), ("upper_asymmetry",), effect="upper_offset"
    ),
    "offset, asymmetry in the rig": Case(("dTsu",), ("dTsu",), effect="upper_offset"),
    "asymmetry": Case(("dbu",), ("dbu",), effect="upper_asymmetry"),
    "nothing": Case(),
}


def read_emps(folder: Path) -> tuple[Recording, Recording]:
    """The recording to fit and the one to judge by."""
    fit, held = (read_recording(folder / name, parse_map(MAPS)) for name in FILES)
    return fit, held


def axis_without(fit: Recording, case: Case) -> Rig:
    """The axis as `identify --one-inertia --asymmetric` finds it, the term set to 0."""
    rig = identify_one_inertia([fit], fit.constant("gtau"), asymmetric=True).rig
    return rig.replace(**dict.fromkeys(case.zero, 0.0))


def diagnosed(fit: Recording, held: Recording, case: Case, most: int = MOST) -> Diagnosis:
    """`drill-env diagnose FIT --holdout HELD --rig axis.toml --doubt 0.5 --most 3`."""
    options = DiagnosisOptions(
        leave_out=case.leave_out, most=most, given_rig=True, doubt=DOUBT,
        fixed=dict.fromkeys(case.fixed, 0.0),
    )  # fmt: skip
    return diagnose([fit], axis_without(fit, case), [held], options=options)


def least_squares(fit: Recording, held: Recording, rig: Rig, fixed: tuple[str, ...]) -> list[float]:
    """Force errors (fit, held) of the best model that has the rig's free parameters."""
    free = free_parameters(rig, fixed)
    km = fit.constant("gtau")
    parts = [force_balance(r, km, True, InverseOptions())[:2] for r in (fit, held)]

    def columns(regressors: np.ndarray) -> np.ndarray:
        a, forth, back, plus, minus = regressors.T
        own = {"bu": forth + back, "dbu": forth - back, "Tsu": plus + minus, "dTsu": plus - minus}
        return np.column_stack([a, *(own[name] for name in free if name in own)])

    found = np.linalg.lstsq(columns(parts[0][0]), parts[0][1], rcond=None)[0]
    return [relative_error(force, columns(rows) @ found) for rows, force in parts]


def row_of(fit: Recording, held: Recording, name: str) -> dict:
    """Everything that is told of one case."""
    case, began = CASES[name], time.perf_counter()
    told = diagnosed(fit, held, case)
    result, search = told.result, told.found
    effects = {e.id: e.probability for e in result.effects}
    return {
        "left_out": name,
        "case": asdict(case),
        "verdict": result.verdict,
        "effects": {
            e.id: {
                "probability": e.probability,
                **{k: asdict(n) for k, n in e.parameters.items()},
            }
            for e in result.effects
        },
        "place": 1 + list(effects).index(case.effect) if case.effect in effects else None,
        "in_round": _round_of(told, case.effect),
        "confused_with": [(a.id, a.probability) for a in result.alternatives[:2]],
        "shape": None if result.shape is None else asdict(result.shape),
        "least_squares_without": least_squares(fit, held, axis_without(fit, case), case.fixed),
        "fitted": [
            force_error(fit, search.base, search.base.motions[0]),
            force_error(held, search.base, told.before[0].motion),
        ],
        "found": [
            force_error(fit, search.final, search.final.motions[0]),
            force_error(held, search.final, told.after[0].motion),
        ],
        "rig": {n: getattr(told.rig, n) for n in ("km", "Ju", "Tsu", "dTsu", "bu", "dbu")},
        "seconds": time.perf_counter() - began,
    }


def _round_of(told: Diagnosis, effect: str) -> int | None:
    """The round of the search that was won by an effect."""
    for i, one in enumerate(told.found.rounds):
        if one.named and one.named[0].term.id == effect:
            return i + 1
    return None


def main(
    recordings: Annotated[Path, typer.Option(help="Folder with the two EMPS files.")],
    cases: Annotated[str, typer.Option(help="Comma-separated; all by default.")] = "",
    out: Annotated[Path | None, typer.Option("--json", help="File for all numbers.")] = None,
) -> None:
    """Diagnose the axis without each term, and with all of them."""
    fit, held = read_emps(recordings)
    rows = []
    for name in cases.split(",") if cases else CASES:
        rows.append(row_of(fit, held, name))
        _show(rows[-1])
    table = Table(title="EMPS, one term left out: force errors in %, fit / held out")
    heads = ("left out", "named", "P", "round", "least squares without", "fitted", "found",
             "published, held out")  # fmt: skip
    for head in heads:
        table.add_column(head)
    for row in rows:
        table.add_row(*_cells(row))
    Console(width=140).print(table)
    if out is not None:
        out.write_text(json.dumps(rows, indent=2, default=float) + "\n", encoding="utf-8")


def _show(row: dict) -> None:
    print(f"\n== {row['left_out']} left out: {row['verdict']}, {row['seconds']:.0f} s")
    for name, told in row["effects"].items():
        numbers = ", ".join(
            f"{key} {n['value']:.4g} ({n['low']:.4g} to {n['high']:.4g})"
            for key, n in told.items()
            if isinstance(n, dict)
        )
        print(f"   {name}, probability {told['probability']:.2f}: {numbers}")
    for name, chance in row["confused_with"]:
        print(f"   rival: {name}, probability {chance:.2g}")
    if row["shape"]:
        print(f"   shape over {row['shape']['coordinate']}: {row['shape']['formula']}")
    print("   " + ", ".join(f"{k} {v:.4g}" for k, v in row["rig"].items()), flush=True)


def _cells(row: dict) -> list[str]:
    wanted = row["case"]["effect"]
    named = row["effects"].get(wanted)
    place = "" if row["place"] in (None, 1) else f" (no. {row['place']})"
    leading = next(iter(row["effects"]), "none")
    return [
        row["left_out"],
        f"{wanted}{place}" if named else f"not: {leading}" if wanted else leading,
        f"{named['probability']:.2f}" if named else "",
        str(row["in_round"] or ""),
        *(" / ".join(f"{100 * e:.2f}" for e in row[key])
          for key in ("least_squares_without", "fitted", "found")),
        row["case"]["published"],
    ]  # fmt: skip


if __name__ == "__main__":
    typer.run(main)
