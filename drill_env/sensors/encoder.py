"""Incremental encoders and the velocities the rig derives from them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drill_env._checks import real
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.sensors.kernels import filter_series, lose_counts, start_filter

# Counters have 32 bits, noise of a turn leaves nothing to read, and a delay of two swings of the
# string is longer than any loop's.
_LARGEST = {"counts_per_rev": 2.0**32, "noise_rad": 6.3, "delay_s": 10.0, "missed_per_count": 1.0}
# Hz: a loop of the longest period then holds 20 000 samples of each environment.
_FASTEST = 1e5


@dataclass(frozen=True, slots=True)
class Encoder:
    """Incremental encoders on both discs.

    Args:
        counts_per_rev: counts per revolution; 0 reads the exact angle.
        rate_hz: samples per second, at which velocities are differentiated.
        cutoff_hz: -3 dB frequency of the causal second-order Butterworth low-pass that
            follows the differentiation (Section 2.1 of the paper names no figure).
        noise_rad: standard deviation of the angle before quantisation, rad.
        delay_s: age of the sample that is read, s; rounded to whole samples.
        missed_per_count: probability that a count is lost for good.

    Raises:
        InputError: a value is out of range.
    """

    counts_per_rev: int = 8192
    rate_hz: float = 100.0
    cutoff_hz: float = 5.0
    noise_rad: float = 0.0
    delay_s: float = 0.0
    missed_per_count: float = 0.0

    def __post_init__(self) -> None:
        for name in ("counts_per_rev", "noise_rad", "delay_s", "missed_per_count"):
            value = real(getattr(self, name), f"encoder {name}")
            if not 0 <= value <= _LARGEST[name]:
                raise InputError(f"encoder {name} is {value}: give 0 to {_LARGEST[name]:g}")
        real(self.cutoff_hz, "encoder cutoff_hz")
        if not 0 < real(self.rate_hz, "encoder rate_hz") <= _FASTEST:
            raise InputError(
                f"encoder rate_hz is {self.rate_hz}: give a rate greater than 0, to {_FASTEST:g}"
            )
        if not 0 < self.cutoff_hz < 0.5 * self.rate_hz:
            raise InputError(
                f"encoder cutoff_hz is {self.cutoff_hz}: give a frequency between 0 and half "
                f"the sample rate, {0.5 * self.rate_hz:g} Hz"
            )

    @property
    def quantum(self) -> float:
        """Angle of one count, rad; 0 if exact."""
        return 2.0 * math.pi / self.counts_per_rev if self.counts_per_rev else 0.0

    @property
    def is_random(self) -> bool:
        """Whether reading it needs random numbers."""
        return self.noise_rad > 0.0 or self.missed_per_count > 0.0

    def coefficients(self) -> tuple[FloatArray, FloatArray]:
        """Numerator and denominator (three each) of the low-pass at `rate_hz`."""
        # Half a second, which who reads the exact angle need not wait.
        from scipy.signal import butter

        b, a = butter(2, self.cutoff_hz, fs=self.rate_hz)
        return np.ascontiguousarray(b), np.ascontiguousarray(a)


def read_encoder(
    theta: FloatArray, encoder: Encoder, rng: np.random.Generator | None = None
) -> FloatArray:
    """Angles as the encoder reports them.

    Args:
        theta: exact angles in rad, sampled at `encoder.rate_hz`, shape (n,).
        encoder: resolution, noise, delay and missed counts.
        rng: needed if the encoder is random.

    Returns:
        Quantised angles in rad, shape (n,).

    Raises:
        InputError: the encoder is random and no generator is given.
    """
    theta = np.asarray(theta, dtype=float)
    if encoder.is_random and rng is None:
        raise InputError("a noisy encoder needs rng: pass numpy.random.default_rng(seed)")
    late = round(encoder.delay_s * encoder.rate_hz)
    if late and len(theta):
        theta = np.concatenate([np.full(min(late, len(theta)), theta[0]), theta[:-late]])
    if rng is not None and encoder.noise_rad > 0:
        theta = theta + rng.normal(0.0, encoder.noise_rad, theta.shape)
    quantum = encoder.quantum
    if quantum == 0.0:
        return theta.copy()
    counts = np.floor(theta / quantum + 0.5)
    if rng is not None and encoder.missed_per_count > 0 and len(counts):
        lose_counts(counts, encoder.missed_per_count, rng.random(counts.shape))
    return np.asarray(counts * quantum, dtype=np.float64)


def filter_velocity(
    theta: FloatArray, encoder: Encoder, omega_start: float | None = None
) -> FloatArray:
    """Velocities as the rig derives them: backward difference and causal low-pass.

    Args:
        theta: measured angles in rad at `encoder.rate_hz`, shape (n,).
        encoder: rate and cut-off.
        omega_start: velocity in rad/s the filter starts settled at; 0 by default.

    Returns:
        Velocities in rad/s, shape (n,).
    """
    theta = np.ascontiguousarray(theta, dtype=float)
    out = np.empty_like(theta)
    if len(theta) == 0:
        return out
    b, a = encoder.coefficients()
    memory = np.zeros(3)
    omega = 0.0 if omega_start is None else float(omega_start)
    start_filter(memory, theta[0] - omega / encoder.rate_hz, omega, b, a)
    filter_series(theta, memory, encoder.rate_hz, b, a, out)
    return out
