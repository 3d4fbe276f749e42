"""Which temperature of the evidence opened cases would have liked best.

`python -m benchmarks.concealed.temperature score.json [score.json ...]` reads the marks of opened
runs (`score` writes them) and prints, for factors by which the temperature is divided, the mean
logarithmic loss of the first name's probability and its calibration error. Opened cases are for
choosing; the error that counts is that of a run that was not opened.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from benchmarks.concealed.measures import Row, calibration_error
from drill_env.diagnosis.belief import UNLISTED

FACTORS = (0.7, 1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0)
_LEAST = 1e-4


def sharpened(rows: list[Row], factor: float) -> list[Row]:
    """The claims when all differences of the evidence count `factor` times as much.

    What is kept for physics of no library stays kept.
    """
    out = []
    for row in rows:
        p = min(max(row["probability"] / (1.0 - UNLISTED), 1e-12), 1.0 - 1e-12)
        sharp = 1.0 / (1.0 + ((1.0 - p) / p) ** factor)
        out.append({**row, "probability": (1.0 - UNLISTED) * sharp})
    return out


def log_loss(rows: list[Row]) -> float:
    """Mean of -log of the probability that was given to what turned out, at most -log 1e-4."""
    p = np.clip([row["probability"] for row in rows], _LEAST, 1.0 - _LEAST)
    right = np.array([bool(row["first"]) for row in rows])
    return float(-np.mean(np.log(np.where(right, p, 1.0 - p))))


def main(scores: Annotated[list[Path], typer.Argument(help="score.json of opened runs.")]) -> None:
    """Print a table over the factors."""
    cases = [r for path in scores for r in json.loads(path.read_text("utf-8"))["cases"]]
    rows = [r for r in cases if r["probability"] is not None]
    print(f"{len(rows)} claims\n\n| divided by | log loss | calibration error |\n|---|---|---|")
    for factor in FACTORS:
        there = sharpened(rows, factor)
        error = calibration_error(there)["error"]
        print(f"| {factor:g} | {log_loss(there):.3f} | {error:.3f} |")


if __name__ == "__main__":
    typer.run(main)
