"""Score the diagnoses of concealed cases against their sealed answers.

`python -m benchmarks.concealed.score --reports DIR --answers DIR --out DIR` writes `score.md` and
`score.json`. With `--seal HEX`, the digest that was published before the run, the seal itself is
checked too. With `--oracles DIR`, written by `oracle`, the gap that can be closed is the one that
the true structure leaves when it is refitted on the same recordings.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from benchmarks.concealed.marks import mark
from benchmarks.concealed.measures import measure
from benchmarks.concealed.seal import open_answers
from benchmarks.concealed.table import markdown
from drill_env._errors import InputError
from drill_env._files import make_folder, write_text

SCHEMA = 1


def _diagnosis(folder: Path) -> tuple[dict[str, Any] | None, str | None]:
    """The diagnosis of a case, or why there is none."""
    path = folder / "diagnosis.json"
    if not path.exists():
        return None, "no diagnosis.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        return None, f"no JSON: {error}"
    if not isinstance(found, dict) or found.get("schema") != SCHEMA or "verdict" not in found:
        return None, f"not of schema {SCHEMA}"
    return found, None


def refitted_oracle(folder: Path | None, case: str) -> dict[str, float] | None:
    """Rms error of the refitted oracle's 5 s predictions, rad, by channel; None without one."""
    path = folder / f"{case}.json" if folder else None
    if path is None or not path.exists():
        return None
    return json.loads(path.read_text(encoding="utf-8"))["five_second_rms"]


def score(
    reports: Path,
    answers: Path,
    published: str | None = None,
    oracles: Path | None = None,
    *,
    done: bool = False,
) -> dict[str, Any]:
    """Marks of every case and the measures of all.

    Args:
        reports: a folder for each case, with `diagnosis.json` and `run.json`.
        answers: folder of the sealed answers.
        published: digest of the seal.
        oracles: folder of the refitted oracles; without one, or where a case has none there, the
            true plant from its true states stands for it.
        done: whether cases that were not run are left out; otherwise they are wrong.

    Raises:
        InputError: the answers are not those that were sealed.
    """
    rows: list[dict[str, Any]] = []
    faults: dict[str, str] = {}
    for answer in open_answers(answers, published).values():
        folder = reports / answer["case"]
        if done and not (folder / "run.json").exists():
            continue
        diagnosis, fault = _diagnosis(folder)
        if fault:
            faults[answer["case"]] = fault
        try:
            row = mark(answer, diagnosis, refitted_oracle(oracles, answer["case"]))
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            faults[answer["case"]] = f"does not follow the schema: {error!r}"
            row = mark(answer, None)
        run = folder / "run.json"
        spent = json.loads(run.read_text(encoding="utf-8")) if run.exists() else {}
        spent = {name: spent.get(name) for name in ("cpu_s", "wall_s")}
        rows.append({"case": answer["case"], **row, **spent})
    return {"schema": 1, "measures": measure(rows), "faults": faults, "cases": rows}


def main(
    reports: Annotated[Path, typer.Option(help="Folder of the reports.")],
    answers: Annotated[Path, typer.Option(help="Folder of the sealed answers.")],
    out: Annotated[Path, typer.Option(help="Where score.md and score.json go.")],
    seal: Annotated[str | None, typer.Option(help="Digest that was published.")] = None,
    oracles: Annotated[Path | None, typer.Option(help="Folder of the refitted oracles.")] = None,
    done: Annotated[bool, typer.Option("--done", help="Leave out cases not yet run.")] = False,
) -> None:
    """Open the answers, score the diagnoses and print the table."""
    try:
        found = score(reports, answers, seal, oracles, done=done)
        make_folder(out)
    except (InputError, OSError) as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(2) from error
    text = markdown(found)
    write_text(out / "score.json", json.dumps(found, indent=1) + "\n")
    write_text(out / "score.md", text)
    print(text)


if __name__ == "__main__":
    typer.run(main)
