"""A residual that repeats in time, at a phase of its own in each recording."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.axis_maker import draw, recorded
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.repetition import Residual, repetition_of
from drill_env.effects import LIBRARY
from drill_env.integrator import sampled_voltage, simulate
from drill_env.parameters import Rig
from drill_env.recordings import Recording
from tests.made_recordings import STEP

FREQUENCY, RATE, SECONDS = 0.83, 100.0, 30.0


def coloured(rng: np.random.Generator, tau: float) -> np.ndarray:
    """A torque of standard deviation 1 with an exponential correlation."""
    keep = math.exp(-1.0 / (RATE * tau))
    out = np.zeros(int(SECONDS * RATE))
    for i in range(1, len(out)):
        out[i] = keep * out[i - 1] + math.sqrt(1.0 - keep**2) * rng.normal()
    return out


def residuals(seed: int, tau: float, size: float, driven: bool, count: int = 5) -> list[Residual]:
    rng, t = np.random.default_rng(seed), np.arange(int(SECONDS * RATE)) / RATE
    found = []
    for _ in range(count):
        drive = 3.0 + np.cumsum(rng.normal(size=len(t))) / 20.0
        phase = rng.uniform(0.0, 2.0 * np.pi)
        wave = size * np.cos(2.0 * np.pi * FREQUENCY * t + phase) * (drive if driven else 1.0)
        found.append(Residual(t, coloured(rng, tau) + wave, drive))
    return found


@pytest.mark.parametrize("driven", [False, True])
def test_a_cosine_with_a_phase_of_each_recording_is_found(driven: bool) -> None:
    size = 0.5 if driven else 1.5
    every = residuals(1, 0.1, size, driven)
    found = repetition_of(every[:3], every[3:], disc=1, driven=True)
    assert found is not None and found.driven == driven and found.disc == 1
    assert found.frequency == pytest.approx(FREQUENCY, abs=0.25 / SECONDS)
    assert found.amplitude == pytest.approx(size, rel=0.1)
    located, shape, told = found.told()
    assert located.component == ("actuator" if driven else "lower")
    assert located.frequency_hz == told["frequency_hz"] == found.frequency
    assert shape.sort == ("drive" if driven else "torque")


@pytest.mark.parametrize("tau", [0.01, 0.1, 1.0, 3.0])
def test_noise_of_any_colour_repeats_nothing(tau: float) -> None:
    for seed in range(20):
        every = residuals(seed, tau, 0.0, False)
        assert repetition_of(every[:3], every[3:], driven=True) is None


def test_what_repeats_in_the_fitted_recordings_alone_is_chance() -> None:
    swinging, still = residuals(1, 0.1, 1.5, False), residuals(2, 0.1, 0.0, False)
    assert repetition_of(swinging[:3], still[3:], driven=True) is None


def test_a_gap_of_years_is_not_filled() -> None:
    every = residuals(1, 0.1, 1.5, False)
    late = [Residual(np.where(e.t > 20.0, e.t + 1e9, e.t), e.values, e.drive) for e in every]
    assert repetition_of(late[:3], late[3:], driven=True) is None


def test_a_supply_that_hunts_is_told_of_an_axis() -> None:
    """No function of time or motion that some recordings teach foresees it in others."""
    axis = draw("hunting supply", np.random.default_rng(3))
    rng = np.random.default_rng(4)
    runs = [recorded(axis, rng) for _ in range(5)]
    recordings = [
        Recording(r["t"], r["u"], r["theta_u"], quanta={"theta_u": r["step"]}, source=f"run-{i}")
        for i, r in enumerate(runs)
    ]
    found = diagnose(recordings[:3], Rig.one_inertia(**axis.given), recordings[3:]).result
    assert found.verdict == "unexplained" and not found.effects
    assert found.located is not None and found.located.component == "actuator"
    assert found.located.frequency_hz == pytest.approx(axis.numbers["swing_hz"], rel=0.05)
    text = " ".join(found.sentences)
    assert "A cosine of time of" in text and "of the drive explains" in text
    assert "a free function of time" not in text


def test_a_phase_that_held_out_recordings_do_not_bear_out_is_one_of_what_repeats() -> None:
    """Of one fitted recording a disturbance of fixed phase is a name; the others reject it."""
    depth, hertz, runs = 0.05, 0.61, []
    for seed, phase in enumerate((0.3, 2.4, 4.6)):
        rng, t = np.random.default_rng([94, seed]), np.arange(8000) / 200.0
        u = np.repeat(rng.uniform(2.0, 5.0, 20), 400)
        acting = u * (1.0 + depth * np.cos(2.0 * np.pi * hertz * t + phase))
        run = simulate(Rig(), sampled_voltage(t, acting), float(t[-1]), t_eval=t)
        read = [np.round(angle / STEP) * STEP for angle in (run.theta_u, run.theta_l)]
        runs.append(Recording(t, u, *read, quanta={"theta_u": STEP, "theta_l": STEP},
                              source=f"hunting-{seed}"))  # fmt: skip
    left_out = tuple(n for n in LIBRARY if n != "upper_disturbance")
    options = DiagnosisOptions(leave_out=left_out, most=1)
    found = diagnose(runs[:1], Rig(), runs[1:], options=options).result
    assert found.verdict == "unexplained" and not found.effects
    assert "upper_disturbance was rejected" in " ".join(found.sentences)
    assert found.located is not None and found.located.component == "actuator"
    assert found.located.frequency_hz == pytest.approx(hertz, abs=0.01)
