"""Readings that have nothing to do with the rig get no name."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.follows import (
    contradict,
    follow,
    only_if_they_follow,
    shares_of_movement,
)
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.rounds import Found
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.recordings import Recording

ROWS, SPANS = 50, 12


def judged(measured: np.ndarray, short: np.ndarray, channels=("theta_u", "theta_l")) -> Any:
    spans = np.arange(0, len(measured), ROWS)
    return SimpleNamespace(measured=measured, short=short, spans=spans, channels=channels)


def walk(seed: int) -> np.ndarray:
    steps = np.random.default_rng(seed).standard_normal((SPANS * ROWS, 2))
    return np.cumsum(steps, axis=0)


def still(readings: np.ndarray) -> np.ndarray:
    means = readings.reshape(SPANS, ROWS, 2).mean(axis=1)
    return np.repeat(means, ROWS, axis=0)


def found(*names: str) -> Found:
    terms = tuple(Term(Named(LIBRARY[n]), np.zeros(0)) for n in names)
    final: Any = SimpleNamespace(terms=terms)
    base: Any = SimpleNamespace(terms=())
    setting: Any = None
    return Found(setting, base, (), final)


def test_the_share_is_of_the_movement_about_each_span_s_mean():
    readings = walk(1)
    about = readings - still(readings)
    for share, error in shares_of_movement([judged(readings, readings - 0.5 * about)]):
        # The same in each span, so that leaving one out changes nothing.
        assert share == pytest.approx(0.75) and error == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_noise_follows_nothing_and_what_is_half_predicted_follows(seed):
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((SPANS * ROWS, 2))
    one = judged(noise, np.zeros_like(noise))
    assert not follow([one]) and not contradict([one])
    far = judged(noise, 3.0 * rng.standard_normal(noise.shape))
    assert not follow([far]) and contradict([far])
    moved = walk(seed)
    half = judged(moved, still(moved) + 0.3 * (moved - still(moved)))
    assert follow([half]) and not contradict([half])


def test_steady_speed_that_is_read_as_speed_is_movement():
    """A disc that stands still has no speed; its angle may be any."""
    speed = 5.0 + 0.1 * np.random.default_rng(0).standard_normal((SPANS * ROWS, 2))
    short = np.full_like(speed, 5.1)
    assert follow([judged(speed, short, ("omega_u", "omega_l"))])
    assert not follow([judged(speed, short)])


def test_one_reading_is_enough_and_runs_that_fail_tell_nothing():
    readings = walk(2)
    short = still(readings)
    short[:, 1] = readings[:, 1]
    assert follow([judged(readings, short)])
    assert follow([judged(readings, np.full_like(readings, np.inf))])
    assert follow([]) and not contradict([])


def test_names_are_rejected_where_nothing_follows_the_rig():
    noise = np.random.default_rng(4).standard_normal((SPANS * ROWS, 2))
    resting, right = judged(noise, np.zeros_like(noise)), judged(noise, noise)
    kept = only_if_they_follow(found("wear"), [resting], [right])
    assert kept.follows and kept.final.terms and kept.refuted is None
    for before, follows in ((resting, False), (right, True)):
        left = only_if_they_follow(found("wear"), [before], [resting])
        assert left.rejected == ("wear",) and not left.final.terms and left.follows == follows


def test_a_rig_that_rests_as_predicted_is_not_contradicted():
    noise = np.random.default_rng(4).standard_normal((SPANS * ROWS, 2))
    assert only_if_they_follow(found(), [], [judged(noise, np.zeros_like(noise))]).follows
    assert not only_if_they_follow(found(), [], [judged(noise, noise + 9.0)]).follows


@pytest.mark.filterwarnings("ignore::drill_env.recordings.RecordingWarning")
def test_white_noise_gets_no_name():
    rng = np.random.default_rng(3)
    t = np.arange(0.0, 15.0, 0.04)

    def recording() -> Recording:
        volts = np.repeat(rng.uniform(1.0, 5.0, 15), 25)
        return Recording(t, volts, *rng.standard_normal((2, len(t))))

    result = diagnose(
        [recording()], Rig(), [recording()], options=DiagnosisOptions(most=1)
    ).result  # fmt: skip
    assert result.verdict == "unexplained" and not result.effects and result.located is None
    assert result.fit["follows"] is False
    assert result.sentences[0].startswith("The recordings do not follow the rig")
