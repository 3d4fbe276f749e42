"""Encoders and velocity filters against closed forms and SciPy."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, lfilter, lfilter_zi

from drill_env import InputError
from drill_env.sensors import Encoder, filter_velocity, read_encoder


def turning(seconds=20.0, rate=100.0):
    t = np.arange(round(seconds * rate)) / rate
    return t, 3.0 * t + 2.0 * np.sin(1.55 * t) - 40.0


@settings(deadline=None)
@given(st.integers(1, 10**6), st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=40))
def test_quantised_angles_are_whole_counts_within_half_a_count(counts, angles):
    encoder = Encoder(counts_per_rev=counts)
    seen = read_encoder(np.array(angles), encoder)
    assert np.abs(seen - angles).max() <= encoder.quantum * 0.5 + 1e-9
    assert np.abs(seen / encoder.quantum - np.round(seen / encoder.quantum)).max() < 1e-6
    assert np.array_equal(read_encoder(seen + 1e-12 * encoder.quantum, encoder), seen)


def test_no_counts_is_exact():
    _, theta = turning()
    assert np.array_equal(read_encoder(theta, Encoder(counts_per_rev=0)), theta)


@pytest.mark.parametrize(("rate", "cutoff"), [(100.0, 5.0), (1000.0, 20.0), (20.0, 8.0)])
def test_filter_is_scipys_lfilter_on_backward_differences(rate, cutoff):
    _, theta = turning(rate=rate)
    encoder = Encoder(rate_hz=rate, cutoff_hz=cutoff)
    b, a = butter(2, cutoff, fs=rate)
    for start in (0.0, 6.1, -2.0):
        difference = np.diff(theta, prepend=theta[0] - start / rate) * rate
        wanted, _ = lfilter(b, a, difference, zi=start * lfilter_zi(b, a))
        found = filter_velocity(theta, encoder, start)
        assert np.abs(found - wanted).max() < 1e-9


def test_start_velocity_defaults_to_rest_and_holds_a_steady_one():
    encoder = Encoder(counts_per_rev=0)
    t = np.arange(200) / 100.0
    assert np.abs(filter_velocity(5.0 * t, encoder, 5.0) - 5.0).max() < 1e-12
    assert np.array_equal(filter_velocity(5.0 * t, encoder), filter_velocity(5.0 * t, encoder, 0.0))
    assert filter_velocity(np.zeros(0), encoder).shape == (0,)


def gain(frequency, encoder):
    """Gain of the whole chain on omega = cos(2 pi f t), by fit to the settled part."""
    rate = encoder.rate_hz
    t = np.arange(round(40 * rate)) / rate
    pulse = 2.0 * np.pi * frequency
    omega = filter_velocity(np.sin(pulse * t) / pulse, encoder)[len(t) // 2 :]
    basis = np.column_stack([np.cos(pulse * t), np.sin(pulse * t)])[len(t) // 2 :]
    return float(np.hypot(*np.linalg.lstsq(basis, omega, rcond=None)[0]))


@pytest.mark.parametrize(("rate", "cutoff"), [(100.0, 5.0), (1000.0, 5.0), (400.0, 30.0)])
def test_gain_is_one_at_rest_and_3_db_down_at_the_cutoff(rate, cutoff):
    encoder = Encoder(counts_per_rev=0, rate_hz=rate, cutoff_hz=cutoff)
    b, a = encoder.coefficients()
    assert b.sum() / a.sum() == pytest.approx(1.0, abs=1e-12)
    assert gain(1e-3, encoder) == pytest.approx(1.0, abs=1e-6)
    # The backward difference itself is a sinc over one sample.
    assert gain(cutoff, encoder) == pytest.approx(np.sqrt(0.5) * np.sinc(cutoff / rate), rel=1e-6)
    assert gain(4 * cutoff, encoder) < 0.065


def test_delay_is_whole_samples_and_holds_the_first_angle():
    _, theta = turning()
    for delay, late in ((0.05, 5), (0.004, 0), (0.006, 1)):
        seen = read_encoder(theta, Encoder(counts_per_rev=0, delay_s=delay))
        assert np.array_equal(seen[late:], theta[: len(theta) - late])
        assert np.all(seen[:late] == theta[0])
    assert np.all(read_encoder(theta[:3], Encoder(counts_per_rev=0, delay_s=1.0)) == theta[0])


def test_missed_counts_are_lost_for_good_at_their_rate():
    t = np.arange(4000) / 100.0
    exact = Encoder(counts_per_rev=1000)
    worn = dataclasses.replace(exact, missed_per_count=0.01)
    whole = read_encoder(2.0 * t, exact)
    lost = (whole - read_encoder(2.0 * t, worn, np.random.default_rng(0))) / exact.quantum
    assert (np.diff(lost) > -1e-6).all()
    expected = 0.01 * whole[-1] / exact.quantum
    assert lost[-1] == pytest.approx(expected, abs=4 * np.sqrt(expected))
    there_and_back = np.concatenate([2.0 * t, 2.0 * t[::-1]])
    dead = dataclasses.replace(exact, missed_per_count=1.0)
    assert np.ptp(read_encoder(there_and_back, dead, np.random.default_rng(0))) == 0.0


def test_noise_has_its_deviation_and_follows_the_seed():
    _, theta = turning(seconds=200.0)
    noisy = Encoder(counts_per_rev=0, noise_rad=0.01)
    first, again, other = (read_encoder(theta, noisy, np.random.default_rng(s)) for s in (1, 1, 2))
    assert np.array_equal(first, again) and not np.array_equal(first, other)
    assert (first - theta).std() == pytest.approx(0.01, rel=0.03)
    assert abs((first - theta).mean()) < 4 * 0.01 / np.sqrt(len(theta))
    with pytest.raises(InputError, match=r"numpy\.random\.default_rng"):
        read_encoder(theta, noisy)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"counts_per_rev": -1}, "counts_per_rev"),
        ({"noise_rad": float("nan")}, "noise_rad"),
        ({"delay_s": -0.1}, "delay_s"),
        ({"missed_per_count": 1.1}, "give 0 to 1"),
        ({"rate_hz": 0.0}, "rate greater than 0"),
        ({"cutoff_hz": 50.0}, "half the sample rate"),
        ({"cutoff_hz": 0.0}, "half the sample rate"),
    ],
)
def test_bad_encoders_name_the_field_and_the_remedy(options, text):
    with pytest.raises(InputError, match=next(iter(options))) as caught:
        Encoder(**options)
    assert text in str(caught.value)


def test_lost_counts_are_binomial():
    """Every draw against SciPy's quantile function."""
    from scipy.stats import binom

    from drill_env.sensors.kernels import lose_counts

    rng = np.random.default_rng(3)
    for moved, chance in ((1, 0.3), (40, 0.01), (170, 1e-3), (170, 0.5), (3000, 0.02)):
        uniforms = rng.random(400)
        counts = np.cumsum(np.full(400, float(moved)))
        expected = counts - np.cumsum(np.r_[0.0, binom.ppf(uniforms[1:], moved, chance)])
        lose_counts(counts, chance, uniforms)
        np.testing.assert_array_equal(counts, expected)


