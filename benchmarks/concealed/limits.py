"""Detection limits: the size at which an effect is worth 40 in minus twice the log likelihood.

Four recordings of the paper's rig are made with and without the effect, from the same noise. The
prediction-error filter of the package, given the true noise, measures how much less likely the
effect makes them after the fourteen parameters were fitted to them.
`python -m benchmarks.concealed.limits --seed 7` writes `limits.json`.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from rich.progress import track

from benchmarks.concealed.fields import PAPER, plant_record
from benchmarks.concealed.library import Concealed
from benchmarks.concealed.other_laws import CONCEALABLE
from benchmarks.concealed.recordings import (
    NOISE_TAU,
    TORQUE_NOISE,
    Hidden,
    Truth,
    make_recording,
)
from benchmarks.concealed.signals import draw_families, signal
from drill_env._files import write_text
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import score
from drill_env.identification.samples import Samples, prepare
from drill_env.parameters import Rig
from drill_env.recordings import Recording

Vector = NDArray[np.float64]
Fit = tuple[float, float, Vector]
PATH = Path(__file__).parent / "limits.json"
WORTH = 40.0
# The scale of all torques is not identifiable: no parameter moves by more than this, or hardly.
_EXACT: dict[str, Any] = {"counts": 2**24, "pretwist": 0.0}
_DEVIATION = 2.0 * math.pi / 8192 / math.sqrt(12.0)
_DOUBT, _STEPS, _ROBUST = 0.2, 10, 3.0


class Meter:
    """Excess of minus twice the log likelihood that an effect leaves in four recordings."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([seed, 0])
        bare = plant_record(PAPER)
        self.seed, self.rig = seed, Rig(**PAPER)
        self.signals = [signal(name, rng, bare) for name in draw_families(rng)[0]]
        self.noise = NoiseModel(*TORQUE_NOISE, NOISE_TAU, NOISE_TAU, _DEVIATION, _DEVIATION)
        self.bare: Fit = (0.0, *self._fitted(Truth(PAPER, **_EXACT), [np.zeros(14)]))

    def excess(self, effect: Concealed, size: float, near: list[Fit]) -> float:
        """Of an effect with the middle of its shape.

        Args:
            effect: from the library.
            size: of it.
            near: fits at other sizes, to start from and to add this one to.
        """
        parameters = effect.parameters(size, effect.middle())
        truth = Truth(PAPER, (Hidden(effect.id, parameters),), **_EXACT)
        starts = [self.bare[2], *(self.bare[2] + (m - self.bare[2]) * size / s for s, _, m in near)]
        value, moved = self._fitted(truth, starts)
        near.append((size, value, moved))
        return value - self.bare[1]

    def _fitted(self, truth: Truth, starts: list[Vector]) -> tuple[float, Vector]:
        """The least value that damped Gauss-Newton steps of the parameters reach, and where."""
        samples = [self._samples(truth, i) for i in range(len(self.signals))]
        trials = [self._value(samples, start) for start in starts]
        moved = starts[int(np.argmin([t[0] for t in trials]))]
        best, step, damping = min(trials, key=lambda t: t[0])[0], np.zeros(14), 1e-4
        here = self._value(samples, moved)
        for _ in range(_STEPS):
            _, pull, whole = here
            damped = whole + damping * np.diag(np.diag(whole))
            step = np.clip(np.linalg.solve(damped, pull), -0.1, 0.1)
            trial = self._value(samples, moved + step)
            if not trial[0] < best:
                damping *= 30.0
                if damping > 1e3:
                    break
                continue
            drop, best, moved, here = best - trial[0], trial[0], moved + step, trial
            damping = max(damping / 30.0, 1e-6)
            if drop < 1.0:
                break
        return best, moved

    def _value(self, samples: list[Samples], moved: Vector) -> tuple[float, Vector, Vector]:
        """Minus twice the log likelihood, its pull on the parameters and its curvature."""
        paper = np.array(list(PAPER.values()))
        values = dict(zip(PAPER, paper + np.abs(paper) * moved, strict=True))
        scores = [score(s, Rig(**values), self.noise, s.starts, _ROBUST) for s in samples]
        value = sum(s.value for s in scores) + float(moved @ moved) / _DOUBT**2
        pull = sum(s.gradient for s in scores) * np.abs(paper) - moved / _DOUBT**2
        whole = sum(s.information for s in scores) * np.outer(np.abs(paper), np.abs(paper))
        return value, pull, whole + np.eye(14) / _DOUBT**2

    def _samples(self, truth: Truth, i: int) -> Samples:
        made = make_recording(truth, self.signals[i], (self.seed, 1, i))
        # Gaussian errors of the same size: runs of equal counts would need a model of their own.
        rng = np.random.default_rng((self.seed, 2, i))
        angles = made.angles + rng.normal(0.0, _DEVIATION, made.angles.shape)
        found = prepare(Recording(made.t, made.u, *angles.T), self.rig)
        # The start is known here: at rest, untwisted.
        known = np.zeros_like(found.starts)
        return replace(found, starts=known, spreads=known)


