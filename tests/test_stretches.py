"""What acts in a few stretches alone is reported, though no window elsewhere asks for it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis import by_prediction
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.recordings import Recording
from drill_env.report.prediction_page import prediction_page

RATE, SECONDS, NOISE, STEP = 200.0, 30.0, 3e-4, 2.0 * math.pi / 4096
AXIS = Rig.one_inertia(km=1.0, Ju=0.05, Tsu=0.0, bu=0.1)
RATED, LIMIT, COOL, WARM = 1.0, 0.6, 0.7, 3.0


def folded_back(command: np.ndarray) -> np.ndarray:
    """A drive that limits its torque once it is warm, until it has cooled: I2t protection."""
    out, heat, folded = command.copy(), 0.0, False
    for k, torque in enumerate(command.tolist()):
        heat += ((torque / RATED) ** 2 - heat) / (WARM * RATE)
        folded = heat > (COOL if folded else 1.0)
        if folded:
            out[k] = min(max(torque, -LIMIT), LIMIT)
    return out


def run_of(seed: int, strength: float, drive, knock: float = 0.0, noise: float = 1.0) -> Recording:
    """A linear axis, exactly, under multisines of a strength; knocked once for half a second."""
    rng, t = np.random.default_rng(seed), np.arange(int(SECONDS * RATE)) / RATE
    tones = rng.uniform(0.1, 0.6, 5)
    u = sum(np.cos(2.0 * math.pi * f * t + rng.uniform(0.0, 6.3)) for f in tones.tolist())
    u = np.asarray(strength * u / np.std(u))
    torque = drive(u) + np.where((t > 10.0) & (t < 10.5), knock, 0.0)
    decay = math.exp(-AXIS.bu / AXIS.Ju / RATE)
    theta, omega = np.zeros(len(t)), 0.0
    for k, end in enumerate((torque[:-1] / AXIS.bu).tolist()):
        theta[k + 1] = theta[k] + end / RATE + (omega - end) * (1.0 - decay) * AXIS.Ju / AXIS.bu
        omega = end + (omega - end) * decay
    read = STEP * np.round((theta + noise * rng.normal(0.0, NOISE, len(t))) / STEP)
    return Recording(
        t, u, read, drive="torque", source=f"axis {seed}", quanta={"theta_u": STEP}
    )  # fmt: skip


def told_of(runs, monkeypatch):
    """The diagnosis of runs of which the last two are unseen, with nothing on offer."""
    monkeypatch.setattr(by_prediction, "candidates_for", lambda *given, **options: [])
    options = DiagnosisOptions(given_rig=True, doubt=0.1)
    return by_prediction.diagnose_by_prediction(runs[:-2], AXIS, runs[-2:], options)


def test_a_drive_that_folds_back_in_hard_runs_alone_is_told_by_when_it_does(monkeypatch):
    strengths = (0.4, 0.9, 0.5, 0.4, 0.9)
    runs = [run_of(seed, size, folded_back) for seed, size in enumerate(strengths)]
    found = told_of(runs, monkeypatch)
    result = found.result
    assert result.verdict == "unexplained"
    stretches = result.fit["fails"]["stretches_s"]
    assert set(stretches) == {"axis 1", "axis 4"}
    for name, told in stretches.items():
        one = next(r for r in runs if r.source == name)
        # Where the command is more than the limit and the drive is known to have limited it.
        acts = folded_back(one.u) != one.u
        inside = np.zeros(len(one.t), dtype=bool)
        for a, b in told:
            inside |= (one.t >= a) & (one.t <= b)
        assert np.mean(acts[inside]) > 0.9
        assert np.mean(inside[acts & (np.abs(one.u) > 2.0 * LIMIT)]) > 0.8
    assert any("something acts there" in line for line in result.sentences)
    page, (first, last) = prediction_page(found), stretches["axis 1"][0]
    assert f"{first:.2f} to {last:.2f}" in page.split("Where the model fails")[1]


@pytest.mark.parametrize(
    "case", ["nothing", "a knock that came once", "one noisy recording", "an angle that jumps"]
)
def test_what_is_no_missing_physics_is_no_failing_stretch(case, monkeypatch):
    runs = [
        run_of(
            seed, 0.8, np.asarray, knock=2.0 if case.startswith("a knock") and seed == 4 else 0.0,
            noise=30.0 if case.startswith("one noisy") and seed == 4 else 1.0,
        )
        for seed in range(5)
    ]  # fmt: skip
    if case == "an angle that jumps":
        for place, one in enumerate(runs):
            one.theta_u[1500 + 700 * place :] += 0.3
    result = told_of(runs, monkeypatch).result
    assert "fails" not in result.fit
    if case != "one noisy recording":
        assert result.verdict in ("consistent", "parameters")
