"""Signals: limits, seeds, closed forms and the one-line form."""

from __future__ import annotations

import json
import shlex

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drill_env import InputError
from drill_env.cli.main import app
from drill_env.recordings import SIGNAL_KINDS, Signal, parse_signal, signal_samples


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(SIGNAL_KINDS),
    seconds=st.floats(0.5, 60),
    rate=st.sampled_from([20.0, 50.0, 200.0, 1000.0]),
    limit=st.floats(0.5, 24),
    offset=st.none() | st.floats(-0.4, 0.4),
    seed=st.integers(0, 2**31),
)
def test_every_signal_keeps_the_limit_and_repeats_from_its_line(
    kind, seconds, rate, limit, offset, seed
):
    random = {"seed": seed} if kind in ("quasi-random", "steps") else {}
    level = None if offset is None else offset * limit
    signal = Signal(kind, seconds=seconds, rate=rate, limit=limit, offset=level, **random)
    t, u = signal_samples(signal)
    assert len(t) == len(u) == round(seconds * rate)
    np.testing.assert_allclose(np.diff(t), 1 / rate, rtol=1e-9)
    assert np.abs(u).max() <= limit
    again = parse_signal(signal.text)
    assert again == signal
    np.testing.assert_array_equal(signal_samples(again)[1], u)


def test_closed_forms():
    t, ramp = signal_samples(Signal("ramp", seconds=10, offset=-2, amplitude=6))
    np.testing.assert_allclose(ramp, -2 + 0.6 * t, atol=1e-12)
    _, curve = signal_samples(Signal("parabolic", seconds=10))
    np.testing.assert_allclose(curve, 0.05 * t**2, atol=1e-12)
    _, wave = signal_samples(Signal("harmonic", seconds=10, offset=1, amplitude=2, frequency=0.5))
    np.testing.assert_allclose(wave, 1 + 2 * np.sin(np.pi * t), atol=1e-12)
    _, level = signal_samples(Signal("constant", seconds=10, offset=-3.5))
    assert set(level) == {-3.5}


def test_a_chirp_runs_from_one_frequency_to_the_other():
    t, u = signal_samples(
        Signal("chirp", seconds=100, offset=0, amplitude=1, frequency=0.5, frequency_end=2)
    )
    rises = t[1:][(u[:-1] <= 0) & (u[1:] > 0)]
    frequency = 1 / np.diff(rises)
    middle = 0.5 * (rises[1:] + rises[:-1])
    np.testing.assert_allclose(frequency, 0.5 + 1.5 * middle / 100, rtol=0.02)


def test_random_levels_are_held_as_long_as_said_and_smoothed_by_the_lag():
    _, steps = signal_samples(Signal("steps", seconds=600, dwell=2.0, seed=4))
    changes = np.flatnonzero(np.diff(steps)) + 1
    holds = np.diff(changes) / 200
    assert holds.min() >= 0.99 and holds.max() <= 3.01
    assert holds.mean() == pytest.approx(2.0, rel=0.05)
    # Uniform over +-5 V.
    assert np.abs(np.mean(steps[changes])) < 0.5
    assert np.std(steps[changes]) == pytest.approx(5 / np.sqrt(3), rel=0.08)
    _, smooth = signal_samples(Signal("quasi-random", seconds=600, dwell=2.0, seed=4))
    u = 0.0
    for i, level in enumerate(steps[:2000]):
        u += (1 - np.exp(-0.005 / 0.25)) * (level - u)
        assert smooth[i] == pytest.approx(u, abs=1e-9)


def test_another_seed_is_another_signal():
    first, second = (signal_samples(Signal("steps", seed=seed))[1] for seed in (1, 2))
    assert not np.array_equal(first, second)


@pytest.mark.parametrize(
    ("kind", "options", "message"),
    [
        ("sawtooth", {}, "signal kind is 'sawtooth'"),
        ("ramp", {"amplitude": 7.0}, "would reach 7 V, more than the limit of 5 V"),
        ("harmonic", {"offset": 4.0, "amplitude": 2.0}, "would reach 6 V"),
        ("constant", {"offset": -5.5}, "limit of 5 V"),
        ("constant", {"frequency": 1.0}, "constant has no --frequency"),
        ("harmonic", {"seed": 3}, "harmonic has no --seed"),
        ("chirp", {"frequency_end": 60.0}, "give --rate 240 or more"),
        ("steps", {"dwell": 0.0}, "--dwell is 0.0"),
        ("ramp", {"seconds": float("nan")}, "--seconds is nan"),
        ("ramp", {"seconds": 1e9}, "samples; give 2 to"),
        ("steps", {"seed": -1}, "--seed is -1"),
    ],
)
def test_bad_signals_give_one_clear_error(kind, options, message):
    with pytest.raises(InputError, match=message):
        Signal(kind, **options)


@pytest.mark.parametrize("line", ["", "chirp --volts 3", "chirp --offset x", "chirp --offset"])
def test_bad_lines_give_one_clear_error(line):
    with pytest.raises(InputError, match="signal"):
        parse_signal(line)


def test_the_command_writes_what_the_line_says(tmp_path, capsys):
    signal = Signal("quasi-random", seconds=5, rate=100, limit=4, seed=3)
    out = tmp_path / "play.csv"
    app(["signal", *shlex.split(signal.text), "--out", str(out), "--json"], standalone_mode=False)
    told = json.loads(capsys.readouterr().out)
    table = pd.read_csv(out)
    t, u = signal_samples(signal)
    np.testing.assert_array_equal(table.t, t)
    np.testing.assert_array_equal(table.u, u)
    assert list(table.columns) == ["t", "u"]
    assert parse_signal(told["signal"]) == signal
    with pytest.raises(InputError, match="limit of 5 V"):
        app(["signal", "constant", "--offset", "6", "--out", str(out)], standalone_mode=False)
    np.testing.assert_array_equal(pd.read_csv(out).u, u)
