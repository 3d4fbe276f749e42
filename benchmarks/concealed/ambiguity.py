"""An ambiguity settled by the one recording that the diagnosis asks for.

`python -m benchmarks.concealed.ambiguity --cases DIR --answers DIR --reports DIR --out DIR`. Of the
single cases that `run` has diagnosed, those are taken where a rival of the truth is not far behind
or in front of it. The command that the diagnosis proposes writes 60 s of voltage; it is played on
the concealed rig, the recording joins those of the fit, and all is diagnosed again.
"""

from __future__ import annotations

import json
import math
import shlex
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from threading import Event
from typing import Annotated, Any

import numpy as np
import typer
from rich.progress import track

from benchmarks.concealed.make import write_recording
from benchmarks.concealed.marks import names_of
from benchmarks.concealed.measures import share
from benchmarks.concealed.recordings import Hidden, Truth, make_recording
from benchmarks.concealed.run import TOOL, diagnose
from benchmarks.concealed.seal import open_answers
from drill_env._errors import InputError
from drill_env._files import make_folder, write_text

_RIVAL, _SETTLED = 0.05, 0.95
_LIMIT = 1200.0


def truth_of(answer: Mapping[str, Any]) -> Truth:
    """The concealed rig of an answer, to play something else on it."""
    told = [*answer["effects"], answer["unlisted"]]
    hidden = tuple(Hidden(e["id"], e["parameters"]) for e in told if e["parameters"])
    return Truth(
        answer["rig"], hidden, torque=tuple(answer["torque_noise_Nm"]), counts=answer["counts"],
        bursts=answer["lost_row_bursts"],
    )  # fmt: skip


