"""Drives of an axis: iron that saturates behind a measured current, and play in a gear."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis import by_prediction
from drill_env.diagnosis.by_prediction import diagnose_by_prediction
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.identification.samples import prepare
from drill_env.prediction import offer
from drill_env.prediction.cut import cut
from drill_env.prediction.motion import motion_as_read
from drill_env.recordings import Recording

RATE, SECONDS, NOISE, FINER = 100.0, 20.0, 3e-4, 20
JU, BU = 0.05, 0.1
GAP, SHARE, AT_MOTOR, STIFFNESS, LOSS = 0.09, 0.45, 0.6, 600.0, 1.0


def torque_of(rng: np.random.Generator) -> np.ndarray:
    """A multisine of up to 0.6 Hz, held between rows, rms 1 Nm."""
    t = np.arange(int(SECONDS * RATE)) / RATE
    tones = rng.uniform(0.1, 0.6, 6)
    u = sum(np.cos(2.0 * math.pi * f * t + rng.uniform(0.0, 6.3)) for f in tones.tolist())
    return np.asarray(u / np.std(u))


def stiff(torque: np.ndarray) -> np.ndarray:
    """Angle of a linear axis, exactly."""
    decay, theta, omega = math.exp(-BU / JU / RATE), np.zeros(len(torque)), 0.0
    for k, end in enumerate((torque[:-1] / BU).tolist()):
        theta[k + 1] = theta[k] + end / RATE + (omega - end) * (1.0 - decay) * JU / BU
        omega = end + (omega - end) * decay
    return theta


def loose(torque: np.ndarray) -> np.ndarray:
    """Angle of a load behind play."""
    return loose_states(torque)[:, 0]


def loose_states(torque: np.ndarray) -> np.ndarray:
    """Load's angle and speed, the motor's angle ahead of it and its speed, shape (n, 4).

    In small steps; most of the friction sits at the motor.
    """
    step, out = 1.0 / RATE / FINER, np.zeros((len(torque), 4))
    motor = load = fast = slow = 0.0
    for k, push in enumerate(torque.tolist()):
        out[k] = load, slow, motor - load, fast
        for _ in range(FINER):
            ahead = motor - load
            wound = math.copysign(max(abs(ahead) - 0.5 * GAP, 0.0), ahead)
            handed = STIFFNESS * wound + LOSS * (fast - slow) if wound else 0.0
            handed = handed if handed * wound > 0.0 else 0.0
            fast += step * (push - handed - AT_MOTOR * BU * fast) / (SHARE * JU)
            slow += step * (handed - (1.0 - AT_MOTOR) * BU * slow) / ((1.0 - SHARE) * JU)
            motor, load = motor + step * fast, load + step * slow
    return out


def diagnosed(drive, axis, most: int = 1):
    """What is said of four recordings of a machine whose drive and axis are given."""
    runs = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        u = torque_of(rng)
        read = axis(drive(u)) + rng.normal(0.0, NOISE, len(u))
        t = np.arange(len(u)) / RATE
        runs.append(Recording(t, u, read, drive="torque", source=f"axis {seed}"))
    options = DiagnosisOptions(given_rig=True, doubt=0.1, most=most)
    rig = Rig.one_inertia(km=1.0, Ju=JU, Tsu=0.0, bu=BU)
    return diagnose_by_prediction(runs[:2], rig, runs[2:], options).result


def test_iron_saturates_behind_a_measured_current():
    level = 1.5
    result = diagnosed(lambda u: level * 2.0 / np.pi * np.arctan(0.5 * np.pi * u / level), stiff)
    assert [effect.id for effect in result.effects] == ["soft_saturation"]


@pytest.mark.parametrize("axis", [loose, stiff])
def test_play_between_motor_and_load_is_found_from_far(axis, monkeypatch):
    names = {"gear_backlash", "gear_compliance", "actuator_lag", "upper_resonator"}
    every = offer.candidates_for
    monkeypatch.setattr(
        by_prediction, "candidates_for",
        lambda *given, **options: [c for c in every(*given, **options) if c.id in names],
    )  # fmt: skip
    result = diagnosed(lambda u: u, axis)
    found = {effect.id: effect.parameters for effect in result.effects}
    assert list(found) == (["gear_backlash"] if axis is loose else [])
    if axis is loose:
        gap = found["gear_backlash"]["gap"]
        assert gap.low < GAP < gap.high


def test_windows_begin_with_a_loose_motor_where_it_is():
    """Predictions err no more than from the maker's own states of load and motor."""
    inertia, horizon = JU * SHARE * (1.0 - SHARE), 0.5
    gear = {
        "id": "gear_backlash", "gap": GAP, "motor_share": SHARE, "friction_share": AT_MOTOR,
        "frequency": math.sqrt(STIFFNESS / inertia) / (2.0 * math.pi),
        "damping": 0.5 * LOSS / math.sqrt(STIFFNESS * inertia),
    }  # fmt: skip
    rig = Rig.one_inertia(km=1.0, Ju=JU, Tsu=0.0, bu=BU)
    found, known = [], []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        u = torque_of(rng)
        states = loose_states(u)
        read = states[:, 0] + rng.normal(0.0, NOISE, len(u))
        samples = prepare(Recording(np.arange(len(u)) / RATE, u, read, drive="torque"), rig)
        leads = horizon * np.array([0.06, 0.1, 0.3, 0.95])
        here = cut(samples, motion_as_read(samples, rig), rig, leads)
        loose_rig = rig.replace(effects=(gear,))
        found.append(here.errors(loose_rig, 0.0)[..., 0])
        start = states[here.windows.starts]
        begin = np.column_stack([start[:, :2], np.zeros((len(start), 2))])
        there = replace(here.windows, begin=begin, inner=start[:, 2:]).predicted(loose_rig)
        known.append(there.readings[..., 0] - here.target[..., 0])
    sizes = [np.median(np.abs(np.concatenate(errors)), axis=0) for errors in (found, known)]
    assert np.exp(np.mean(np.log(sizes[0] / sizes[1]))) < 1.15


def test_no_second_gear_is_offered_beside_the_first(monkeypatch):
    names = {"gear_backlash", "gear_compliance"}
    every = offer.candidates_for
    monkeypatch.setattr(
        by_prediction, "candidates_for",
        lambda *given, **options: [c for c in every(*given, **options) if c.id in names],
    )  # fmt: skip
    result = diagnosed(lambda u: u, loose, most=2)
    assert [effect.id for effect in result.effects] == ["gear_backlash"]


def test_a_name_whose_number_all_recordings_put_to_its_end_is_none(monkeypatch):
    """Halves of the recordings had it inside its range."""
    whole = by_prediction.refitted

    def at_its_end(found, cuts):
        there = whole(found, cuts)
        numbers = tuple(c.high if c.effect else z for c, z in zip(
            there.candidates, there.numbers, strict=True))  # fmt: skip
        return replace(there, numbers=numbers)

    monkeypatch.setattr(by_prediction, "refitted", at_its_end)
    level = 1.5
    result = diagnosed(lambda u: level * 2.0 / np.pi * np.arctan(0.5 * np.pi * u / level), stiff)
    assert not result.effects and result.verdict == "unexplained"
