"""The rig with any effect concealed in it: fixed Runge-Kutta substeps, stopped at every event.

A substep ends where a slipping disc's velocity vanishes and where a stuck disc's torque outgrows
its hold, both found by bisection; at rest a disc sticks, slips or reverses by the torque on it.
Shares no code with the package.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from benchmarks.concealed.fields import (
    AGE,
    ANCHOR,
    BEND,
    HOLD,
    N_HELD,
    N_STATES,
    N_STEPPED,
    TH_L,
    TH_M,
    TH_S,
    TH_U,
    W_L,
    W_M,
    W_S,
    W_U,
    substeps_for,
)
from benchmarks.concealed.held import amplify, held_voltage, hold, remember
from benchmarks.concealed.torques import bend, loads, lower_friction, margin, rates, upper_friction

Array = NDArray[np.float64]


@njit(cache=True)
def _step(q, x, s, a, h, k, y):
    """Classical Runge-Kutta step of `h` s from `x` into `y`."""
    rates(q, x, s, a, k[0])
    for i in range(N_STEPPED, N_STATES):
        y[i] = x[i]
    for stage in range(3):
        part = h if stage == 2 else 0.5 * h
        for i in range(N_STEPPED):
            y[i] = x[i] + part * k[stage, i]
        rates(q, y, s, a, k[stage + 1])
    for i in range(N_STEPPED):
        y[i] = x[i] + h * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i]) / 6.0


@njit(cache=True)
def _choose(q, x, s, a):
    """Slip directions of discs at rest."""
    upper, lower, top, _, _ = loads(q, x, a)
    if x[W_U] == 0.0:
        s[0] = 0
        if upper > upper_friction(q, x, a, 1.0, 0.0, top):
            s[0] = 1
        elif -upper > upper_friction(q, x, a, -1.0, 0.0, top):
            s[0] = -1
    if q.presliding > 0.0:
        if x[W_L] == 0.0:
            # Bristles hold by bending: the disc never sticks, it turns round.
            x[BEND], x[ANCHOR] = bend(q, x, s[1] if s[1] != 0 else 1), x[TH_L]
            s[1] = 1 if lower >= x[BEND] * lower_friction(q, x, a, 1.0, 0.0) else -1
    elif x[W_L] == 0.0:
        s[1] = 0
        if lower > lower_friction(q, x, a, 1.0, 0.0) + a[HOLD]:
            s[1] = 1
        elif -lower > lower_friction(q, x, a, -1.0, 0.0) + a[HOLD]:
            s[1] = -1


@njit(cache=True)
def _advance(q, x, s, a, h, k, y):
    left = h
    for _ in range(50):
        _choose(q, x, s, a)
        _step(q, x, s, a, left, k, y)
        first, disc = left, -1
        for d in range(2):
            if margin(q, y, s, a, d) < 0.0:
                low, high = 0.0, first
                for _ in range(45):
                    middle = 0.5 * (low + high)
                    _step(q, x, s, a, middle, k, y)
                    if margin(q, y, s, a, d) < 0.0:
                        high = middle
                    else:
                        low = middle
                first, disc = high, d
                _step(q, x, s, a, first, k, y)
        for i in range(N_STEPPED):
            x[i] = y[i]
        for d in range(2):
            row = W_U if d == 0 else W_L
            # A speed that rounding leaves at the event itself is none.
            if s[d] != 0 and (d == disc or s[d] * x[row] < 0.0):
                x[row] = 0.0
        left -= first
        if left <= 1e-15:
            return
    # Events without end are a disc at the very edge of its hold: it stays.
    for d in range(2):
        if x[W_U if d == 0 else W_L] == 0.0:
            s[d] = 0
    _step(q, x, s, a, left, k, y)
    for i in range(N_STEPPED):
        x[i] = y[i]


@njit(cache=True)
def _run(q, x, s, times, u, first, last, substeps, noise_u, noise_l, out, kept, every):
    k, y, a = np.zeros((4, N_STEPPED)), np.zeros(N_STATES), np.zeros(N_HELD)
    for i in range(first, last):
        out[i - first] = x[:4]
        if kept.shape[0] > 0 and i % every == 0:
            kept[i // every, :N_STATES] = x
            kept[i // every, N_STATES] = s[0]
            kept[i // every, N_STATES + 1] = s[1]
        h = (times[i + 1] - times[i]) / substeps
        for j in range(substeps):
            t = times[i] + j * h
            v = u[i]
            if q.input_delay > 0.0:
                v = held_voltage(times, u, t + 0.5 * h - q.input_delay, i)
            noisy = noise_u.size > 0
            nu = noise_u[i * substeps + j] if noisy else 0.0
            nl = noise_l[i * substeps + j] if noisy else 0.0
            hold(q, x, a, t, h, amplify(q, x, v, h), nu, nl)
            _advance(q, x, s, a, h, k, y)
            remember(q, x, s, a, h)


@dataclass(frozen=True)
class Played:
    """States at each sample, and whole states at every so many samples to start again from.

    Attributes:
        times: true instants of the samples and the end of the last one, s, shape (n + 1,).
        states: theta_u, omega_u, theta_l, omega_l, shape (n, 4).
        kept: whole states and slip directions, shape (n // every + 1, 23).
        every: samples between them.
    """

    times: Array
    states: Array
    kept: Array
    every: int


def play(
    record: np.ndarray,
    u: Array,
    times: Array,
    noise: tuple[Array, Array] | None = None,
    *,
    twist: float = 0.0,
    substeps: int | None = None,
    every: int = 1000,
) -> Played:
    """Play held voltages to a rig at rest.

    Args:
        record: from `plant_record`.
        u: V, `u[i]` held from `times[i]` to `times[i + 1]`, shape (n,).
        times: s, shape (n + 1,).
        noise: torques on the discs held over each substep, Nm, shape (n * substeps,) each.
        twist: of the string at the start, rad.
        substeps: a sample; as many as the plant needs by default.
        every: samples between the whole states that are kept.
    """
    steps = substeps or substeps_for(record, float(np.median(np.diff(times))))
    x, s = np.zeros(N_STATES), np.zeros(2, dtype=np.int64)
    x[TH_U] = x[TH_M] = twist
    x[TH_S] = 0.5 * twist
    x[W_M] = x[W_S] = 0.0
    x[AGE] = 1.0
    out = np.zeros((len(u), 4))
    kept = np.zeros(((len(u) - 1) // every + 1, N_STATES + 2))
    none = np.zeros(0)
    nu, nl = noise or (none, none)
    _run(record[0], x, s, times, u, 0, len(u), steps, nu, nl, out, kept, every)
    return Played(times, out, kept, every)


def predict_again(record: np.ndarray, u: Array, played: Played, substeps: int) -> Array:
    """States when restarted without noise from every kept one, shape (n, 4)."""
    found = np.zeros_like(played.states)
    none = np.zeros(0)
    for w, row in enumerate(played.kept):
        first = w * played.every
        last = min(first + played.every, len(u))
        x, s = row[:N_STATES].copy(), row[N_STATES:].astype(np.int64)
        _run(record[0], x, s, played.times, u, first, last, substeps, none, none,
             found[first:last], np.zeros((0, 0)), played.every)  # fmt: skip
    return found
