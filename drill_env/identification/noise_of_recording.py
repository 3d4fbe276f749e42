"""Noise and starts of one recording of greatest likelihood while the rig is held."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from drill_env._types import FloatArray
from drill_env.identification.noise import NoiseModel, roughness, shiver, usual_noise
from drill_env.identification.noise_fit import noise_step
from drill_env.identification.prediction_error import Score, score
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig
from drill_env.recordings import Channel, Recording

_START_ROUNDS = 5
# Of minus twice the log likelihood: nothing that a test would notice.
_ENOUGH = 0.1
_ANGLES: dict[str, Channel] = {"encoder_u": "theta_u", "encoder_l": "theta_l"}
_SPEEDS: dict[str, Channel] = {"speed_u": "omega_u", "speed_l": "omega_l"}
_LEAST_SPEED = 1e-3


def estimated_noise(
    samples: Samples, rig: Rig, noise: NoiseModel | None = None, *, rounds: int = 15
) -> tuple[NoiseModel, FloatArray]:
    """Noise and starts of one recording of greatest likelihood, the rig held.

    Args:
        samples: from `prepare`.
        rig: parameters.
        noise: where to begin.
        rounds: at most.

    Returns:
        The noise, and starts as `Samples.starts`, shape (m, 5).
    """
    noise = noise or _first_noise(samples, rig)
    starts = settled_starts(samples, rig, noise)
    value = score(samples, rig, noise, starts).value
    for _ in range(rounds):
        there = noise_step([samples], [starts], rig, noise)
        moved = settled_starts(samples, rig, there, starts)
        reached = score(samples, rig, there, moved).value
        if not reached < value:
            break
        gain, noise, starts, value = value - reached, there, moved, reached
        if gain < _ENOUGH:
            break
    return noise, starts


def _first_noise(samples: Samples, rig: Rig) -> NoiseModel:
    known = noise_shown([samples.recording], samples.relative)
    return replace(usual_noise(rig), **known, **first_speeds([samples.recording]))


def first_speeds(recordings: Sequence[Recording]) -> dict[str, float]:
    """First guess of the measured velocities' noise in recordings that share it, rad/s."""
    found: dict[str, float] = {}
    for name, channel in _SPEEDS.items():
        sizes = [roughness(r.channel(channel)) for r in recordings if channel in r.velocities()]
        if sizes:
            found[name] = max(*sizes, _LEAST_SPEED)
    return found


def settled_starts(
    samples: Samples, rig: Rig, noise: NoiseModel, starts: FloatArray | None = None
) -> FloatArray:
    """Starts of greatest likelihood, rig and noise held, as `Samples.starts`."""
    starts = samples.starts if starts is None else starts
    here: Score = score(samples, rig, noise, starts)
    for _ in range(_START_ROUNDS):
        there = score(samples, rig, noise, starts + here.start_step)
        if not there.value < here.value:
            break
        starts = starts + here.start_step
        gain, here = here.value - there.value, there
        if gain < _ENOUGH:
            break
    return starts


def noise_shown(recordings: Sequence[Recording], relative: bool) -> dict[str, float]:
    """Noise that the readings of encoders show by themselves, rad, as `NoiseModel` names it.

    Of rounding to counts, or of an analog sensor, whose noise is many of its digits; nothing is
    said of a sensor that does not round.

    Args:
        recordings: that share it.
        relative: whether the lower sensor read the twist, see `made_of_twist`.
    """
    shown = {}
    for name, channel in _ANGLES.items():
        rounded = [r for r in recordings if channel in r.quanta and channel in r.angles()]
        if rounded:
            rounding = max(r.quanta[channel] for r in rounded) / math.sqrt(12.0)
            shown[name] = max(rounding, min(shiver(_read(r, channel, relative)) for r in rounded))
    return shown


def _read(recording: Recording, channel: Channel, relative: bool) -> FloatArray:
    """What a sensor itself read."""
    angles = recording.angles()
    if relative and channel == "theta_l" and "theta_u" in angles:
        return angles[channel] - angles["theta_u"]
    return angles[channel]