def test_the_environment_reads_the_same_encoder():
    """Its readings of one turning disc lose as many counts, with the same spread."""
    from drill_env.environment._records import ROW, SETTING
    from drill_env.environment._sensing import spoil

    encoder, rng = Encoder(missed_per_count=0.02), np.random.default_rng(5)
    setting, lost = np.zeros(1, dtype=SETTING), []
    setting["quantum"], setting["missed"] = encoder.quantum, encoder.missed_per_count
    theta = 50.3 * encoder.quantum * np.arange(60.0)
    for _ in range(300):
        row, seen = np.zeros(1, dtype=ROW), 0.0
        for angle in theta[1:]:
            seen = spoil(row[0], 1, angle, rng.random(4), setting[0])
            seen = np.floor(seen / encoder.quantum + 0.5) * encoder.quantum
            row["measured"][0, 1] = seen
        series = read_encoder(theta, encoder, rng)
        lost.append([(theta[-1] - last) / encoder.quantum for last in (seen, series[-1])])
    moved = 50.3 * 59
    mean, variance = np.mean(lost, axis=0), np.var(lost, axis=0)
    np.testing.assert_allclose(mean, 0.02 * moved, rtol=0.05)
    np.testing.assert_allclose(variance, 0.02 * 0.98 * moved, rtol=0.25)
