"""A Gaussian process of what a rig's equations leave over, beside the diagnosis.

`python -m benchmarks.concealed.discrepancy --cases DIR --answers DIR --reports DIR --out FILE`.
After Kennedy and O'Hagan, J. R. Stat. Soc. B 63 (2001): torque = rig's terms + discrepancy + noise.
Angles are smoothed and differentiated by Savitzky and Golay. Of each disc's equation of motion the
rig's terms have sizes of their own, found together with a discrepancy over one coordinate. The
coordinate is told that leaves the least on the held-out recordings, if it leaves less than none
does. A process names no law, so components and coordinates are compared: of single effects, of
laws that differ from the library's, and silence where nothing is missing.
"""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.progress import track
from scipy.linalg import cho_factor, cho_solve
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, Kernel, WhiteKernel
from threadpoolctl import threadpool_limits

from benchmarks.concealed.marks import mark
from benchmarks.concealed.seal import open_answers
from benchmarks.concealed.smoothed import Array, Columns, motion
from drill_env._errors import InputError
from drill_env._files import write_text
from drill_env.cli._common import output_file
from drill_env.parameters import Rig
from drill_env.recordings import read_recording

KINDS = ("single", "differ", "null")
# About the spread of each in the recordings; of angles, the cosine and the sine are taken.
SCALES = {"voltage": 3.0, "omega_u": 5.0, "omega_l": 5.0, "twist": 0.5, "theta_u": 1.0,
          "theta_l": 1.0, "time": 15.0}  # fmt: skip
# Rows from which the kernel's numbers are found, and those that the process then knows.
_KERNEL_ROWS, _ROWS = 400, 2000
# Held-out rows are compared in blocks that are long beside the smoothing.
_BLOCK_S, _LEAST_BLOCKS, _Z = 5.0, 6, 3.0
_APART = 1e3


@dataclass(frozen=True)
class Equation:
    """One disc's over n rows: rad/s^2, terms of the rig (n, k), the process's inputs by coordinate.

    Rows also have the numbers of their recording and of their block of time.
    """

    y: Array
    terms: Array
    inputs: Mapping[str, Array]
    recording: np.ndarray
    block: np.ndarray


def _terms(x: Columns, disc: str) -> list[Array]:
    """Columns of the rig in the equation of the upper disc, "u", or of the lower one."""
    twist = x["theta_u"] - x["theta_l"]
    if disc == "u":
        w = x["omega_u"]
        return [x["u_felt"], twist, np.sign(w), w, np.abs(w)]
    rig, v = Rig.paper(), x["omega_l"]
    found = [twist, np.sign(v), v]
    for beta in (rig.beta1, rig.beta2):
        # Another steepness than the paper's, to first order.
        found += [np.tanh(0.5 * beta * v), v / np.cosh(0.5 * beta * v) ** 2]
    return found


def _inputs(x: Columns, disc: str) -> dict[str, Array]:
    """What the discrepancy may depend on; it is another function in each direction of the disc."""
    direction = _APART * np.sign(x[f"omega_{disc}"])
    known = {**x, "voltage": x["u"], "time": x["t"], "twist": x["theta_u"] - x["theta_l"]}
    parts = {name: [known[name] / scale] for name, scale in SCALES.items()}
    for name in ("theta_u", "theta_l"):
        parts[name] = [np.cos(x[name]), np.sin(x[name])]
    return {name: np.column_stack([*columns, direction]) for name, columns in parts.items()}


