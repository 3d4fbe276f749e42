"""The paper's own discovery, concealed: from Coulomb or Stribeck friction to the hump.

`python -m benchmarks.concealed.discovery --cases DIR --answers DIR --out DIR` diagnoses the cases
that `make --kinds shape:6` made, from the law that each is told, and judges what was found: the
signs of the lower friction's slope, the Hopf point B with its interval, and vibration without
sticking, for which the concealed rig itself is played at a constant voltage.
"""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from rich.progress import track

from benchmarks.concealed.ambiguity import truth_of
from benchmarks.concealed.measures import share
from benchmarks.concealed.plant import play
from benchmarks.concealed.seal import open_answers
from drill_env._documents import plain
from drill_env._errors import InputError
from drill_env._files import make_folder, write_text
from drill_env.cli.diagnose_command import Law, _start
from drill_env.continuation import bifurcation_diagram, hopf_points
from drill_env.diagnosis.diagnose import Diagnosis, diagnose
from drill_env.diagnosis.fit import prior_weight
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.friction import lower_curve_slope
from drill_env.identification.coordinates import Coordinates, inverse
from drill_env.integrator import NegativeFrictionWarning, simulate
from drill_env.parameters import Rig
from drill_env.recordings import read_recording

Array = NDArray[np.float64]
# Beyond it the paper's rig could not go: 5 V.
TO_VOLTS = 5.0
DRAWS = 400
_SPEEDS = np.geomspace(1e-3, 60.0, 4000)
_SETTLE, _WATCH, _RATE = 300.0, 20.0, 200.0


def signs(rig: Rig) -> dict[str, Any]:
    """Signs of the friction's slope over the speed, and the speeds (rad/s) where they change."""
    slope = lower_curve_slope(rig, _SPEEDS)
    changes = np.flatnonzero(slope[:-1] * slope[1:] < 0.0)
    marks = ["+" if slope[i] > 0 else "-" for i in [0, *(changes + 1).tolist()]]
    return {"signs": "".join(marks), "speeds": _SPEEDS[changes].tolist()}


def hopf_b(rig: Rig) -> float | None:
    """Voltage of the first Hopf point, the paper's B."""
    found = hopf_points(rig, TO_VOLTS)
    return found[0].voltage if found else None


