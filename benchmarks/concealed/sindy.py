"""PySINDy beside the diagnosis, on the same recordings and with the true hump given.

`python -m benchmarks.concealed.sindy --cases DIR --answers DIR --reports DIR --out FILE`. Angles
are smoothed and differentiated by Savitzky and Golay. Of each disc's equation of motion the terms
of the rig are given; PySINDy's STLSQ chooses among twelve effects that are linear in their size,
and the held-out recordings choose its threshold. Of single cases, where the effect is another one,
and of nulls it should name nothing; of a law that differs from the library's, a sibling. `--paper`
gives it no more than the diagnosis starts from.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from pysindy import STLSQ
from rich.progress import track
from threadpoolctl import threadpool_limits

from benchmarks.concealed.marks import mark
from benchmarks.concealed.seal import open_answers
from benchmarks.concealed.smoothed import Array, Columns, motion
from drill_env._errors import InputError
from drill_env._files import write_text
from drill_env.cli._common import output_file
from drill_env.friction import lower_curve
from drill_env.parameters import Rig
from drill_env.recordings import read_recording

THRESHOLDS = (0.0, *np.geomspace(3e-3, 1.0, 25))
EFFECTS = (
    "gain_asymmetry", "upper_quadratic_drag", "load_dependent_friction", "gear_eccentricity",
    "string_hardening", "string_damping", "string_asymmetry", "lower_asymmetry", "quadratic_drag",
    "unbalance", "brake_runout", "friction_drift",
)  # fmt: skip


def terms(x: Mapping[str, Array], rig: Rig, exact: bool) -> list[tuple[Array, Array, Columns]]:
    """Acceleration, terms of the rig and candidates, of the upper disc and of the lower one.

    The rig's friction is given, as a whole if it is `exact`; else its parts have their own sizes.
    """
    w, v, angle, twist = x["omega_u"], x["omega_l"], x["theta_l"], x["theta_u"] - x["theta_l"]
    string = {"string_hardening": twist**3, "string_damping": w - v,
              "string_asymmetry": np.abs(twist)}  # fmt: skip
    upper = {
        "gain_asymmetry": np.abs(x["u"]), "upper_quadratic_drag": w * np.abs(w),
        "load_dependent_friction": np.sign(w) * np.abs(twist),
        "gear_eccentricity cos": x["u"] * np.cos(x["theta_u"]),
        "gear_eccentricity sin": x["u"] * np.sin(x["theta_u"]), **string,
    }  # fmt: skip
    torque = lower_curve(rig, np.abs(v))
    brake = np.sign(v) * torque
    lower = {
        "lower_asymmetry": torque, "quadratic_drag": v * np.abs(v), "unbalance cos": np.cos(angle),
        "unbalance sin": np.sin(angle), "brake_runout cos": brake * np.cos(angle),
        "brake_runout sin": brake * np.sin(angle), "friction_drift": brake * x["t"], **string,
    }  # fmt: skip
    parts = [np.sign(v), np.tanh(0.5 * rig.beta1 * v), np.tanh(0.5 * rig.beta2 * v), v]
    above = np.column_stack([x["u"], twist, np.sign(w), w, np.abs(w)])
    below = np.column_stack([twist, brake] if exact else [twist, *parts])
    return [(x["alpha_u"], above, upper), (x["alpha_l"], below, lower)]


def equations(paths: Sequence[Path], rig: Rig, exact: bool, window: float) -> list[Columns]:
    """Columns of both equations over some recordings: acceleration, given terms, candidates."""
    parts = [terms(motion(read_recording(path), window), rig, exact) for path in paths]
    found = []
    for disc in zip(*parts, strict=True):
        names = ["", *(f"given {i}" for i in range(disc[0][1].shape[1])), *disc[0][2]]
        whole = [np.column_stack([y, base, *extra.values()]) for y, base, extra in disc]
        # Encoders are zeroed where the discs stood: each recording has a twist of its own to start.
        level = np.concatenate([part - part.mean(axis=0) for part in whole])
        found.append(dict(zip(names, level.T, strict=True)))
    return found


def chosen(fit: Columns, held: Columns, sparser: float) -> dict[str, float]:
    """Effects that PySINDy keeps: their size against what is left over, both root mean square.

    The largest threshold is taken whose held-out error is at most `sparser` times the least.
    """
    given = [name for name in fit if name.startswith("given")]
    names = [name for name in fit if name and name not in given]
    whole, whole_held = (np.column_stack([x[n] for n in ("", *names)]) for x in (fit, held))
    base, base_held = (np.column_stack([x[n] for n in given]) for x in (fit, held))
    # The given terms are never thresholded: what they explain is taken out of all else first.
    by_given = np.linalg.lstsq(base, whole)[0]
    whole, whole_held = whole - base @ by_given, whole_held - base_held @ by_given
    y, extra, size = whole[:, 0], whole[:, 1:], np.sqrt(np.mean(whole**2, axis=0))
    largest = np.abs(np.linalg.lstsq(extra / size[1:], y / size[0])[0]).max()
    tried = []
    for threshold in THRESHOLDS:
        kept = np.zeros(len(names))
        if threshold < largest:
            model = STLSQ(threshold=threshold).fit(extra / size[1:], y / size[0])
            kept = size[0] * model.coef_[0] / size[1:]
        error = float(np.mean((whole_held[:, 0] - whole_held[:, 1:] @ kept) ** 2))
        tried.append((error, threshold, kept))
    least = min(error for error, _, _ in tried)
    kept = max((t for t in tried if t[0] <= sparser * least), key=lambda t: t[1])[2]
    left = float(np.sqrt(np.mean((y - extra @ kept) ** 2)))
    amounts: dict[str, Array] = {}
    for i, name in enumerate(names):
        effect = name.split()[0]
        amounts[effect] = amounts.get(effect, np.zeros_like(y)) + kept[i] * extra[:, i]
    sizes = {name: float(np.sqrt(np.mean(a**2))) / left for name, a in amounts.items()}
    return {name: value for name, value in sizes.items() if value > 0.0}


def sparse(case: Path, rig: Rig, exact: bool, window: float, sparser: float) -> dict[str, float]:
    """Effects of a case by PySINDy with their sizes, the largest first."""
    # The matrices are small: threads of the linear algebra would only wait for each other.
    with warnings.catch_warnings(), threadpool_limits(1):
        # Lost rows, and thresholds that leave nothing.
        warnings.simplefilter("ignore", UserWarning)
        fit, held = (equations(sorted(case.glob(f"{role}-*.csv")), rig, exact, window)
                     for role in ("fit", "holdout"))  # fmt: skip
        sizes: dict[str, float] = {}
        for disc in zip(fit, held, strict=True):
            for name, value in chosen(*disc, sparser).items():
                sizes[name] = max(value, sizes.get(name, 0.0))
    return dict(sorted(sizes.items(), key=lambda item: -item[1]))


def beside(answer: Mapping[str, Any], named: Mapping[str, float], report: Path) -> dict[str, Any]:
    """One case by PySINDy, and by the diagnosis where there is one; a sibling's name is right."""
    wanted = sorted({name for e in answer["effects"] for name in e.get("siblings", [e["id"]])})
    right = [name for name in wanted if name in EFFECTS]
    first, any_right = list(named)[:1], bool(named) == bool(right)
    row = {"case": answer["case"], "truth": next(iter([*right, *wanted]), "nothing"),
           "sindy": named, "sindy_first": any_right and set(first) <= set(right),
           "sindy_exact": any_right and set(named) <= set(right), "ours": None,
           "ours_first": None, "ours_exact": None}  # fmt: skip
    if not report.exists():
        return row
    marks = mark(answer, json.loads(report.read_text(encoding="utf-8")))
    exact = marks["both"] and not marks["surplus"] if wanted else not marks["alarm"]
    first = marks["first"] if wanted else exact
    return {**row, "ours": marks["said"], "ours_first": first, "ours_exact": exact}


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Effect by effect, and both over the cases that both were given."""
    lines = [
        "| concealed | PySINDy: largest | exact | diagnosis: first | exact |",
        "|---" * 5 + "|",
    ]
    groups = {name: [r for r in rows if r["truth"] == name] for name in (*EFFECTS, "nothing")}
    twelve = [r for r in rows if r["truth"] in EFFECTS]
    groups["another effect"] = [r for r in rows if r["truth"] not in groups]
    groups["all twelve"] = twelve
    groups["of these, diagnosed"] = [r for r in twelve if r["ours"] is not None]
    for name, group in groups.items():
        cells = []
        for key in ("sindy_first", "sindy_exact", "ours_first", "ours_exact"):
            told = [r[key] for r in group if r[key] is not None]
            cells.append(f"{sum(told)}/{len(told)}" if told else "")
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main(
    cases: Annotated[Path, typer.Option(help="Folder of the cases.")],
    answers: Annotated[Path, typer.Option(help="Folder of the sealed answers.")],
    out: Annotated[Path, typer.Option(help="JSON to write.")],
    reports: Annotated[Path | None, typer.Option(help="Folder of the diagnoses.")] = None,
    paper: Annotated[bool, typer.Option(help="Give the paper's hump, not the true one.")] = False,
    window: Annotated[float, typer.Option(help="Of the smoothing, s.")] = 0.5,
    sparser: Annotated[float, typer.Option(help="Error that sparseness may cost.")] = 1.03,
) -> None:
    """Let PySINDy find the effects, and print the table of both."""
    rows = []
    try:
        output_file(out)
        for answer in track(list(open_answers(answers).values()), "cases", transient=True):
            if answer["kind"] not in ("single", "null", "differ"):
                continue
            rig = Rig.paper() if paper else Rig(**answer["rig"])
            named = sparse(cases / answer["case"], rig, not paper, window, sparser)
            report = (reports or cases) / answer["case"] / "diagnosis.json"
            rows.append(beside(answer, named, report))
        write_text(out, json.dumps({"schema": 1, "paper": paper, "cases": rows}, indent=1) + "\n")
    except InputError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from error
    print(f"{len(rows)} cases\n\n{table(rows)}")


if __name__ == "__main__":
    typer.run(main)
