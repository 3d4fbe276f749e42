"""Make concealed cases: recordings in one folder, sealed answers in another.

`python -m benchmarks.concealed.make --out DIR --answers DIR --seed 1 --kinds single:150 --kinds
null:8 --ratios 5`. Seeds from 1000000 on are those of the proof. Cases that are there already
are not made again.
"""

from __future__ import annotations

import functools
import json
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from benchmarks.concealed import seal
from benchmarks.concealed.cases import FIRST_PROOF_SEED, KINDS, Plan, draw, plan, play_case
from benchmarks.concealed.library import LIBRARY
from benchmarks.concealed.recordings import Made
from drill_env._engine import Engine, run
from drill_env._errors import InputError
from drill_env._files import make_folder, write_text
from drill_env.cli._engine_options import JobsOption, counted


def plans(
    kinds: Sequence[str], cases: int, effects: Sequence[str], ratios: Sequence[float]
) -> list[Plan]:
    """Planned cases of kinds as `kind` or `kind:count`.

    Raises:
        InputError: a kind or an effect is unknown, or a count is not a number.
    """
    for name in effects:
        if name not in LIBRARY:
            raise InputError(f"--effects: {name!r} is unknown; known: {', '.join(LIBRARY)}")
    found: list[Plan] = []
    for item in kinds:
        kind, _, count = item.partition(":")
        if kind not in KINDS or not (count or "1").isdigit():
            raise InputError(f"--kinds: {item!r}: give KIND or KIND:COUNT of {', '.join(KINDS)}")
        found += plan(kind, int(count or cases), list(effects) or list(LIBRARY), ratios)
    return found


def write_recording(path: Path, made: Made) -> None:
    """One recording as a table of t, u, theta_u and theta_l."""
    rows = np.column_stack([made.t, made.u, made.angles])
    lines = ["t,u,theta_u,theta_l"]
    lines += [f"{t:.4f},{u:.5f},{upper:.6f},{lower:.6f}" for t, u, upper, lower in rows.tolist()]
    write_text(path, "\n".join(lines) + "\n")


def make_case(seed: int, planned: Plan, folder: Path, answer: Path) -> None:
    """Write one case and its answer, the answer last."""
    case = draw(seed, planned)
    made, told = play_case(case)
    make_folder(folder)
    for stem, recording in made.items():
        write_recording(folder / f"{stem}.csv", recording)
    if case.public:
        write_text(folder / "case.json", json.dumps(case.public) + "\n")
    write_text(answer, json.dumps({"case": folder.name, **told}, indent=1) + "\n")


def _one(seed: int, out: Path, answers: Path, numbered: tuple[int, Plan]) -> None:
    number, planned = numbered
    answer = answers / f"{number:03d}.json"
    if not answer.exists():
        make_case(seed, planned, out / f"case-{number:03d}", answer)


def main(
    out: Annotated[Path, typer.Option(help="Folder of the cases.")],
    answers: Annotated[Path, typer.Option(help="Folder of the answers.")],
    seed: Annotated[int, typer.Option(help=f"From {FIRST_PROOF_SEED} on: the proof's.")] = 1,
    kinds: Annotated[list[str] | None, typer.Option(help="KIND or KIND:COUNT.")] = None,
    cases: Annotated[int, typer.Option(help="Of each kind without a count.")] = 10,
    ratios: Annotated[str, typer.Option(help="Of single effects to their limits.")] = "1,2,5,20",
    effects: Annotated[list[str] | None, typer.Option(help="Single effects; all.")] = None,
    jobs: JobsOption = None,
) -> None:
    """Make the cases, seal the answers and print the seal's digest."""
    told = [f"--kinds {k}" for k in kinds or list(KINDS)]
    told += [f"--effects {e}" for e in effects or []]
    command = (f"python -m benchmarks.concealed.make --seed {seed} --cases {cases} "
               f"--ratios {ratios} {' '.join(told)}")  # fmt: skip
    try:
        planned = plans(kinds or list(KINDS), cases, effects or [], _numbers(ratios))
        for folder in (out, answers):
            make_folder(folder)
        _same_plan(answers, command)
    except InputError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from error
    # Numbers tell nothing of the kind.
    order = np.random.default_rng([seed, len(planned)]).permutation(len(planned))
    numbered = [(number, planned[int(place)]) for number, place in enumerate(order, 1)]
    with counted("cases") as watch:
        once = functools.partial(_one, seed, out, answers)
        deque(run(once, numbered, Engine(jobs=jobs), progress=watch), 0)
    print(f"{len(planned)} cases, seal {seal.write_seal(answers, command)}")


def _same_plan(answers: Path, command: str) -> None:
    """Cases of two plans must not mix in one folder."""
    path = answers / "plan.txt"
    if path.exists() and path.read_text(encoding="utf-8").strip() != command:
        raise InputError(
            f"{answers} holds the cases of {path.read_text(encoding='utf-8').strip()!r}: choose "
            "other folders or remove these"
        )
    write_text(path, command + "\n")


def _numbers(text: str) -> list[float]:
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError as error:
        raise InputError(f"--ratios: {text!r}: give numbers between commas") from error
    if min(found) <= 0.0:
        raise InputError(f"--ratios: {text!r}: give numbers greater than 0")
    return found


if __name__ == "__main__":
    typer.run(main)
