"""Validation against another simulator: what is true is white, what is 20 % off is not."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import kstest

from benchmarks.rig_maker import MadeRecording, make, quasi_random
from drill_env import InputError
from drill_env.identification.estimate import FitOptions, identify
from drill_env.identification.noise import NoiseModel
from drill_env.identification.replay import channel_errors, replay, run_pieces
from drill_env.identification.validation import Validation, validate, validate_estimate
from drill_env.identification.whiteness import whiteness
from drill_env.parameters import SYMBOLS, Rig
from drill_env.recordings import Recording
from drill_env.report.validation_page import save_validation_page, validation_summary

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")
STEP = 2.0 * math.pi / 8192
RIG = Rig()
NOISE = NoiseModel(torque_u=0.02, torque_l=2e-4)


def recorded(
    seed: int, seconds: float = 25.0, volts: Any = None, **noise: Any
) -> tuple[Recording, MadeRecording]:
    """A run of the other simulator with the practice sets' torque noise, and its truth."""
    if volts is None:
        volts = quasi_random(np.random.default_rng(seed), seconds, 200.0, 5.0)
    torques = noise or {"torque_u": NOISE.torque_u, "torque_l": NOISE.torque_l}
    made = make({name: getattr(RIG, name) for name in SYMBOLS}, volts, seed=seed, **torques)
    quanta = {"theta_u": STEP, "theta_l": STEP}
    names = {"source": f"run-{seed}.csv", "quanta": quanta}
    return Recording(made.t, made.u, made.theta_u, made.theta_l, **names), made


@cache
def true_validations() -> list[Validation]:
    return [validate(recorded(seed)[0], RIG, NOISE) for seed in range(30, 36)]


def test_the_true_rig_leaves_white_innovations_of_the_expected_size():
    found = true_validations()
    assert sum(v.verdict == "white" for v in found) >= len(found) - 1
    tests = [test for v in found for test in v.residuals.values()]
    assert all(0.9 < test.rms < 1.1 for test in tests)
    assert 0.02 < np.mean([test.outside for test in tests]) < 0.08
    # Uniform p-values, as far as a dozen can tell.
    assert kstest([test.p_white for test in tests], "uniform").pvalue > 0.003


@pytest.mark.parametrize(
    ("name", "channel"),
    [
        ("bu", "theta_u"),
        ("Tsu", "theta_u"),
        ("Jl", "theta_l"),
        ("T2", "theta_l"),
        ("Tsl", "theta_l"),
    ],
)
def test_a_parameter_20_percent_off_shows_in_its_own_channel(name, channel):
    wrong = RIG.replace(**{name: 1.2 * getattr(RIG, name)})
    found = validate(recorded(30)[0], wrong, NOISE)
    assert channel in found.verdict
    test = found.residuals[channel]
    assert min(test.p_white, test.p_peak) < 1e-6
    assert test.outside > 0.15
    assert (
        found.replay.errors["theta_l"].rms
        > 2.0 * true_validations()[0].replay.errors["theta_l"].rms
    )


def test_tests_hold_their_level_and_find_what_was_put_in():
    """Dice, dice with a sine, dice behind a lag, and a share of the voltage."""
    rng = np.random.default_rng(3)
    u = quasi_random(rng, 20.0, 200.0, 5.0)
    dice = rng.normal(size=(200, 4000))
    found = [whiteness(row, u, 0.005) for row in dice]
    values = np.array([[t.p_white, t.p_peak, t.p_cross] for t in found if t is not None])
    assert len(values) == 200
    # Three standard deviations of a share of 200; the peak's bound is Bonferroni's.
    assert np.all(np.abs(np.mean(values[:, [0, 2]] < 0.1, axis=0) - 0.1) < 0.064)
    assert np.mean(values[:, 1] < 0.1) < 0.164
    sine = whiteness(dice[0] + 0.3 * np.sin(2.0 * np.pi * 0.25 * np.arange(4000) / 200), u, 0.005)
    lagged = whiteness(lfilter([1.0], [1.0, -0.3], dice[1]), u, 0.005)
    driven = whiteness(dice[2] + 0.2 * np.roll(u, 40), u, 0.005)
    assert sine is not None and sine.p_peak < 1e-6 and abs(sine.peak_hz - 0.25) < 0.05
    assert lagged is not None and lagged.autocorrelation[0] == pytest.approx(0.3, abs=0.05)
    assert driven is not None and driven.p_cross < 1e-6
    assert driven.cross_largest[0] == pytest.approx(0.2, abs=0.05)
    assert whiteness(np.full(4000, math.nan), u, 0.005) is None


