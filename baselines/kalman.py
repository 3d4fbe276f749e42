"""Kalman filters and quadratic regulators on the sampled rig."""

from __future__ import annotations

import control as ct
import numpy as np

from drill_env._types import FloatArray

from .linear import OMEGA_L, OMEGA_U, Law


def filter_gain(system: ct.StateSpace, process: FloatArray, noise: FloatArray) -> FloatArray:
    """Steady gain of the measurement update x += gain (y - C x), shape (states, outputs).

    Args:
        system: sampled rig.
        process: covariance of what disturbs the state in one period, shape (states, states).
        noise: standard deviations of the measurements, shape (outputs,).
    """
    measured = np.diag(noise**2)
    _, p, _ = ct.dlqe(system.A, np.eye(len(system.A)), system.C, process, measured)
    return p @ system.C.T @ np.linalg.inv(system.C @ p @ system.C.T + measured)


def torque_noise(system: ct.StateSpace, upper: float, lower: float) -> FloatArray:
    """Process covariance of unmodelled torques, in rad/s gained per period on each disc."""
    process = 1e-10 * np.eye(len(system.A))
    process[OMEGA_U, OMEGA_U] += upper**2
    process[OMEGA_L, OMEGA_L] += lower**2
    return process


def regulator_weight(states: int, slip: float) -> FloatArray:
    """Weight of (omega_l error)^2 + slip (omega_u - omega_l)^2, shape (states, states)."""
    apart = np.zeros(states)
    apart[[OMEGA_U, OMEGA_L]] = 1.0, -1.0
    weight = slip * np.outer(apart, apart)
    weight[OMEGA_L, OMEGA_L] += 1.0
    return weight


def estimated_feedback(system: ct.StateSpace, gain: FloatArray, feedback: FloatArray) -> Law:
    """The law u = -feedback x over a filtered estimate of x that knows the applied voltage."""
    blind = np.eye(len(system.A)) - gain @ system.C
    return Law(
        f=system.A @ blind, g=system.A @ gain, h=system.B[:, 0], m=-feedback @ blind,
        d=-feedback @ gain,
    )  # fmt: skip


def integral_feedback(
    system: ct.StateSpace,
    gain: FloatArray,
    feedback: FloatArray,
    integral: float,
    watched: int,
    relax: float,
) -> Law:
    """As `estimated_feedback`, with an integral of one measurement's error.

    Args:
        system: sampled rig.
        gain: of the filter.
        feedback: on the state, shape (states,).
        integral: feedback on the integral of the error (V per rad).
        watched: which measurement is integrated.
        relax: anti-windup, integral given back per volt that is clipped away; it acts against
            the clipping as `integral` is positive.
    """
    plain = estimated_feedback(system, gain, feedback)
    states, outputs = len(system.A), len(system.C)
    m, d = np.append(plain.m, -integral), plain.d
    f = np.zeros((states + 1, states + 1))
    f[:states, :states], f[states, states] = plain.f, 1.0
    f[states] += relax * m
    g = np.zeros((states + 1, outputs))
    g[:states], g[states, watched] = plain.g, float(system.dt)
    g[states] += relax * d
    return Law(f=f, g=g, h=np.append(plain.h, -relax), m=m, d=d)