def equations(paths: Sequence[Path], window: float) -> dict[str, Equation]:
    """Both discs' equations over some recordings."""
    parts = [motion(read_recording(path), window) for path in paths]
    x = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    recording = np.repeat(np.arange(len(parts)), [len(part["t"]) for part in parts])
    block = 1000 * recording + (x["t"] // _BLOCK_S).astype(int)
    return {
        disc: Equation(x[f"alpha_{disc}"], np.column_stack(_terms(x, disc)), _inputs(x, disc),
                       recording, block)
        for disc in ("u", "l")
    }  # fmt: skip


def centred(values: Array, recording: np.ndarray) -> Array:
    """Less the mean of each recording: each time anew, encoders are zeroed where discs stood."""
    found = values.copy()
    for one in np.unique(recording):
        rows = recording == one
        found[rows] -= values[rows].mean(axis=0)
    return found


def left_over(fit: Equation, held: Equation, coordinate: str | None) -> Array:
    """What is left of the held-out acceleration, rad/s^2, with a discrepancy or without one."""
    rows = np.unique(np.linspace(0, len(fit.y) - 1, _ROWS).astype(int))
    levels = (fit.recording[rows, None] == np.unique(fit.recording)).astype(float)
    base = np.column_stack([fit.terms[rows], levels])
    y = fit.y[rows]
    sizes = np.linalg.lstsq(base, y)[0]
    told = np.zeros(len(held.y))
    if coordinate is not None:
        points, scale = fit.inputs[coordinate][rows], float(np.std(y - base @ sizes))
        kernel = _kernel(points, (y - base @ sizes) / scale)
        factor = cho_factor(kernel(points))
        # The rig's sizes and the discrepancy together, given the kernel: generalised least squares.
        pull = cho_solve(factor, base)
        sizes = np.linalg.lstsq(base.T @ pull, pull.T @ y)[0]
        told = kernel(held.inputs[coordinate], points) @ cho_solve(factor, y - base @ sizes)
    return centred(held.y - held.terms @ sizes[: held.terms.shape[1]] - told, held.recording)


def _kernel(points: Array, left: Array) -> Kernel:
    """The most likely kernel of what is left, of variance 1."""
    few = np.unique(np.linspace(0, len(left) - 1, _KERNEL_ROWS).astype(int))
    start = ConstantKernel(0.3, (1e-4, 1e2)) * RBF(1.0, (0.1, 10.0)) + WhiteKernel(0.7, (1e-3, 3))
    with warnings.catch_warnings():
        # A process that is not needed runs to the ends of its ranges.
        warnings.simplefilter("ignore", ConvergenceWarning)
        return GaussianProcessRegressor(start).fit(points[few], left[few]).kernel_


def gain(before: Array, after: Array, block: np.ndarray) -> tuple[float, float]:
    """By how much the logarithm of the mean square falls, a block in the mean, and z of it."""
    blocks = np.unique(block)
    if len(blocks) < _LEAST_BLOCKS:
        return 0.0, 0.0
    drops = np.log([np.mean(before[block == b] ** 2) / np.mean(after[block == b] ** 2)
                    for b in blocks])  # fmt: skip
    z = drops.mean() / (np.std(drops, ddof=1) / math.sqrt(len(blocks)))
    return float(drops.mean()), float(z)


def told(case: Path, window: float) -> dict[str, Any]:
    """Component and coordinate of the discrepancy that is needed; both None without one."""
    # The matrices are small: threads of the linear algebra would only wait for each other.
    with threadpool_limits(1):
        fit, held = (equations(sorted(case.glob(f"{role}-*.csv")), window)
                     for role in ("fit", "holdout"))  # fmt: skip
        found: dict[tuple[str, str], float] = {}
        for disc in ("u", "l"):
            before = left_over(fit[disc], held[disc], None)
            for name in SCALES:
                after = left_over(fit[disc], held[disc], name)
                size, z = gain(before, after, held[disc].block)
                if z > _Z:
                    found[disc, name] = size
    if not found:
        return {"component": None, "coordinate": None, "gains": {}}
    disc, name = max(found, key=lambda key: found[key])
    component = {"u": "upper", "l": "lower"}[disc]
    if name == "twist" and {("u", "twist"), ("l", "twist")} <= set(found):
        component = "string"
    elif (disc, name) == ("u", "voltage"):
        component = "actuator"
    gains = {" ".join(key): value for key, value in found.items()}
    return {"component": component, "coordinate": name, "gains": gains}


def beside(answer: Mapping[str, Any], found: Mapping[str, Any], report: Path) -> dict[str, Any]:
    """One case by the process, and by the diagnosis where there is one."""
    truth = (answer["effects"] or [{"id": "nothing", "component": None, "depends_on": [None]}])[0]
    row = {"case": answer["case"], "kind": answer["kind"], "truth": truth["id"], **found,
           "component_right": found["component"] == truth["component"],
           "coordinate_right": found["coordinate"] in truth["depends_on"],
           "ours_component_right": None, "ours_coordinate_right": None}  # fmt: skip
    if not report.exists():
        return row
    marks = mark(answer, json.loads(report.read_text(encoding="utf-8")))
    quiet = not answer["effects"] and not marks["alarm"]
    return {**row, "ours_component_right": marks["component"] or quiet,
            "ours_coordinate_right": marks["coordinate"] or quiet}  # fmt: skip


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Kind by kind; of nulls, silence is right."""
    lines = ["| concealed | process: component | coordinate | diagnosis: component | coordinate |",
             "|---" * 5 + "|"]  # fmt: skip
    for kind in KINDS:
        cells = []
        for key in ("component", "coordinate", "ours_component", "ours_coordinate"):
            marks = [r[f"{key}_right"] for r in rows if r["kind"] == kind]
            known = [m for m in marks if m is not None]
            cells.append(f"{sum(known)}/{len(known)}" if known else "")
        lines.append(f"| {kind} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main(
    cases: Annotated[Path, typer.Option(help="Folder of the cases.")],
    answers: Annotated[Path, typer.Option(help="Folder of the sealed answers.")],
    out: Annotated[Path, typer.Option(help="JSON to write.")],
    reports: Annotated[Path | None, typer.Option(help="Folder of the diagnoses.")] = None,
    window: Annotated[float, typer.Option(help="Of the smoothing, s.")] = 0.5,
) -> None:
    """Let a Gaussian process find where something is missing, and print the table of both."""
    rows = []
    try:
        output_file(out)
        for answer in track(list(open_answers(answers).values()), "cases", transient=True):
            if answer["kind"] in KINDS:
                found = told(cases / answer["case"], window)
                report = (reports or cases) / answer["case"] / "diagnosis.json"
                rows.append(beside(answer, found, report))
        write_text(out, json.dumps({"schema": 1, "cases": rows}, indent=1) + "\n")
    except InputError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from error
    print(f"{len(rows)} cases\n\n{table(rows)}")


if __name__ == "__main__":
    typer.run(main)
