"""How much the diagnosis of axes depends on each number of its criteria.

python -m benchmarks.criteria_sensitivity --cases 30 --seed 31 --json out.json

Every axis of `benchmarks.axes` is diagnosed with the criteria as they are, and with one number at
half and at double of it; of the share, which is at most 1, what it leaves of 1 is doubled and
halved. What a search found at a model is kept: criteria that decide, and do not fit, cost little.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.axes import GROUPS, axis_of, group_of, judged
from drill_env._watch import Report
from drill_env.diagnosis.by_prediction import diagnose_by_prediction
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.prediction import decide, search
from drill_env.prediction.candidate import Candidate
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.fit import Fit

# `evidence` decides on whole rigs alone.
NUMBERS = (
    "z", "gain", "share", "common", "neighbour", "windows", "degrees", "reach", "shift",
    "horizons", "leads",
)  # fmt: skip
AS_THEY_ARE = "as they are"


def variations() -> Iterator[tuple[str, Criteria]]:
    """Names of the variations, and their criteria."""
    usual = Criteria()
    yield AS_THEY_ARE, usual
    for name in NUMBERS:
        for word, factor in (("half", 0.5), ("double", 2.0)):
            yield f"{name}, {word}", replace(usual, **{name: _varied(usual, name, factor)})


def _varied(usual: Criteria, name: str, factor: float) -> Any:
    value = getattr(usual, name)
    if name == "share":
        return 1.0 - (1.0 - value) / factor
    if name == "windows":
        return max(round(factor * value), 1)
    if name == "leads":
        # The last one is the horizon, which has a line of its own.
        return (*(factor * lead for lead in value[:-1]), value[-1])
    return tuple(factor * v for v in value) if name == "horizons" else factor * value


class Kept:
    """`searched` that remembers what it found at a model."""

    def __init__(self) -> None:
        self.rounds: dict[Any, search.Round] = {}

    def __call__(
        self, folds: Sequence[search.Fold], before: Sequence[Fit],
        candidates: Sequence[Candidate], report: Report,
    ) -> search.Round:  # fmt: skip
        """As `search.searched`."""
        fits = tuple((b.packed.tobytes(), b.errors.tobytes(), b.value) for b in before)
        # What fits depend on besides their start.
        told = folds[0].setting.criteria
        key = (fits, told.degrees, told.reach, told.shift, tuple(c.id for c in candidates))
        if key not in self.rounds:
            self.rounds[key] = search.searched(folds, before, candidates, report)
        return self.rounds[key]


def row_of(case: int, seed: int) -> dict[str, Any]:
    """How each variation's answer to one axis is judged."""
    axis, runs, rig = axis_of(case, seed)
    options = DiagnosisOptions(given_rig=True, doubt=0.1)
    kept: Callable[..., search.Round] = Kept()
    usual, told = decide.searched, dict[str, str]()
    try:
        decide.searched = kept
        for name, criteria in variations():
            found = diagnose_by_prediction(runs[:2], rig, runs[2:], options, criteria=criteria)
            told[name] = judged(axis.term, found.result)
    finally:
        decide.searched = usual
    return {"case": case, "term": axis.term, "judged": told}


def table_of(rows: Sequence[dict[str, Any]]) -> Table:
    """Answers that are right, of each group and variation."""
    table = Table("criteria", *GROUPS, "answers that change")
    for name in rows[0]["judged"]:
        counts = []
        for group in GROUPS:
            own = [r["judged"][name] for r in rows if group_of(r["term"]) == group]
            counts.append(f"{own.count('right')}/{len(own)}")
        moved = [r for r in rows if r["judged"][name] != r["judged"][AS_THEY_ARE]]
        table.add_row(name, *counts, str(len(moved)))
    return table


def main(
    json_out: Annotated[Path, typer.Option("--json", help="Rows; those in it are not made again.")],
    cases: Annotated[int, typer.Option(help="How many axes.")] = 30,
    seed: Annotated[int, typer.Option(help="Of the axes.")] = 31,
) -> None:
    """Judge every variation on the same axes and print the counts."""
    rows = json.loads(json_out.read_text(encoding="utf-8")) if json_out.exists() else []
    done = {r["case"] for r in rows}
    # In random order what is done when a run is stopped is a sample of all.
    order = np.random.default_rng(seed).permutation(cases).tolist()
    for case in track([c for c in order if c not in done]):
        rows.append(row_of(case, seed))
        json_out.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    Console(width=120).print(table_of(rows))


if __name__ == "__main__":
    typer.run(main)
