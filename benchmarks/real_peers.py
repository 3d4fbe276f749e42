"""Three models of real axes, scored in the windows of the diagnosis and of a yardstick.

python -m benchmarks.real_peers --recordings ../shared/recordings \
    --yardstick ../shared/design/window_score.py

The diagnosis, a yardstick (one file that fits by simulated windows) and plain least squares of the
torque balance each make a model of the same recordings. Every model then predicts recordings that
were not fitted, twice: by the yardstick's own code in its own windows, begun from its own starts,
which favours it, and by the package in the windows of the diagnosis, with the delay of the drive
that this found, which favours that. Least squares is given the terms that the machine has.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from benchmarks.peer_models import least_squares, numbers_of, rig_of, searched, yardstick_of
from benchmarks.real_rigs import MACHINES
from drill_env.diagnosis.by_prediction import PredictionDiagnosis
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.parameters import Rig


@dataclass(frozen=True)
class Peered:
    """An axis that both know.

    Attributes:
        machine: as in `benchmarks.real_rigs`.
        terms: that least squares is given.
    """

    machine: str
    terms: tuple[str, ...]


_FULL = ("J", "B", "C", "O")
AXES = {
    "xl330": Peered("servo with a weight", ("J", "B", "C", "Ws", "Wc")),
    "arm1": Peered("arm, joint 1", ("J", "B", "C", "Kx")),
    "arm2": Peered("arm, joint 2", ("J", "B", "C", "Kx")),
    "emps without Coulomb": Peered("EMPS without Coulomb friction", _FULL),
    "emps without offset": Peered("EMPS without offset", _FULL),
    "emps without viscous": Peered("EMPS without viscous friction", _FULL),
}


def diagnosed(machine: str, root: Path) -> PredictionDiagnosis:
    """The diagnosis of an axis, or of the driven disc of a machine with a string."""
    told = MACHINES[machine]
    fit, held, rig = told.read(root)
    options = DiagnosisOptions(given_rig=True, doubt=told.doubt)
    found = diagnose(fit, rig, held, options=options)
    if not isinstance(found, PredictionDiagnosis):
        raise typer.BadParameter(f"{machine}: not diagnosed by windows; leave it out")
    return found


def in_own_windows(rig: Rig | None, found: PredictionDiagnosis) -> list[float]:
    """Root mean square errors of a rig at each lead of the diagnosis; nothing without a rig."""
    if rig is None:
        return []
    shift = float(found.after.vector[-1])
    errors = np.concatenate([cut.errors(rig, shift) for cut in found.fold.unseen])
    return [float(x) for x in np.sqrt(np.mean(errors[..., 0] ** 2, axis=0))]


def row_of(name: str, axis: Any, module: ModuleType, root: Path) -> dict[str, Any]:
    """Errors of the models at each lead, in the windows of the yardstick and of the diagnosis."""
    peered, place, neutral = AXES[name], module.I, module.NEUTRAL
    recordings = list({id(w[0]): w[:4] for w in axis.fit_windows}.values())
    given, km = axis.base.copy(), axis.start["km"]
    named, best = searched(axis)
    found = diagnosed(peered.machine, root)
    models = {
        "as given": given,
        "diagnosis": numbers_of(found, km, neutral, place),
        "yardstick": best,
        "least squares": least_squares(recordings, km, peered.terms, neutral, place),
    }
    rigs = {who: rig_of(model, found, km, neutral, place) for who, model in models.items()}
    errors = {
        who: [float(np.sqrt(np.mean(axis.at(numbers, axis.hold_windows, lead) ** 2)))
              for lead in axis.leads]
        for who, numbers in models.items()
    }  # fmt: skip
    return {
        "axis": name, "yardstick_names": named, "leads_s": [float(x) for x in axis.leads],
        "errors": errors, "windows": len(axis.hold_windows),
        "own_leads_s": found.leads.tolist(),
        "own_errors": {who: in_own_windows(rig, found) for who, rig in rigs.items()},
        "numbers": {
            who: {n: float(x) for n, x, z in zip(place, model, neutral, strict=True) if x != z}
            for who, model in models.items()
        },
    }  # fmt: skip


def main(
    recordings: Annotated[Path, typer.Option(help="Folder with the recordings.")],
    yardstick: Annotated[Path, typer.Option(help="The yardstick's file.")],
    only: Annotated[list[str] | None, typer.Option(help="Axes; all by default.")] = None,
    json_out: Annotated[Path | None, typer.Option("--json", help="Where rows go.")] = None,
) -> None:
    """Fit every axis three times and print the errors of predictions of unseen recordings."""
    module = yardstick_of(yardstick)
    table = Table(
        "axis", "windows of", "lead", "as given", "diagnosis", "yardstick", "least squares",
        "to the best",
    )  # fmt: skip
    rows = []
    for title, make in module.sets():
        name = title.split(" (")[0]
        if name not in AXES or (only and name not in only):
            continue
        rows.append(row := row_of(name, make(), module, recordings))
        for whose, leads, errors in (
            ("yardstick", row["leads_s"], row["errors"]),
            ("diagnosis", row["own_leads_s"], row["own_errors"]),
        ):
            last = {who: told[-1] if told else math.inf for who, told in errors.items()}
            best = min(last["yardstick"], last["least squares"])
            table.add_row(
                name, whose, f"{leads[-1]:.2g} s", *(f"{x:.3g}" for x in last.values()),
                f"{last['diagnosis'] / best:.2f}",
            )  # fmt: skip
        if json_out is not None:
            json_out.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    Console(width=120).print(table)


if __name__ == "__main__":
    typer.run(main)