def cloud(coordinates: Coordinates, centre: Array, covariance: Array, seed: int) -> list[Rig]:
    """Rigs drawn from a fit's uncertainty; what makes no rig is drawn in vain."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    rng = np.random.default_rng(seed)
    found = []
    for row in centre + rng.standard_normal((DRAWS, len(centre))) @ root.T:
        try:
            found.append(coordinates.rig(row))
        except InputError:
            continue
    return found


def interval(rigs: list[Rig]) -> dict[str, Any]:
    """95 % interval of the Hopf point B, and how many of the rigs have one and have the hump."""
    volts = [v for v in map(hopf_b, rigs) if v is not None]
    low, high = np.quantile(volts, [0.025, 0.975]).tolist() if volts else (math.nan, math.nan)
    humped = sum(signs(rig)["signs"].startswith("+-") for rig in rigs)
    return {"low": low, "high": high, "n": len(rigs), "with_b": len(volts), "humped": humped}


def stick_free(rig: Rig) -> tuple[float, float] | None:
    """Voltages between which the discs vibrate stably and never stop, V."""
    with warnings.catch_warnings():
        # Large cycles reach speeds at which the hump's torque is negative; they are not asked for.
        warnings.simplefilter("ignore", NegativeFrictionWarning)
        diagram = bifurcation_diagram(rig, TO_VOLTS)
    cycles = [point.cycle for branch in diagram.branches for point in branch.points]
    volts = [c.parameter for c in cycles if c.stable and c.character == "slipping"]
    return (min(volts), max(volts)) if volts else None


def vibration(omega: Array) -> dict[str, float]:
    """Least and largest speed of the lower disc once it has settled, and the period (s)."""
    last = omega[-round(_WATCH * _RATE) :]
    above = last > last.mean()
    rises = np.flatnonzero(~above[:-1] & above[1:])
    period = float(np.diff(rises).mean()) / _RATE if len(rises) > 1 else math.nan
    return {"least": float(last.min()), "largest": float(last.max()), "period": period}


def shaken(answer: Mapping[str, Any], found: Rig, volts: float) -> dict[str, Any]:
    """The concealed rig without noise, and the extended one, from rest at a constant voltage."""
    n = round(_SETTLE * _RATE)
    times, u = np.arange(n + 1) / _RATE, np.full(n, volts)
    truth = play(truth_of(answer).parts()[0], u, times).states[:, 3]
    mine = simulate(found, volts, float(times[-2]), t_eval=times[:-1], method="dopri5").omega_l
    out = {"volts": volts, "true": vibration(truth), "found": vibration(mine)}
    for name in ("true", "found"):
        seen = out[name]
        out[f"{name}_stick_free"] = seen["least"] > 0.0 and seen["largest"] > 1.05 * seen["least"]
    return out


def judge(answer: Mapping[str, Any], found: Diagnosis, seed: int) -> dict[str, Any]:
    """Everything that is asked of one case."""
    true, final, setting = Rig(**answer["rig"]), found.found.final, found.found.setting
    free = len(final.vector)
    after = cloud(setting.coordinates, final.vector, inverse(final.information)[:free, :free], seed)
    start = setting.coordinates.vector(setting.coordinates.base)
    # What the start alone would say: the true rigs are drawn around the paper's.
    before = cloud(setting.coordinates, start, np.diag(1.0 / prior_weight(setting, start)), seed)
    b, bounds, range_ = hopf_b(true), interval(after), stick_free(true) or (math.nan, math.nan)
    named = [e.id for e in found.result.effects]
    return {
        "case": answer["case"], "start": answer["public"]["start_friction"],
        "verdict": found.result.verdict, "named": named,
        "probability": found.result.effects[0].probability if named else None,
        "first": named[:1] == ["friction_shape"], "humped": final.rig.friction == "humped",
        "true_signs": signs(true), "found_signs": signs(final.rig),
        "b_true": b, "b_found": hopf_b(final.rig), "b_interval": bounds,
        "b_before": interval(before),
        "covered": b is not None and bounds["low"] <= b <= bounds["high"],
        "true_range": range_, "found_range": stick_free(final.rig),
        "shaken": shaken(answer, found.rig, 0.5 * sum(range_)),
    }  # fmt: skip


def solve(answer: Mapping[str, Any], case: Path, doubt: float, seed: int) -> dict[str, Any]:
    """Diagnose one case from its recordings alone, and judge it."""
    law = json.loads((case / "case.json").read_text(encoding="utf-8"))["start_friction"]
    fit, held = ([read_recording(p) for p in sorted(case.glob(f"{role}-*.csv"))]
                 for role in ("fit", "holdout"))  # fmt: skip
    found = diagnose(fit, _start(None, Law(law)), held, options=DiagnosisOptions(doubt=doubt))
    return judge(answer, found, seed)


def table(rows: list[dict[str, Any]]) -> str:
    """One line a case, and how many of each."""
    heads = ("start", "named", "signs, true: found", "B true", "B found (95 %)",
             "B by the start alone", "stick-free V, true: found", "at V",
             "least to largest rad/s, true: found")  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for r in rows:
        b, p, s = r["b_interval"], r["b_before"], r["shaken"]
        ranges = [f"{x[0]:.3f} to {x[1]:.3f}" if x else "none"
                  for x in (r["true_range"], r["found_range"])]  # fmt: skip
        seen = [f"{s[k]['least']:.3f} to {s[k]['largest']:.3f}" for k in ("true", "found")]
        found = "none" if r["b_found"] is None else (
            f"{r['b_found']:.4f} ({b['low']:.4f} to {b['high']:.4f})")  # fmt: skip
        lines.append(
            f"| {r['start']} | {', '.join(r['named'])} | {r['true_signs']['signs']}: "
            f"{r['found_signs']['signs']} | {r['b_true']:.4f} | {found} | {p['low']:.3f} to "
            f"{p['high']:.3f} | {': '.join(ranges)} | {s['volts']:.2f} | {': '.join(seen)} |"
        )
    for name, hit in (
        ("friction_shape named first", lambda r: r["first"]),
        ("positive, negative, positive", lambda r: r["found_signs"]["signs"] == "+-+"),
        ("Hopf point B within its interval", lambda r: r["covered"]),
        ("vibrates without sticking as the true rig", lambda r: r["shaken"]["true_stick_free"]
         and r["shaken"]["found_stick_free"]),
    ):  # fmt: skip
        part = share(rows, hit)
        lines.append(f"\n{name}: {part['hits']}/{part['n']}")
    return "\n".join(lines)


def main(
    cases: Annotated[Path, typer.Option(help="Folder of the cases.")],
    answers: Annotated[Path, typer.Option(help="Folder of the sealed answers.")],
    out: Annotated[Path, typer.Option(help="Folder of the results; what is done stays.")],
    doubt: Annotated[float, typer.Option(help="As of `drill-env diagnose`.")] = 0.05,
    seed: Annotated[int, typer.Option(help="Of the drawn intervals.")] = 0,
) -> None:
    """Diagnose and judge the cases that are not done yet, and print the table."""
    try:
        told = [a for a in open_answers(answers).values() if a["kind"] == "shape"]
        make_folder(out)
        rows = []
        for answer in track(told, "cases", transient=True):
            path = out / f"{answer['case']}.json"
            if not path.exists():
                row = solve(answer, cases / answer["case"], doubt, seed)
                write_text(path, json.dumps(plain(row), indent=1) + "\n")
            rows.append(json.loads(path.read_text(encoding="utf-8")))
    except InputError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from error
    write_text(out / "discovery.json", json.dumps({"schema": 1, "cases": rows}, indent=1) + "\n")
    print(f"{len(rows)} cases\n\n{table(rows)}")


if __name__ == "__main__":
    typer.run(main)
