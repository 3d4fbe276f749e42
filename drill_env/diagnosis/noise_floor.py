"""Errors that noise alone gives to predictions of a fitted rig."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.signal import lfilter

from drill_env._errors import InputError
from drill_env._threads import each
from drill_env._types import FloatArray, IntArray
from drill_env.diagnosis.declare import extended_rig
from drill_env.diagnosis.fit import Fit
from drill_env.diagnosis.held_out import (
    Judged,
    as_read,
    judged_channels,
    run_from_start,
)
from drill_env.effects.along import Motion
from drill_env.identification.known_loads import loaded
from drill_env.identification.noise import NoiseModel
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig
from drill_env.recordings import Channel

_SENSORS = {
    "theta_u": "encoder_u", "theta_l": "encoder_l", "omega_u": "speed_u", "omega_l": "speed_l",
}  # fmt: skip


def errors_by_noise(
    samples: Sequence[Samples], fit: Fit, judged: Sequence[Judged], seed: int = 0
) -> dict[str, list[FloatArray]]:
    """Errors (rad, rad/s) that drawn torques give to free runs and 5 s predictions.

    The fitted rig is simulated with and without one drawn torque noise; what differs is the error.

    Args:
        samples: held-out recordings.
        fit: rig, terms and noise.
        judged: the recordings under that fit.
        seed: of the draws.

    Returns:
        For "free" and "short" an array of shape (n, 2) for each recording, without the sensors'
        noise.
    """
    rng = np.random.default_rng(seed)
    extended = extended_rig(fit.rig, fit.terms)
    torques = [_drawn(given, fit.noise, rng) for given in samples]
    jobs = list(zip(samples, torques, judged, strict=True))

    def shaken(job: tuple[Samples, FloatArray, Judged]) -> list[FloatArray]:
        given, torque, j = job
        return [_shaken(given, extended, torque, j.motion, r) for r in (given.restarts, j.spans)]

    found = each(shaken, jobs)
    return {"free": [free for free, _ in found], "short": [short for _, short in found]}


def noise_floor(
    errors: Mapping[str, Sequence[FloatArray]], noise: NoiseModel, channels: Sequence[Channel]
) -> dict[str, dict[str, float]]:
    """Root mean square of errors by noise, with the sensors' own, of each kind and channel."""
    sensor, out = sensor_noise(noise, channels), {}
    for which, parts in errors.items():
        both = np.concatenate(parts)
        size = np.full(2, math.nan)
        for disc in range(2):
            known = both[np.isfinite(both[:, disc]), disc]
            if len(known):
                size[disc] = math.sqrt(float(np.mean(known**2)) + sensor[disc] ** 2)
        out[which] = dict(zip(channels, size.tolist(), strict=True))
    return out


def sensor_noise(noise: NoiseModel, channels: Sequence[Channel]) -> list[float]:
    """What the readings of some channels err by, rad or rad/s."""
    return [getattr(noise, _SENSORS[name]) for name in channels]


def _drawn(samples: Samples, noise: NoiseModel, rng: np.random.Generator) -> FloatArray:
    """One draw of the coloured torques, Nm, shape (n, 2)."""
    n, dt = len(samples.t), samples.recording.interval
    torque = np.zeros((n, 2))
    pairs = ((noise.torque_u, noise.tau_u), (noise.torque_l, noise.tau_l))
    for disc, (size, tau) in enumerate(pairs):
        decay = math.exp(-dt / tau)
        shocks = rng.normal(0.0, size * math.sqrt(1.0 - decay**2), n)
        shocks[0] = rng.normal(0.0, size)
        torque[:, disc] = lfilter([1.0], [1.0, -decay], shocks)
    return torque


def _shaken(
    samples: Samples, rig: Rig, torque: FloatArray, motion: Motion, rows: IntArray
) -> FloatArray:
    """What drawn torques do to runs that begin anew at each of some rows, shape (n, 2)."""
    channels = judged_channels(samples)
    # A drive with a fault of its own would not pass on noise of the voltage.
    tables = [
        {
            "id": "table", "component": disc, "depends_on": "time", "sort": "torque",
            "knots": samples.t, "values": torque[:, place], "located": False,
        }
        for place, disc in enumerate(("upper", "lower"))
    ]  # fmt: skip
    rig = loaded(rig, samples.recording)
    shaken = rig.replace(effects=(*rig.effects, *tables))
    out = np.full((len(samples.t), 2), math.nan)
    for a, b in zip(rows.tolist(), [*rows[1:].tolist(), len(samples.t)], strict=True):
        part, start = slice(a, b), motion.states[a, :4]
        if b - a < 2:
            continue
        t, u = samples.t[part], samples.u[part]
        try:
            quiet, moved = (run_from_start(r, t, u, start) for r in (rig, shaken))
            out[part] = as_read(moved.state, moved.readings, channels)
            out[part] -= as_read(quiet.state, quiet.readings, channels)
        except (InputError, RuntimeError):
            continue
    return out