def beliefs(diagnosis: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Probability of each candidate, and by how much its criterion is worse than the best one's."""
    found = {a["id"]: (a["probability"], a["delta_bic"]) for a in diagnosis["alternatives"]}
    effects, asked = diagnosis["effects"], diagnosis["next_experiment"]
    # The one that is named is no alternative to itself. The best one's distance is 0; what a
    # later round brought to the front has none.
    ahead = 0.0 if all(distance > 0.0 for _, distance in found.values()) else math.nan
    if effects:
        found[effects[0]["id"]] = (effects[0]["probability"], ahead)
    elif diagnosis["shape"] and asked:
        left = max(1.0 - sum(p for p, _ in found.values()), 0.0)
        found.setdefault(asked["separates"][0], (left, ahead))
    return found


def look(diagnosis: Mapping[str, Any], truth: str) -> dict[str, Any]:
    """What a diagnosis says of the truth and of its strongest rival."""
    effects, believed = diagnosis["effects"], beliefs(diagnosis)
    mine = {truth}
    for effect in effects:
        mine |= names_of(effect) if truth in names_of(effect) else set()
    right = max((believed[n] for n in believed if n in mine), default=None)
    others = [(v, n) for n, v in believed.items() if n not in mine]
    best, rival = max(others, default=((0.0, math.inf), None), key=lambda o: (o[0][0], -o[0][1]))
    first = effects[0]["id"] if effects else diagnosis["verdict"]
    return {
        "first": first, "right": first in mine, "probability": right[0] if right else 0.0,
        "known": right is not None, "rival": rival, "rival_probability": best[0],
        # Half the difference of the criteria: natural logarithm of the odds, taken at face value.
        "log_odds": _told(0.5 * (best[1] - right[1])) if right and rival else None,
    }  # fmt: skip


def _told(value: float) -> float | None:
    return value if math.isfinite(value) else None


def ambiguous(diagnosis: Mapping[str, Any], truth: str) -> bool:
    """Whether a recording is asked for and the truth is in doubt but not out of sight."""
    seen = look(diagnosis, truth)
    doubt = seen["rival_probability"] >= _RIVAL or not seen["right"]
    return diagnosis["next_experiment"] is not None and seen["known"] and doubt


def add_recording(answer: Mapping[str, Any], command: str, case: Path) -> None:
    """Play what a diagnosis asks for on the concealed rig; one more recording of its case."""
    program = Path(TOOL[0]).parent / "drill-env"
    words = shlex.split(command)
    subprocess.run([str(program), *words[1:]], cwd=case, check=True, capture_output=True)
    play = case / words[words.index("--out") + 1]
    u = np.loadtxt(play, delimiter=",", skiprows=1)[:, 1]
    play.unlink()
    made = make_recording(truth_of(answer), np.round(u, 5), (*answer["seed"], 3))
    write_recording(case / f"fit-{len(list(case.glob('fit-*.csv'))) + 1}.csv", made)


def settle(answer: Mapping[str, Any], before: Mapping[str, Any], case: Path, out: Path) -> None:
    """Diagnose a case again with the recording that was asked for; done already, it stays."""
    again = out / "diagnosis.json"
    if again.exists():
        return
    copy = out / "case"
    shutil.rmtree(copy, ignore_errors=True)
    make_folder(out)
    shutil.copytree(case, copy)
    add_recording(answer, before["next_experiment"]["command"], copy)
    run = diagnose(TOOL, copy, out, _LIMIT, Event())
    write_text(out / "run.json", json.dumps(run, indent=1) + "\n")
    shutil.rmtree(copy)
    if run["exit_status"]:
        raise InputError(f"{case}: no second diagnosis: {run['output_tail']}")


def judged(
    answer: Mapping[str, Any], before: Mapping[str, Any], after: Mapping[str, Any]
) -> dict[str, Any]:
    """Whether the one recording settled it, and what it moved against what was promised."""
    truth = answer["effects"][0]["id"]
    one, two = look(before, truth), look(after, truth)
    asked = before["next_experiment"]
    # Of the same two candidates as before, whoever rivals now.
    pair = beliefs(after)
    moved = None
    if one["log_odds"] is not None and {truth, one["rival"]} <= set(pair):
        moved = _told(0.5 * (pair[one["rival"]][1] - pair[truth][1]) - one["log_odds"])
    left = pair.get(one["rival"], (0.0, 0.0))[0]
    return {
        "case": answer["case"], "truth": truth, "signal": asked["signal"],
        "separates": asked["separates"], "promised_log_odds": asked["expected_log_odds"],
        "before": one, "after": two, "moved_log_odds": moved,
        "asked": truth in asked["separates"],
        "settled": two["right"] and two["probability"] >= _SETTLED,
        # Against the rival of before alone, whatever else has come up.
        "beaten": two["probability"] > 0.0
        and two["probability"] >= _SETTLED * (two["probability"] + left),
    }  # fmt: skip


def table(rows: list[dict[str, Any]]) -> str:
    """One line a case, and the share that was settled."""
    heads = ("truth", "before", "rival", "asked for", "separates", "after",
             "log odds moved (promised)", "settled", "rival beaten")  # fmt: skip
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for r in rows:
        one, two, moved = r["before"], r["after"], r["moved_log_odds"]
        lines.append(
            f"| {r['truth']} | {one['first']}, truth {one['probability']:.2f} | {one['rival']} "
            f"{one['rival_probability']:.2f} | {r['signal']} | {', '.join(r['separates'])} | "
            f"{two['first']}, truth {two['probability']:.2f} | "
            f"{'' if moved is None else f'{moved:.0f}'} ({r['promised_log_odds']:.3g}) | "
            f"{'yes' if r['settled'] else 'no'} | {'yes' if r['beaten'] else 'no'} |"
        )
    for name, hit in (
        ("settled", lambda r: r["settled"]),
        ("the rival of before beaten", lambda r: r["beaten"]),
        ("the truth one of the two asked about", lambda r: r["asked"]),
        ("settled and asked about", lambda r: r["asked"] and r["settled"]),
        ("truth named first before", lambda r: r["before"]["right"]),
        ("truth named first after", lambda r: r["after"]["right"]),
    ):
        part = share(rows, hit)
        lines.append(f"\n{name}: {part['hits']}/{part['n']} ({part['low']:.0%} to "
                     f"{part['high']:.0%})")  # fmt: skip
    return "\n".join(lines)


def main(
    cases: Annotated[Path, typer.Option(help="Folder of the cases.")],
    answers: Annotated[Path, typer.Option(help="Folder of the sealed answers.")],
    reports: Annotated[Path, typer.Option(help="Folder of the first diagnoses, by `run`.")],
    out: Annotated[Path, typer.Option(help="Folder of the second ones and ambiguity.json.")],
    most: Annotated[int, typer.Option(help="Cases that are settled; 0 for all.")] = 0,
) -> None:
    """Settle the ambiguous cases and print the table."""
    try:
        told = [a for a in open_answers(answers).values() if a["kind"] == "single"]
        first = {a["case"]: reports / a["case"] / "diagnosis.json" for a in told}
        told = [a for a in told if first[a["case"]].exists()]
        before = {a["case"]: json.loads(first[a["case"]].read_text("utf-8")) for a in told}
        doubtful = [a for a in told if ambiguous(before[a["case"]], a["effects"][0]["id"])]
        rows = []
        for answer in track(doubtful[: most or None], "cases", transient=True):
            name = answer["case"]
            settle(answer, before[name], cases / name, out / name)
            after = json.loads((out / name / "diagnosis.json").read_text("utf-8"))
            rows.append(judged(answer, before[name], after))
        document = {"schema": 1, "diagnosed": len(told), "ambiguous": len(doubtful), "cases": rows}
        write_text(make_folder(out) / "ambiguity.json", json.dumps(document, indent=1) + "\n")
    except InputError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from error
    print(f"{len(told)} diagnosed, {len(doubtful)} ambiguous\n\n{table(rows)}")


if __name__ == "__main__":
    typer.run(main)