def limit_of(meter: Meter, effect: Concealed) -> dict[str, Any]:
    """The size worth 40, sought by secants in the logarithms, and what it was measured worth."""
    tried: list[tuple[float, float]] = []
    near: list[Fit] = []
    size = effect.least or 0.1 * effect.guess
    for _ in range(7):
        worth = meter.excess(effect, size, near)
        tried.append((size, worth))
        if 0.8 * WORTH < worth < 1.25 * WORTH or (size == effect.least and worth > WORTH):
            break
        below = max((t for t in tried if t[1] < WORTH), default=None)
        above = min((t for t in tried if t[1] >= WORTH), default=None)
        if below and above and below[0] < above[0]:
            size = _between(below, above)
        else:
            size *= min(max(math.sqrt(WORTH / max(worth, 0.4)), 0.1), 6.0)
        if size > effect.largest and tried[-1][0] >= effect.largest:
            break
        size = max(min(size, effect.largest), effect.least)
    size, worth = min(tried, key=lambda t: abs(math.log(max(t[1], 1e-3) / WORTH)))
    return {
        "size": size, "parameter": effect.size, "unit": effect.unit, "worth": worth,
        "largest": effect.largest, "raised": worth > 1.25 * WORTH,
        "identifiable": bool(worth > 0.5 * WORTH and 5.0 * size <= effect.largest),
        "tried": tried,
    }  # fmt: skip


def _between(below: tuple[float, float], above: tuple[float, float]) -> float:
    """The size worth 40 on the power law through two others, kept inside them."""
    low, high = math.log(below[0]), math.log(above[0])
    rise = math.log(above[1] / max(below[1], 0.4))
    share = math.log(WORTH / max(below[1], 0.4)) / rise
    return math.exp(low + min(max(share, 0.1), 0.9) * (high - low))


@cache
def stored() -> dict[str, dict[str, Any]]:
    """Detection limits by effect, as last measured."""
    return json.loads(PATH.read_text(encoding="utf-8"))["limits"]


def main(
    seed: Annotated[int, typer.Option(help="Of signals and noise.")] = 7,
    only: Annotated[list[str] | None, typer.Option(help="Measure these again only.")] = None,
) -> None:
    """Measure the detection limits and store them."""
    limits = dict(stored()) if only and PATH.exists() else {}
    meter = Meter(seed)
    for name in track(only or list(CONCEALABLE), description="limits", transient=True):
        limits[name] = limit_of(meter, CONCEALABLE[name])
        print(f"{name:28s} {limits[name]['size']:.4g} {CONCEALABLE[name].unit:12s} "
              f"worth {limits[name]['worth']:.1f} identifiable {limits[name]['identifiable']} "
              f"in {len(limits[name]['tried'])}", flush=True)  # fmt: skip
    document = {
        "schema": 1, "command": f"python -m benchmarks.concealed.limits --seed {seed}",
        "seed": seed, "worth": WORTH, "limits": {name: limits[name] for name in CONCEALABLE},
    }  # fmt: skip
    write_text(PATH, json.dumps(document, indent=1) + "\n")


if __name__ == "__main__":
    typer.run(main)
