"""Recordings of one-inertia axes made without the package: own equations, integrator and noise.

Runge-Kutta substeps that end where the speed vanishes; the axis rests while friction holds it. What
is left out of the rig file is one term of `LISTED`, of `DIFFERING` (a law that the library has with
another exponent or corner) or of `UNLISTED` (physics that it does not have), or nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

SUBSTEP = 1e-4
FIELDS = (
    "km", "J", "b", "coulomb", "offset", "weight", "weight_phase", "spring", "drag", "exponent",
    "stribeck", "stribeck_speed", "stribeck_power", "load", "dead", "level", "corner", "asymmetry",
    "ripple", "order", "ripple_phase", "lag", "patch", "patch_from", "patch_to", "knee",
    "knee_speed", "weakening", "wet", "wet_phase", "stroke", "play",
)  # fmt: skip
F = {name: place for place, name in enumerate(FIELDS)}
KM, J, B, COULOMB = (F[name] for name in ("km", "J", "b", "coulomb"))


@njit(cache=True)
def _volts(q, u):
    """What the amplifier makes of a demand."""
    if q[14] > 0.0:
        u = math.copysign(max(abs(u) - q[14], 0.0), u)
    if q[15] > 0.0:
        if q[16] > 0.0:
            u = q[15] * math.tanh(u / q[15])
        else:
            u = min(max(u, -q[15]), q[15])
    return u


@njit(cache=True)
def _friction(q, theta, speed, drive):
    """Size of what acts against the motion."""
    w = abs(speed)
    size = q[3] + q[13] * abs(drive)
    if q[10] > 0.0:
        size += q[10] * math.exp(-((w / q[11]) ** q[12]))
    if q[8] > 0.0:
        size += q[8] * w ** q[9]
    turn = theta % (2.0 * math.pi)
    if q[22] > 0.0 and q[23] < turn < q[24]:
        size += q[22]
    size += q[25] * max(w - q[26], 0.0) + q[30] * max(math.sin(theta), 0.0)
    return size + q[28] * w * (1.0 + math.cos(theta + q[29]))


@njit(cache=True)
def _torque(q, theta, speed, drive, push):
    """All but friction."""
    drive *= 1.0 + q[17] * (1.0 if drive > 0.0 else -1.0)
    drive *= 1.0 - q[27] * min(abs(speed), 1.0 / max(q[27], 1e-9))
    total = drive + push + q[4] + q[5] * math.cos(theta + q[6]) - q[7] * theta
    return total + q[18] * math.cos(q[19] * theta + q[20]) - q[2] * speed


@njit(cache=True)
def _step(q, theta, speed, sign, drive, push, h):
    """Classical Runge-Kutta step with friction against `sign`."""
    x, w = theta, speed
    dx = dw = 0.0
    for i in range(4):
        held = _friction(q, x, w, drive)
        a = (_torque(q, x, w, drive, push) - sign * held) / q[1]
        weight = (1.0, 2.0, 2.0, 1.0)[i] / 6.0
        dx += weight * w
        dw += weight * a
        part = (0.5, 0.5, 1.0, 0.0)[i] * h
        x, w = theta + part * w, speed + part * a
    return theta + h * dx, speed + h * dw


@njit(cache=True)
def run(q, u, push, dt, late):
    """Angles and speeds at each row; the voltage acts `late` rows behind its own."""
    n, substeps = len(u), max(int(round(dt / SUBSTEP)), 1)
    out = np.zeros((n, 2))
    theta = speed = 0.0
    lagged = back = 0.0
    for i in range(n):
        out[i, 0], out[i, 1] = theta, speed
        asked = u[max(i - late, 0)] if i >= late else 0.0
        if q[31] > 0.0:
            back = min(max(back, asked - q[31]), asked + q[31])
            asked = 0.5 * (asked + back)
        demand = _volts(q, asked)
        for _ in range(substeps):
            h = dt / substeps
            if q[21] > 0.0:
                fade = math.exp(-h / q[21])
                mean = demand + (lagged - demand) * (1.0 - fade) * q[21] / h
                lagged = demand + (lagged - demand) * fade
                drive = q[0] * mean
            else:
                drive = q[0] * demand
            left = h
            for _ in range(4):
                sign = math.copysign(1.0, speed)
                if speed == 0.0:
                    pull = _torque(q, theta, 0.0, drive, push[i])
                    if abs(pull) <= _friction(q, theta, 0.0, drive):
                        break
                    sign = math.copysign(1.0, pull)
                there, after = _step(q, theta, speed, sign, drive, push[i], left)
                if speed != 0.0 and after * sign < 0.0:
                    share = speed / (speed - after)
                    theta, _ = _step(q, theta, speed, sign, drive, push[i], share * left)
                    speed, left = 0.0, (1.0 - share) * left
                    continue
                theta, speed = there, after if after * sign > 0.0 else 0.0
                break
    return out


@dataclass(frozen=True)
class Axis:
    """One axis, what its rig file lacks, and how it is recorded.

    Attributes:
        numbers: of the plant, see `FIELDS`.
        given: Ju, km, bu and Tsu as the rig file has them.
        term: what is left out.
        truth: its numbers as the library counts them, of listed terms.
        volts: largest voltage.
        rate: rows a second.
        seconds: length of a recording.
        late: rows by which the drive acts late.
        counts: of the encoder a turn.
        eccentric: error of the encoder once a turn, rad, and its phase.
        kind: of the voltage.
    """

    numbers: dict[str, float]
    given: dict[str, float]
    term: str
    truth: dict[str, float]
    volts: float
    rate: float
    seconds: float
    late: int
    counts: int
    eccentric: tuple[float, float]
    kind: str


LISTED = (
    "upper_coulomb", "upper_viscous", "upper_offset", "upper_unbalance", "upper_quadratic_drag",
    "upper_stribeck", "upper_gaussian_stribeck", "upper_spring", "amplifier_deadzone",
    "amplifier_saturation", "gain_asymmetry", "torque_ripple", "input_delay", "actuator_lag",
    "upper_load_friction", "encoder_eccentricity_upper", "drive_speed_loss",
)  # fmt: skip
DIFFERING = (
    "drag of power 1.5", "drag of power 3", "Stribeck of power 1.5", "tanh saturation",
    "damping above a speed",
)  # fmt: skip
UNLISTED = ("sticky sector", "pump stroke", "wet sector", "drive hysteresis", "hunting supply")
COMPONENTS = {
    "amplifier_deadzone": "actuator", "amplifier_saturation": "actuator",
    "gain_asymmetry": "actuator", "torque_ripple": "actuator", "input_delay": "actuator",
    "actuator_lag": "actuator", "encoder_eccentricity_upper": "sensor",
    "tanh saturation": "actuator", "drive_speed_loss": "actuator",
    "drive hysteresis": "actuator", "hunting supply": "actuator",
}  # fmt: skip
"""Where a term sits; at the axis by default."""
SIBLINGS = {
    "drag of power 1.5": ("upper_quadratic_drag", "upper_viscous"),
    "drag of power 3": ("upper_quadratic_drag",),
    "Stribeck of power 1.5": ("upper_stribeck", "upper_gaussian_stribeck"),
    "tanh saturation": ("soft_saturation", "amplifier_saturation"),
    "damping above a speed": ("upper_drag_above_speed", "upper_quadratic_drag"),
}
"""Names that stand for a law that differs."""


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def draw(term: str, rng: np.random.Generator) -> Axis:
    """An axis of random size without `term` in its rig file.

    Args:
        term: of `LISTED`, `DIFFERING` or `UNLISTED`, or "nothing".
        rng: of the draws.
    """
    volts, km = float(rng.choice([3.0, 12.0, 24.0])), _log(rng, 0.01, 0.5)
    full, speed = km * volts, _log(rng, 5.0, 40.0)
    coulomb = full * rng.uniform(0.03, 0.15)
    q = dict.fromkeys(FIELDS, 0.0) | {
        "km": km, "b": 0.7 * full / speed, "coulomb": coulomb, "exponent": 1.0,
        "stribeck_speed": 1.0, "stribeck_power": 1.0,
    }  # fmt: skip
    q["J"] = q["b"] * _log(rng, 0.08, 0.8)
    known = {"Ju": q["J"], "km": km, "bu": q["b"], "Tsu": coulomb}
    given = {k: v * float(np.exp(rng.normal(0.0, 0.05))) for k, v in known.items()}
    late, eccentric, truth = 0, (0.0, 0.0), dict[str, float]()
    rate = float(rng.choice([100.0, 200.0, 500.0]))
    size, phase = rng.uniform(0.08, 0.3) * full, float(rng.uniform(-3.0, 3.0))
    if term == "upper_coulomb":
        q["coulomb"], given["Tsu"], truth = size, 0.0, {"torque": size}
    elif term == "upper_viscous":
        given["bu"], truth = 0.0, {"damping": q["b"]}
    elif term == "upper_offset":
        q["offset"], truth = -math.copysign(size, phase), {"torque": math.copysign(size, phase)}
    elif term == "upper_unbalance":
        q |= {"weight": size, "weight_phase": phase}
        truth = {"torque": size}
    elif term == "upper_quadratic_drag" or term.startswith("drag"):
        q["exponent"] = {"drag of power 1.5": 1.5, "drag of power 3": 3.0}.get(term, 2.0)
        q["drag"] = 1.5 * size / (0.6 * speed) ** q["exponent"]
        truth = {"coefficient": q["drag"]} if term in LISTED else {}
    elif "tribeck" in term:
        q["stribeck_power"] = {"upper_stribeck": 1.0, "upper_gaussian_stribeck": 2.0}.get(term, 1.5)
        q |= {"stribeck": size, "stribeck_speed": speed * rng.uniform(0.04, 0.2)}
        truth = {"torque": size, "velocity": q["stribeck_speed"]} if term in LISTED else {}
    elif term == "upper_spring":
        q["spring"] = size / (0.3 * speed)
        truth = {"stiffness": q["spring"]}
    elif term == "amplifier_deadzone":
        q["dead"] = volts * rng.uniform(0.03, 0.15)
        truth = {"width": q["dead"]}
    elif term in ("amplifier_saturation", "tanh saturation"):
        q |= {"level": volts * rng.uniform(0.45, 0.75), "corner": float(term in DIFFERING)}
        truth = {"level": q["level"]} if term in LISTED else {}
    elif term == "gain_asymmetry":
        q["asymmetry"] = math.copysign(rng.uniform(0.06, 0.2), phase)
        truth = {"asymmetry": q["asymmetry"]}
    elif term == "torque_ripple":
        q |= {"ripple": size, "order": float(rng.integers(2, 9)), "ripple_phase": phase}
        truth = {"torque": size, "order": q["order"]}
    elif term == "input_delay":
        late = max(round(rng.uniform(0.02, 0.06) * rate), 3)
        truth = {"delay": late / rate}
    elif term == "actuator_lag":
        q["lag"] = rng.uniform(0.02, 0.08)
        truth = {"time_constant": q["lag"]}
    elif term == "upper_load_friction":
        q["load"] = rng.uniform(0.12, 0.4)
        truth = {"coefficient": q["load"]}
    elif term == "encoder_eccentricity_upper":
        eccentric = (rng.uniform(0.01, 0.04), phase)
        truth = {"error": eccentric[0]}
    elif term == "sticky sector":
        q |= {"patch": size, "patch_from": 1.0, "patch_to": 1.0 + rng.uniform(0.8, 2.0)}
    elif term == "damping above a speed":
        q |= {"knee": 3.0 * size / speed, "knee_speed": 0.4 * speed}
    elif term == "drive_speed_loss":
        q["weakening"] = rng.uniform(0.25, 0.45) / speed
        truth = {"loss": q["weakening"]}
    elif term == "drive hysteresis":
        q["play"] = volts * rng.uniform(0.05, 0.12)
    elif term == "hunting supply":
        q |= {"swing": rng.uniform(0.05, 0.15), "swing_hz": rng.uniform(0.5, 3.0)}
    elif term == "pump stroke":
        q["stroke"] = 2.0 * size
    elif term == "wet sector":
        q |= {"wet": 1.5 * size / speed, "wet_phase": phase}
    kind = str(rng.choice(["levels", "sines", "ramps"]))
    counts = int(rng.choice([4096, 16384, 65536]))
    seconds = float(rng.choice([10.0, 20.0]))
    return Axis(q, given, term, truth, volts, rate, seconds, late, counts, eccentric, kind)


def recorded(axis: Axis, rng: np.random.Generator) -> dict[str, Any]:
    """Columns t, u and theta_u of one recording, and the encoder's step."""
    n, dt = int(axis.seconds * axis.rate), 1.0 / axis.rate
    t = np.arange(n) * dt
    u = axis.volts * _wave(axis.kind, t, rng)
    keep = math.exp(-dt / 0.1)
    push, size = np.zeros(n), 0.004 * axis.numbers["km"] * axis.volts
    for i in range(1, n):
        push[i] = keep * push[i - 1] + size * math.sqrt(1.0 - keep**2) * rng.normal()
    q = np.array([axis.numbers[name] for name in FIELDS])
    swing, turn = axis.numbers.get("swing", 0.0), 2.0 * math.pi * axis.numbers.get("swing_hz", 0.0)
    supplied = u * (1.0 + swing * np.cos(turn * t + rng.uniform(0.0, 2.0 * math.pi)))
    theta = run(q, supplied, push, dt, axis.late)[:, 0]
    theta = theta + axis.eccentric[0] * np.cos(theta + axis.eccentric[1])
    step = 2.0 * math.pi / axis.counts
    return {"t": t, "u": u, "theta_u": step * np.round(theta / step), "step": step}


def _wave(kind: str, t: Array, rng: np.random.Generator) -> Array:
    """A voltage between -1 and 1."""
    if kind == "levels":
        edges = np.cumsum(rng.uniform(0.2, 1.2, len(t)))
        return rng.uniform(-1.0, 1.0, len(t))[np.searchsorted(edges, t)]
    if kind == "ramps":
        edges = np.append(0.0, np.cumsum(rng.uniform(0.4, 1.5, len(t))))
        return np.interp(t, edges, rng.uniform(-1.0, 1.0, len(edges)))
    frequencies, phases = rng.uniform(0.1, 2.5, 8), rng.uniform(0.0, 2.0 * math.pi, 8)
    wave = np.sin(2.0 * math.pi * np.outer(t, frequencies) + phases).sum(axis=1)
    return wave / np.abs(wave).max()