def test_gaps_in_the_samples_do_not_matter():
    rng = np.random.default_rng(5)
    e, u = rng.normal(size=6000), rng.normal(size=6000)
    e[rng.random(6000) < 0.4] = math.nan
    found = whiteness(e, u, 0.005)
    assert found is not None
    assert found.samples == np.isfinite(e).sum()
    assert found.rms == pytest.approx(np.sqrt(np.nanmean(e**2)))
    assert found.p_white > 1e-3 and found.p_cross > 1e-3
    assert found.outside < 0.1


def test_filtered_states_start_predictions_better_than_local_fits():
    """Against the simulator's own velocities, and in the errors that follow."""
    recording, made = recorded(40)
    found = validate(recording, RIG, NOISE)
    rows = np.arange(1000, len(recording), 1000)
    filtered = found.trace.state[rows, 2] - made.truth[rows, 3]
    assert np.sqrt(np.mean(filtered**2)) < 2e-3
    local = replay(recording, RIG)
    assert found.replay.prediction_errors["theta_l"].rms < local.prediction_errors["theta_l"].rms
    # As good as restarts from the truth itself.
    truth = np.column_stack(
        [made.truth[:, 0] - made.truth[:, 2], made.truth[:, 1], made.truth[:, 3], made.truth[:, 2]]
    )
    every = np.arange(0, len(recording), 1000)
    best = channel_errors(recording, run_pieces(recording, RIG, every, truth[every]))
    for name, error in found.replay.prediction_errors.items():
        assert error.rms < 1.2 * best[name].rms


def test_encoders_zeroed_apart_are_no_error():
    recording, _ = recorded(41)
    assert recording.theta_u is not None
    shifted = replace(recording, theta_u=recording.theta_u + 0.05)
    plain, moved = validate(recording, RIG, NOISE), validate(shifted, RIG, NOISE)
    assert moved.start[4] - plain.start[4] == pytest.approx(-0.05, abs=2e-3)
    assert moved.verdict == plain.verdict
    for name, error in plain.replay.errors.items():
        assert moved.replay.errors[name].rms == pytest.approx(error.rms, rel=0.02)


def test_a_gap_is_bridged_by_a_new_start():
    recording, _ = recorded(30)
    rows = np.r_[0:2000, 2400:5000]
    angles = {name: recording.channel(name)[rows] for name in ("t", "u", "theta_u", "theta_l")}
    found = validate(replace(recording, **angles), RIG, NOISE)
    assert found.verdict == "white"
    assert found.replay.errors["theta_l"].rms < 0.05


def test_noise_is_found_on_the_recording_itself():
    found = validate(recorded(42)[0], RIG)
    assert found.noise_estimated
    assert found.noise.torque_u == pytest.approx(0.02, rel=0.15)
    assert found.noise.torque_l == pytest.approx(2e-4, rel=0.35)
    quiet = validate(recorded(42, torque_u=0.0)[0], RIG)
    assert quiet.noise.torque_u < 1e-4
    assert quiet.replay.errors["theta_l"].rms < 2.0 * STEP


def test_constant_voltage_and_one_channel_are_judged_too():
    recording, _ = recorded(43, volts=np.full(3000, 3.0))
    found = validate(replace(recording, theta_u=None), RIG, NOISE)
    assert list(found.residuals) == ["theta_l"]
    assert list(found.replay.prediction_errors) == ["theta_l"]
    assert math.isnan(found.residuals["theta_l"].p_cross)
    assert found.as_dict()["residuals"]["theta_l"]["voltage"] is None
    with pytest.raises(InputError, match="runs away"):
        validate(recorded(30)[0], RIG.replace(bl=-0.5), NOISE)
    with pytest.raises(InputError, match="no column"):
        validate(replace(recording, u=None), RIG, NOISE)


def test_page_and_summary_hold_what_was_found(tmp_path):
    fit, held = recorded(44, 15.0)[0], replace(recorded(45, 15.0)[0], source="<b>held & out</b>")
    estimate = identify([fit], RIG, fixed={"Ju": RIG.Ju}, options=FitOptions(limit=20))
    found = validate_estimate(estimate, [held])
    assert [v.noise_estimated for v in found] == [False, False]
    page = tmp_path / "page.html"
    save_validation_page(estimate, found, page)
    text = page.read_text(encoding="utf-8")
    # Names of files are shown, not obeyed, and nothing is fetched.
    assert "<b>held" not in text
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=", text)
    summary = json.loads(json.dumps(validation_summary(estimate, found), allow_nan=False))
    assert [entry["role"] for entry in summary["recordings"]] == ["fit", "held out"]
    for entry, validation in zip(summary["recordings"], found, strict=True):
        assert entry["verdict"] == validation.verdict
        assert entry["errors"]["theta_l"]["rms"] == validation.replay.errors["theta_l"].rms
    assert 0.0 < summary["friction_curve"]["half_width_percent_of_peak"] < 20.0
