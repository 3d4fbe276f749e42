"""Noise of a recorded rig: a coloured torque on each disc and each sensor's error."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields, replace

import numpy as np

from drill_env._checks import real
from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.parameters import Rig


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Standard deviations and correlation times of the disturbances.

    The torques are Ornstein-Uhlenbeck processes, so a value near zero makes the prediction
    errors those of a free run.

    Attributes:
        torque_u: of the torque on the upper disc, Nm.
        torque_l: of the torque on the lower disc, Nm.
        tau_u: correlation time of the upper torque, s.
        tau_l: correlation time of the lower torque, s.
        encoder_u: of the upper encoder, rad.
        encoder_l: of the lower encoder, rad.
        speed_u: of the upper disc's measured velocity, rad/s.
        speed_l: of the lower disc's measured velocity, rad/s.
    """

    torque_u: float = 0.02
    torque_l: float = 2e-4
    tau_u: float = 0.1
    tau_l: float = 0.1
    encoder_u: float = 2.0 * math.pi / 8192 / math.sqrt(12.0)
    encoder_l: float = 2.0 * math.pi / 8192 / math.sqrt(12.0)
    speed_u: float = 0.05
    speed_l: float = 0.05

    def __post_init__(self) -> None:
        for item in fields(self):
            value = real(getattr(self, item.name), f"noise {item.name}")
            if not value > 0:
                raise InputError(f"noise {item.name} is {value}: give a number greater than 0")

    def vector(self) -> FloatArray:
        """The logarithms of the eight values, in the order of the fields."""
        return np.log([getattr(self, item.name) for item in fields(self)])

    @classmethod
    def from_vector(cls, logs: FloatArray) -> NoiseModel:
        """The inverse of `vector`."""
        return cls(*np.exp(logs).tolist())

    def named(self, *, velocities: bool) -> dict[str, float]:
        """The values by name, those of velocities only where there are any."""
        names = [item.name for item in fields(self)]
        return {name: float(getattr(self, name)) for name in (names if velocities else names[:6])}


def usual_noise(rig: Rig, upper: float = 1.0, lower: float = 1.0) -> NoiseModel:
    """Noise of a rig of this size: torques accelerate its discs as they do the paper's.

    Args:
        rig: whose inertias count.
        upper: the torque on the upper disc in usual ones.
        lower: the one on the lower disc.
    """
    usual, paper = NoiseModel(), Rig()
    return replace(
        usual, torque_u=upper * usual.torque_u * rig.Ju / paper.Ju,
        torque_l=lower * usual.torque_l * rig.Jl / paper.Jl,
    )  # fmt: skip


SENSORS = ("encoder_u", "encoder_l", "speed_u", "speed_l")
"""The sensors' values, in the order of the readings theta_u, theta_l, omega_u, omega_l."""


def roughness(values: FloatArray) -> float:
    """Standard deviation of white noise on a smooth motion, shape (n,), NaN where missing."""
    known = values[np.isfinite(values)]
    # Third differences hide a smooth motion and keep white noise, times the root of 20.
    return float(np.sqrt(np.mean(np.diff(known, 3) ** 2) / 20.0)) if len(known) > 3 else 0.0


# Eighth differences keep white noise, times the root of 12870, and hide a smooth motion.
_ORDER, _GROWTH = 8, math.sqrt(12870.0)
# Of the largest tenth of them, outliers; the rest ends at so many times what it begins at.
_USUAL, _MOST = 0.9, 3.0


def shiver(values: FloatArray) -> float:
    """As `roughness`, of most samples: what a resonance or a few outliers add is left out.

    An analog sensor's noise is many of its digits; that of an encoder at rest is none.
    """
    rough = np.abs(np.diff(values, _ORDER))
    known = rough[np.isfinite(rough)]
    return float(1.4826 * np.median(known) / _GROWTH) if len(known) else 0.0


def clipped_shivers(values: FloatArray) -> FloatArray:
    """High differences of readings, which are noise but for a few, these cut; shape (n - 8,)."""
    rough = np.diff(values, _ORDER)
    known = np.abs(rough[np.isfinite(rough)])
    most = _MOST * float(np.quantile(known, _USUAL)) if len(known) else 0.0
    return np.clip(rough, -most, most)


def repeated_counts(theta: FloatArray) -> FloatArray:
    """How many neighbours show the same count as each sample, itself included; shape (n,).

    The rounding error stays the same while the count does, so that so many equal samples
    tell no more than one.
    """
    edges = np.flatnonzero(np.diff(theta) != 0.0) + 1
    bounds = np.concatenate([[0], edges, [len(theta)]])
    lengths = np.diff(bounds)
    return np.repeat(lengths, lengths).astype(float)
