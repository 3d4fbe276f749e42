"""Compiled loop of the adaptive controllers: a filter and a regulator for every rig."""

from typing import NamedTuple

import numpy as np

from drill_env._jit import entry, kernel
from drill_env.friction.kernels import lower_sliding, lower_slope

from ._filter import (
    DELAY,
    FREE,
    FRICTION,
    N_FREE,
    N_TOP,
    OFFSET,
    SUBSTEPS,
    N,
    correct,
    is_sound,
    predict_covariance,
    predict_state,
    set_plant,
    start_filter,
)

_NIS_SHARE = 0.02


class Knobs(NamedTuple):
    """Numbers of the filter and the regulator that are the same for all rigs."""

    effort: float
    slip: float
    noise: float
    period: float
    lag: float
    spread: float
    alarm: float
    refill: float
    refill_plant: float
    refill_state: float
    headroom: float
    limit: float


class Scratch(NamedTuple):
    """Working arrays of one rig at a time."""

    top: np.ndarray
    rows: np.ndarray
    gain: np.ndarray
    a: np.ndarray
    b: np.ndarray
    feedback: np.ndarray
    work: np.ndarray


def new_scratch() -> Scratch:
    """Working arrays."""
    return Scratch(
        np.zeros((3, N_TOP)), np.zeros((6, N)), np.zeros(N), np.zeros((3, 3)), np.zeros(3),
        np.zeros(3), np.zeros((4, 3)),
    )  # fmt: skip


@entry
def plant_step(p, omega, period, a, b):
    """Sampled (twist, omega_u, omega_l) about steady turning at `omega`: a (3, 3), b (3,)."""
    h = period / SUBSTEPS
    slope = lower_slope(p, omega)
    per = 1.0 / (1.0 + h * max(slope, 0.0) * p.per_Jl)
    for c in range(4):
        t = 1.0 if c == 0 else 0.0
        u = 1.0 if c == 1 else 0.0
        v = 1.0 if c == 2 else 0.0
        force = p.km * p.per_Ju if c == 3 else 0.0
        for _ in range(SUBSTEPS):
            du = h * (force - p.ktheta * p.per_Ju * t - (p.bu + p.dbu) * p.per_Ju * u)
            dl = h * per * p.per_Jl * (p.ktheta * t - slope * v)
            t += h * (u - v)
            u += du
            v += dl
        if c < 3:
            a[0, c], a[1, c], a[2, c] = t, u, v
        else:
            b[0], b[1], b[2] = t, u, v


@entry
def riccati_step(a, b, value, slip, effort, feedback, work):
    """One step of the Riccati recursion on `value` (3, 3); leaves the feedback (3,)."""
    # work[0:3] = value a, work[3] = value b
    for r in range(3):
        for c in range(3):
            work[r, c] = value[r, 0] * a[0, c] + value[r, 1] * a[1, c] + value[r, 2] * a[2, c]
        work[3, r] = value[r, 0] * b[0] + value[r, 1] * b[1] + value[r, 2] * b[2]
    s = effort + b[0] * work[3, 0] + b[1] * work[3, 1] + b[2] * work[3, 2]
    for c in range(3):
        feedback[c] = (b[0] * work[0, c] + b[1] * work[1, c] + b[2] * work[2, c]) / s
    for r in range(3):
        for c in range(r + 1):
            total = a[0, r] * work[0, c] + a[1, r] * work[1, c] + a[2, r] * work[2, c]
            total -= s * feedback[r] * feedback[c]
            value[r, c] = value[c, r] = total
    value[1, 1] += slip
    value[2, 2] += 1.0 + slip
    value[1, 2] -= slip
    value[2, 1] -= slip


@entry
def refill(cov, prior, knobs):
    """Doubt everything again, the friction and the offset most: something has changed."""
    for k in range(N_FREE):
        share = knobs.refill
        if k != FRICTION - FREE and k != OFFSET - FREE:
            share *= knobs.refill_plant
        cov[FREE + k, FREE + k] += share * prior[k, 1] ** 2
    for k in range(3):
        cov[k, k] += knobs.refill * knobs.refill_state


@kernel
def regulate(p, x, target, value, knobs, scratch):
    """Voltage (V) of the regulator for the plant in `p` in the state `x`.

    Where the estimated plant needs nearly the whole limit to hold the set point, up to 3.5 %
    of speed are given up, so that the voltage can still rise to damp.
    """
    load = lower_sliding(p, target)
    steady = (p.Tsu + p.dTsu + (p.bu + p.dbu) * target + load) / p.km
    top = knobs.limit - knobs.headroom
    if steady > top:
        target = max(0.965 * target, target - (steady - top) * p.km / p.bu)
        load = lower_sliding(p, target)
        steady = (p.Tsu + p.dTsu + (p.bu + p.dbu) * target + load) / p.km
    plant_step(p, target, knobs.period, scratch.a, scratch.b)
    k = scratch.feedback
    riccati_step(scratch.a, scratch.b, value, knobs.slip, knobs.effort, k, scratch.work)
    volts = min(max(steady, 0.0), knobs.limit)
    volts -= k[0] * (x[0] - load / p.ktheta) + k[1] * (x[1] - target) + k[2] * (x[2] - target)
    return min(max(volts, -knobs.limit), knobs.limit)


@entry
def adapt_rigs(
    first, seen, last, setpoint, x, cov, value, nis, nominal, p, process, prior, bounds, told,
    knobs, scratch, volts,
):  # fmt: skip
    """One period of every rig: predict, correct, watch the misfit, regulate.

    Args:
        first: whether the filters start.
        seen: measured omega_u (rad/s), shape (n,).
        last: voltage of the last period (V), shape (n,).
        setpoint: rad/s, shape (n,).
        x: filter states, shape (n, N).
        cov: their covariances, shape (n, N, N).
        value: Riccati matrices, shape (n, 3, 3).
        nis: running mean of the normalised squared innovation, shape (n,).
        nominal: record of the nominal rig.
        p: record to work in.
        process: variances gained in a period, shape (N,).
        prior: mean and standard deviation of the unknown, shape (N_FREE, 2).
        bounds: of the unknown, shape (N_FREE, 2).
        told: sensor delays (s) if they are known, else NaN, shape (n,).
        knobs: see `Knobs`.
        scratch: see `Scratch`.
        volts: to write, shape (n,).
    """
    for i in range(seen.size):
        xi, ci = x[i], cov[i]
        if first or not is_sound(xi, ci):
            start_filter(p, nominal, xi, ci, seen[i], knobs.spread, prior)
            nis[i] = 1.0
            if told[i] >= 0.0:
                xi[DELAY] = told[i]
        else:
            set_plant(p, nominal, xi)
            predict_state(p, xi, last[i], knobs.period, scratch.top)
            predict_covariance(ci, scratch.top, process, scratch.rows)
        misfit = correct(xi, ci, seen[i], knobs.noise, knobs.period, knobs.lag, scratch.gain)
        for k in range(N_FREE):
            xi[FREE + k] = min(max(xi[FREE + k], bounds[k, 0]), bounds[k, 1])
        nis[i] += _NIS_SHARE * (misfit - nis[i])
        if nis[i] > knobs.alarm:
            refill(ci, prior, knobs)
            nis[i] = 1.0
        set_plant(p, nominal, xi)
        volts[i] = regulate(p, xi, setpoint[i], value[i], knobs, scratch)
