"""Recordings made without the package: own equations, own integrator, own noise.

Fixed Runge-Kutta substeps that end exactly where a disc's velocity vanishes; each disc sticks,
slips or reverses by the torque on it there. Torque noise is an Ornstein-Uhlenbeck process drawn at
every substep, finer than any recording samples it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.signal import lfilter

Array = NDArray[np.float64]

ORDER = ("km", "Ju", "Tsu", "dTsu", "bu", "dbu", "Jl", "ktheta", "Tsl", "T1", "T2", "beta1",
         "beta2", "bl")  # fmt: skip


@njit(cache=True)
def _brake(q, speed):
    first = 1.0 - 2.0 / (1.0 + math.exp(q[11] * speed))
    second = 1.0 - 2.0 / (1.0 + math.exp(q[12] * speed))
    return q[8] + q[9] * first + q[10] * second + q[13] * speed


@njit(cache=True)
def _pull(q, x, u, nu, nl):
    """Torques on the discs without their friction."""
    return q[0] * u + nu - q[7] * (x[0] - x[2]), q[7] * (x[0] - x[2]) + nl


@njit(cache=True)
def _rate(q, x, s, u, nu, nl, out):
    upper, lower = _pull(q, x, u, nu, nl)
    out[0], out[2] = x[1], x[3]
    out[1] = 0.0
    out[3] = 0.0
    if s[0] != 0:
        out[1] = (upper - s[0] * q[2] - q[3] - (q[4] + s[0] * q[5]) * x[1]) / q[1]
    if s[1] != 0:
        out[3] = (lower - s[1] * _brake(q, s[1] * x[3])) / q[6]


@njit(cache=True)
def _step(q, x, s, u, nu, nl, h, k, y):
    """Classical Runge-Kutta step of `h` s from `x` into `y`."""
    _rate(q, x, s, u, nu, nl, k[0])
    for i in range(4):
        y[i] = x[i] + 0.5 * h * k[0, i]
    _rate(q, y, s, u, nu, nl, k[1])
    for i in range(4):
        y[i] = x[i] + 0.5 * h * k[1, i]
    _rate(q, y, s, u, nu, nl, k[2])
    for i in range(4):
        y[i] = x[i] + h * k[2, i]
    _rate(q, y, s, u, nu, nl, k[3])
    for i in range(4):
        y[i] = x[i] + h * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i]) / 6.0


@njit(cache=True)
def _choose(q, x, s, u, nu, nl):
    """Slip directions of discs at rest."""
    upper, lower = _pull(q, x, u, nu, nl)
    if x[1] == 0.0:
        drive = upper - q[3]
        s[0] = 0 if abs(drive) <= q[2] else (1 if drive > 0 else -1)
    if x[3] == 0.0:
        s[1] = 0 if abs(lower) <= q[8] else (1 if lower > 0 else -1)


@njit(cache=True)
def _substep(q, x, s, u, nu, nl, h, k, y):
    left = h
    for _ in range(20):
        _choose(q, x, s, u, nu, nl)
        _step(q, x, s, u, nu, nl, left, k, y)
        first, disc = left, -1
        for d in range(2):
            row = 1 + 2 * d
            if s[d] != 0 and s[d] * y[row] < 0.0:
                low, high = 0.0, first
                for _ in range(60):
                    middle = 0.5 * (low + high)
                    _step(q, x, s, u, nu, nl, middle, k, y)
                    if s[d] * y[row] < 0.0:
                        high = middle
                    else:
                        low = middle
                first, disc = high, d
                _step(q, x, s, u, nu, nl, first, k, y)
        for i in range(4):
            x[i] = y[i]
        if disc >= 0:
            x[1 + 2 * disc] = 0.0
        left -= first
        if left <= 1e-15:
            return


@njit(cache=True)
def _run(q, start, u, dt, substeps, noise_u, noise_l, out):
    x = start.copy()
    s = np.zeros(2, dtype=np.int64)
    for d in range(2):
        s[d] = 1 if x[1 + 2 * d] > 0 else -1
    k, y = np.zeros((4, 4)), np.zeros(4)
    for i in range(u.size):
        out[i] = x
        for j in range(substeps):
            m = i * substeps + j
            _substep(q, x, s, u[i], noise_u[m], noise_l[m], dt / substeps, k, y)


@dataclass(frozen=True)
class MadeRecording:
    """Times, voltage, counted angles and the truth behind them."""

    t: Array
    u: Array
    theta_u: Array
    theta_l: Array
    truth: Array


def coloured(rng: np.random.Generator, n: int, dt: float, sigma: float, tau: float) -> Array:
    """An Ornstein-Uhlenbeck series of standard deviation `sigma` and correlation time `tau`."""
    decay = math.exp(-dt / tau)
    draws = rng.normal(0.0, 1.0, n) * sigma * math.sqrt(1.0 - decay * decay)
    draws[:1] = rng.normal(0.0, sigma, min(n, 1)) if sigma > 0 else 0.0
    return np.asarray(lfilter([1.0], [1.0, -decay], draws), dtype=np.float64)


def make(
    values: dict[str, float],
    u: Array,
    rate: float = 200.0,
    *,
    seed: int = 0,
    torque_u: float = 0.0,
    torque_l: float = 0.0,
    tau: float = 0.1,
    counts: int = 8192,
    start: Array | None = None,
    substeps: int = 10,
) -> MadeRecording:
    """Play voltages `u`, each held for a sample, to a rig and read its encoders."""
    rng = np.random.default_rng(seed)
    dt = 1.0 / rate
    n = len(u) * substeps
    out = np.zeros((len(u), 4))
    q = np.array([values[name] for name in ORDER])
    x = np.zeros(4) if start is None else np.asarray(start, dtype=float)
    noise_u = coloured(rng, n, dt / substeps, torque_u, tau)
    noise_l = coloured(rng, n, dt / substeps, torque_l, tau)
    _run(q, x, np.ascontiguousarray(u), dt, substeps, noise_u, noise_l, out)
    step = 2.0 * math.pi / counts
    theta = np.round(out[:, [0, 2]] / step) * step
    return MadeRecording(np.arange(len(u)) * dt, u, theta[:, 0], theta[:, 1], out)


def make_closed_loop(
    values: dict[str, float],
    law: Callable[[int, float, float], float],
    samples: int,
    rate: float = 200.0,
    *,
    seed: int = 0,
    torque_u: float = 0.0,
    torque_l: float = 0.0,
    tau: float = 0.1,
    counts: int = 8192,
    substeps: int = 10,
) -> MadeRecording:
    """As `make`, with the voltage of sample k from `law(k, theta_u, theta_l)`, angles as read."""
    rng = np.random.default_rng(seed)
    dt, step = 1.0 / rate, 2.0 * math.pi / counts
    q = np.array([values[name] for name in ORDER])
    noise_u = coloured(rng, samples * substeps, dt / substeps, torque_u, tau)
    noise_l = coloured(rng, samples * substeps, dt / substeps, torque_l, tau)
    truth, u = np.zeros((samples, 4)), np.zeros(samples)
    x, after = np.zeros(4), np.zeros((2, 4))
    for k in range(samples):
        truth[k] = x
        theta = np.round(x[[0, 2]] / step) * step
        u[k] = law(k, float(theta[0]), float(theta[1]))
        part = slice(k * substeps, (k + 1) * substeps)
        noises = _padded(noise_u[part], substeps), _padded(noise_l[part], substeps)
        _run(q, x, np.array([u[k], 0.0]), dt, substeps, *noises, after)
        x = after[1].copy()
    theta = np.round(truth[:, [0, 2]] / step) * step
    return MadeRecording(np.arange(samples) * dt, u, theta[:, 0], theta[:, 1], truth)


def _padded(noise: Array, substeps: int) -> Array:
    """Noise for two samples, the second of which is run for nothing."""
    return np.pad(noise, (0, substeps))


def quasi_random(rng: np.random.Generator, seconds: float, rate: float, top: float) -> Array:
    """Twelve sines of random phase below 0.4 Hz, scaled to +-`top` V."""
    t = np.arange(round(seconds * rate)) / rate
    frequencies = rng.uniform(0.01, 0.4, 12)
    phases = rng.uniform(0.0, 2.0 * np.pi, 12)
    wave = np.sin(2.0 * np.pi * np.outer(t, frequencies) + phases).sum(axis=1)
    return np.clip(wave / np.abs(wave).max() * top, -top, top)
