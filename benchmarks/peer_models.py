"""Models of axes by a yardstick and by plain least squares, and the same as rigs."""

from __future__ import annotations

import contextlib
import importlib.util
import io
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import typer
from scipy.signal import savgol_filter

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.diagnosis.by_prediction import PredictionDiagnosis
from drill_env.parameters import Rig

# Savitzky and Golay's parabola over this many seconds gives speeds and accelerations.
_SMOOTHED = 0.05
# Rows below this share of the highest speed may be at rest, where friction is no sign.
_MOVING = 0.02


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


def moved_zero(found: PredictionDiagnosis) -> float:
    """How far the diagnosis moved the other end: to where the string is not twisted, rad."""
    cut = found.fold.setting.cuts[0]
    if cut.lower is None:
        return 0.0
    return float(np.nanmedian(cut.lower - cut.samples.recording.channel("theta_l")))


def numbers_of(
    found: PredictionDiagnosis, km: float, neutral: FloatArray, place: dict[str, int]
) -> FloatArray:
    """The rig that the diagnosis makes, in the yardstick's order.

    It is the one that had not seen the recordings that judge. Its drive may have been read in
    another unit: what `km` is there tells.
    """
    numbers = in_yardsticks(found.after.rig, neutral, place)
    numbers[place["km"]] *= km / found.start.km
    numbers[place["O"]] -= numbers[place["Kx"]] * moved_zero(found)
    return numbers


def rig_of(
    numbers: FloatArray, found: PredictionDiagnosis, km: float, neutral: FloatArray,
    place: dict[str, int],
) -> Rig | None:  # fmt: skip
    """A model of the yardstick's as a rig; None of a negative stiffness or of other effects."""
    told = {n: float(numbers[i]) for n, i in place.items() if numbers[i] != neutral[i]}
    own = {n: told.pop(n, 0.0) for n in ("km", "J", "B", "C", "O", "Ba", "Kx")}
    sine, cosine, load = (told.pop(n, 0.0) for n in ("Ws", "Wc", "LU"))
    if told:
        return None
    weight = {"torque": float(np.hypot(sine, cosine)), "phase": float(np.arctan2(sine, -cosine))}
    effects = [{"id": "upper_unbalance", **weight}] if weight["torque"] else []
    offset = own["O"] + own["Kx"] * moved_zero(found)
    effects += [{"id": "upper_offset", "torque": offset}] if offset else []
    effects += [{"id": "upper_load_friction", "coefficient": load}] if load else []
    try:
        rig = found.start.replace(
            km=own["km"] * found.start.km / km, Ju=own["J"], bu=own["B"], Tsu=own["C"],
            dTsu=0.0, dbu=own["Ba"], effects=effects,
        )  # fmt: skip
        return rig.replace(ktheta=own["Kx"]) if rig.inertias == 2 else rig
    except InputError:
        return None


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
