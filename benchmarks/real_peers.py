"""Three models of real axes, each scored in the windows of one of the other two.

python -m benchmarks.real_peers --recordings ../shared/recordings \
    --yardstick ../shared/design/window_score.py

The diagnosis, a yardstick (one file that fits by simulated windows) and plain least squares of the
torque balance each make a model of the same recordings. Every model is then simulated by the
yardstick's own code in its own windows of recordings that were not fitted, begun from its own
starts: that favours it. Least squares is given the terms that the machine has.
"""

from __future__ import annotations

import contextlib
import importlib.util
import io
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.table import Table
from scipy.signal import savgol_filter

from benchmarks.real_rigs import MACHINES
from drill_env._types import FloatArray
from drill_env.diagnosis.by_prediction import PredictionDiagnosis
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.parameters import Rig

# Savitzky and Golay's parabola over this many seconds gives speeds and accelerations.
_SMOOTHED = 0.05
# Rows below this share of the highest speed may be at rest, where friction is no sign.
_MOVING = 0.02


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


def yardstick_of(path: Path) -> ModuleType:
    """The yardstick's module."""
    spec = importlib.util.spec_from_file_location("yardstick", path)
    if spec is None or spec.loader is None or not path.exists():
        raise typer.BadParameter(f"{path}: no Python file; give the yardstick's")
    module = importlib.util.module_from_spec(spec)
    sys.modules["yardstick"] = module
    spec.loader.exec_module(module)
    return module


def searched(axis: Any) -> tuple[list[str], FloatArray]:
    """What the yardstick names, and its numbers with all of it."""
    last: list[FloatArray] = []
    noise = axis.noise

    def kept(numbers: FloatArray) -> None:
        # The scale of errors is found anew for each model that is taken, the last one last.
        last.append(numbers)
        noise(numbers)

    axis.noise = kept
    with contextlib.redirect_stdout(io.StringIO()):
        named = axis.search()
    return named, last[-1]


def diagnosed(
    machine: str, root: Path, km: float, neutral: FloatArray, place: dict[str, int]
) -> FloatArray:
    """The numbers of the rig that the diagnosis makes, in the yardstick's order.

    It is the one that had not seen the recordings that judge. Its drive may have been read in
    another unit: what `km` is there tells.
    """
    told = MACHINES[machine]
    fit, held, rig = told.read(root)
    options = DiagnosisOptions(given_rig=True, doubt=told.doubt)
    found = diagnose(fit, rig, held, options=options)
    ended = found.after.rig if isinstance(found, PredictionDiagnosis) else found.rig
    numbers = in_yardsticks(ended, neutral, place)
    numbers[place["km"]] *= km / rig.km
    if isinstance(found, PredictionDiagnosis) and rig.inertias == 2:
        # The diagnosis counts the other end from where the string is not twisted.
        cut = found.fold.setting.cuts[0]
        moved = np.nanmedian(cut.lower - cut.samples.recording.channel("theta_l"))
        numbers[place["O"]] -= numbers[place["Kx"]] * moved
    return numbers


def in_yardsticks(rig: Rig, neutral: FloatArray, place: dict[str, int]) -> FloatArray:
    """A rig of one inertia, or the driven disc of one with a string, in the yardstick's order."""
    numbers = neutral.copy()
    own = {"km": rig.km, "J": rig.Ju, "B": rig.bu, "C": rig.Tsu, "O": rig.dTsu, "Ba": rig.dbu}
    if rig.inertias == 2:
        own["Kx"] = rig.ktheta
    for effect in rig.effects:
        for name, size in _terms(effect).items():
            own[name] = own.get(name, 0.0) + size
    for name, size in own.items():
        numbers[place[name]] = size
    return numbers


def _terms(effect: Any) -> dict[str, float]:
    match effect["id"]:
        case "upper_coulomb":
            return {"C": effect["torque"]}
        case "upper_offset":
            return {"O": effect["torque"]}
        case "upper_viscous":
            return {"B": effect["damping"]}
        case "upper_load_friction":
            return {"LU": effect["coefficient"]}
        case "upper_unbalance":
            # torque cos(theta + phase) is minus the yardstick's Ws sin + Wc cos.
            size, phase = effect["torque"], effect["phase"]
            return {"Ws": size * np.sin(phase), "Wc": -size * np.cos(phase)}
        case other:
            raise typer.BadParameter(f"{other}: the yardstick cannot simulate it; leave it out")


def least_squares(
    recordings: Any, km: float, terms: tuple[str, ...], neutral: FloatArray, place: dict[str, int]
) -> FloatArray:
    """The torque balance solved for its terms, the motor's constant given."""
    rows, drives = [], []
    for t, u, angle, other in recordings:
        dt = float(np.median(np.diff(t)))
        even = np.arange(t[0], t[-1], dt)
        width = max(int(_SMOOTHED / dt) // 2 * 2 + 1, 5)
        read = np.interp(even, t, angle)
        w, a = (savgol_filter(read, width, 2, deriv=d, delta=dt) for d in (1, 2))
        # All of the balance goes through the same filter (Janot's rule for such fits).
        drive = savgol_filter(km * np.interp(even, t, u), width, 2)
        parts = {
            "J": a, "B": w, "C": np.sign(w), "O": np.ones_like(w), "Ws": np.sin(read),
            "Wc": np.cos(read), "Kx": -savgol_filter(np.interp(even, t, other), width, 2),
        }  # fmt: skip
        moving = np.abs(w) > _MOVING * np.abs(w).max()
        rows.append(np.column_stack([parts[name] for name in terms])[moving])
        drives.append(drive[moving])
    found = np.linalg.lstsq(np.concatenate(rows), np.concatenate(drives))[0]
    numbers = neutral.copy()
    numbers[place["km"]] = km
    for name, size in zip(terms, found, strict=True):
        numbers[place[name]] = size
    return numbers


def row_of(name: str, axis: Any, module: ModuleType, root: Path) -> dict[str, Any]:
    """Errors of the three models at the longest lead, and at all of them."""
    peered, place, neutral = AXES[name], module.I, module.NEUTRAL
    recordings = list({id(w[0]): w[:4] for w in axis.fit_windows}.values())
    given = axis.base.copy()
    named, best = searched(axis)
    models = {
        "as given": given,
        "diagnosis": diagnosed(peered.machine, root, axis.start["km"], neutral, place),
        "yardstick": best,
        "least squares": least_squares(
            recordings, axis.start["km"], peered.terms, neutral, place
        ),
    }  # fmt: skip
    errors = {
        who: [float(np.sqrt(np.mean(axis.at(numbers, axis.hold_windows, lead) ** 2)))
              for lead in axis.leads]
        for who, numbers in models.items()
    }  # fmt: skip
    return {
        "axis": name, "yardstick_names": named, "leads_s": [float(x) for x in axis.leads],
        "errors": errors, "windows": len(axis.hold_windows),
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
        "axis", "lead", "as given", "diagnosis", "yardstick", "least squares", "to the best"
    )
    rows = []
    for title, make in module.sets():
        name = title.split(" (")[0]
        if name not in AXES or (only and name not in only):
            continue
        rows.append(row := row_of(name, make(), module, recordings))
        last = {who: told[-1] for who, told in row["errors"].items()}
        best = min(last["yardstick"], last["least squares"])
        table.add_row(
            name, f"{row['leads_s'][-1]:.2g} s", *(f"{x:.3g}" for x in last.values()),
            f"{last['diagnosis'] / best:.2f}",
        )  # fmt: skip
        if json_out is not None:
            json_out.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    Console(width=120).print(table)


if __name__ == "__main__":
    typer.run(main)
