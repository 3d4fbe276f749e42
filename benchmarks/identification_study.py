"""Coverage and accuracy of the identification on recordings of another simulator.

Each trial draws a rig (all parameters within 10 % of the paper's), a start up to 30 % off it, three
quasi-random recordings of 50 s to fit and one to judge, at 200 Hz with 8192 counts, with or without
torque noise. `python -m benchmarks.identification_study --trials 100`; finished trials are kept in
the output folder and not done again.
"""

from __future__ import annotations

import functools
import json
import math
import time
import warnings
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from benchmarks.rig_maker import make, quasi_random
from drill_env._engine import run
from drill_env._files import make_folder, write_text
from drill_env.cli._engine_options import (
    AddressOption,
    EngineKind,
    EngineOption,
    JobsOption,
    counted,
    engine_of,
)
from drill_env.friction import lower_curve
from drill_env.identification.estimate import Estimate, identify
from drill_env.identification.replay import replay
from drill_env.parameters import SYMBOLS, Rig
from drill_env.recordings import Recording

RATE, SECONDS, COUNTS = 200.0, 50.0, 8192
NOISES = {"torque noise": (0.02, 2e-4), "encoders only": (0.0, 0.0)}
FREE = tuple(name for name in SYMBOLS if name != "Ju")


def draw(seed: int, torques: tuple[float, float]) -> tuple[Rig, Rig, list[Recording]]:
    """The true rig, the start, and four recordings, the last one to judge by."""
    rng = np.random.default_rng(seed)
    truth = Rig(**{n: getattr(Rig(), n) * rng.uniform(0.9, 1.1) for n in SYMBOLS})
    start = truth.replace(**{n: getattr(truth, n) * rng.uniform(0.7, 1.3) for n in FREE})
    step = 2.0 * math.pi / COUNTS
    runs = []
    for i in range(4):
        made = make(
            {n: getattr(truth, n) for n in SYMBOLS}, quasi_random(rng, SECONDS, RATE, 5.0), RATE,
            seed=100 * seed + i, torque_u=torques[0], torque_l=torques[1], counts=COUNTS,
        )  # fmt: skip
        quanta = {"theta_u": step, "theta_l": step}
        runs.append(Recording(made.t, made.u, made.theta_u, made.theta_l, quanta=quanta))
    return truth, start, runs


def trial(torques: tuple[float, float], seed: int) -> dict[str, Any]:
    """One fit and what is true of it."""
    warnings.simplefilter("ignore")
    truth, start, runs = draw(seed, torques)
    began = time.perf_counter()
    estimate = identify(runs[:3], start, fixed={"Ju": truth.Ju})
    seconds = time.perf_counter() - began
    deviations = np.sqrt(np.diag(estimate.covariance))
    gaps = np.array([getattr(estimate.rig, n) - getattr(truth, n) for n in FREE])
    sizes = np.array([abs(getattr(truth, n)) for n in FREE])
    intervals = estimate.intervals()
    return {
        "seed": seed,
        "seconds": seconds,
        "converged": estimate.converged,
        "covered": [intervals[n][0] <= getattr(truth, n) <= intervals[n][1] for n in FREE],
        "z": (gaps / deviations).tolist(),
        "relative_error": np.abs(gaps / sizes).tolist(),
        "curve_error": _curve_error(estimate, truth, runs),
        "held_out": _held_out(estimate.rig, truth, runs[3]),
    }


def _curve_error(estimate: Estimate, truth: Rig, runs: list[Recording]) -> float:
    fastest = max(
        float(np.abs(np.gradient(np.convolve(r.channel("theta_l"), np.ones(20) / 20, "valid"))
                     * RATE).max())
        for r in runs[:3]
    )  # fmt: skip
    speeds = np.linspace(0.0, fastest, 300)
    true = lower_curve(truth, speeds)
    return float(np.abs(lower_curve(estimate.rig, speeds) - true).max() / np.abs(true).max())


def _held_out(rig: Rig, truth: Rig, recording: Recording) -> dict[str, float]:
    """Errors of the estimate over those of the true parameters."""
    mine, true = replay(recording, rig), replay(recording, truth)
    found = {}
    for name in ("theta_u", "theta_l"):
        found[f"free run {name}"] = mine.errors[name].rms / true.errors[name].rms
        found[f"5 s {name}"] = mine.prediction_errors[name].rms / true.prediction_errors[name].rms
    return found


def _wilson(hits: int, n: int) -> tuple[float, float]:
    z, p = 1.96, hits / n
    middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)


def report(rows: list[dict[str, Any]]) -> str:
    """The table of one noise level."""
    lines = [f"{'parameter':10s} covered  Wilson 95 %      median |error|  rms z"]
    covered = np.array([r["covered"] for r in rows])
    errors = np.array([r["relative_error"] for r in rows])
    z = np.array([r["z"] for r in rows])
    for i, name in enumerate(FREE):
        low, high = _wilson(int(covered[:, i].sum()), len(rows))
        lines.append(
            f"{name:10s} {covered[:, i].mean():7.1%}  {low:6.1%} {high:6.1%}   "
            f"{np.median(errors[:, i]):12.4%}  {np.sqrt(np.mean(z[:, i] ** 2)):6.2f}"
        )
    low, high = _wilson(int(covered.sum()), covered.size)
    lines.append(f"{'all':10s} {covered.mean():7.1%}  {low:6.1%} {high:6.1%} (dependent)")
    curve = np.array([r["curve_error"] for r in rows])
    lines.append(f"friction curve: median {np.median(curve):.3%}, worst {curve.max():.3%}")
    for name in rows[0]["held_out"]:
        ratio = np.array([r["held_out"][name] for r in rows])
        lines.append(
            f"held out, {name}: error over that of the true parameters median "
            f"{np.median(ratio):.3f}, 95th percentile {np.quantile(ratio, 0.95):.3f}"
        )
    seconds = [r["seconds"] for r in rows]
    lines.append(
        f"fit: median {np.median(seconds):.2f} s, worst {max(seconds):.2f} s, "
        f"converged {sum(r['converged'] for r in rows)} of {len(rows)}"
    )
    return "\n".join(lines)


def main(
    trials: Annotated[int, typer.Option(help="Of each noise level.")] = 100,
    out: Annotated[Path, typer.Option(help="Folder of the trials.")] = Path("out/identification"),
    jobs: JobsOption = None,
    engine: EngineOption = EngineKind.LOCAL,
    address: AddressOption = None,
) -> None:
    """Run the trials that are not done yet and print both tables."""
    runs_at = engine_of(jobs, engine, address)
    make_folder(out)
    for label, torques in NOISES.items():
        stem = label.replace(" ", "-")
        files = [out / f"{stem}-{seed:04d}.json" for seed in range(trials)]
        missing = [seed for seed, path in enumerate(files) if not path.exists()]
        with counted(label) as watch:
            found = run(functools.partial(trial, torques), missing, runs_at, progress=watch)
            for seed, row in zip(missing, found, strict=True):
                write_text(files[seed], json.dumps(row))
        rows = [json.loads(path.read_text()) for path in files]
        print(f"\n{label}, {len(rows)} trials\n{report(rows)}", flush=True)


if __name__ == "__main__":
    typer.run(main)
