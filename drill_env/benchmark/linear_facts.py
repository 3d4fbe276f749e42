"""What linear theory says of a controller about each set point."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import control as ct
import numpy as np
import pandas as pd

from drill_env._errors import InputError
from drill_env._types import ComplexArray, FloatArray
from drill_env.baselines.linear import rig_matrices, sampled_rig, surface_part
from drill_env.controllers import Controller
from drill_env.dynamics import equilibrium_state, equilibrium_voltage
from drill_env.environment.config import EnvConfig
from drill_env.parameters import Rig

_PUSH = 1e-4
_STEPS, _BLOCK = 240, 100
_RANK = 1e-7
_AGREES, _LATER = 1e-2, 60
_FREQUENCIES = 6000


def realise(controller: Controller, config: EnvConfig, setpoint: float) -> ct.StateSpace:
    """The controller as a linear system from the measurements to volts, about a set point.

    Found from its answers: each measurement is pushed for one period away from the nominal
    equilibrium, and the Ho-Kalman algorithm turns the answers into states. The result is
    exact for a linear law, to rounding; for another it holds for small deviations.

    Args:
        controller: any, as long as it does not meet the voltage limit here.
        config: rig, period and limit.
        setpoint: rad/s.

    Raises:
        InputError: its answers are not those of a linear law.
    """
    seen = 3 if controller.view == "both" else 1
    rest = _answers(controller, config, setpoint, seen)
    inputs = seen + 1
    markov = np.zeros((_STEPS, inputs))
    for channel in range(inputs):
        pushed = _answers(controller, config, setpoint, seen, channel)
        markov[:, channel] = (pushed - rest) / _PUSH
    late_push = _answers(controller, config, setpoint, seen, 0, _LATER) - rest
    drift = late_push[_LATER:] / _PUSH - markov[: _STEPS - _LATER, 0]
    if not np.abs(drift).max() < _AGREES * max(float(np.abs(markov[:, 0]).max()), 1.0):
        raise InputError(
            f"{type(controller).__name__} is no linear law about this set point, its answer "
            "changes with time: it has no poles and margins of its own"
        )
    direct, markov = markov[0], markov[1:]
    wide = np.array([markov[i : i + _BLOCK].ravel() for i in range(_BLOCK)])
    late = np.array([markov[i + 1 : i + 1 + _BLOCK].ravel() for i in range(_BLOCK)])
    u, s, v = np.linalg.svd(wide)
    order = int((s > _RANK * max(s[0], 1e-9)).sum())
    root = np.sqrt(s[:order])
    out, into = u[:, :order] * root, root[:, None] * v[:order]
    a = (u[:, :order] / root).T @ late @ (v[:order].T / root)
    into, out = into[:, :inputs], out[:1]
    # The last entry of the observation is the law's own last answer.
    whole = np.block([[a, into[:, seen:]], [out, direct[None, seen:]]])
    entry = np.vstack([into[:, :seen], direct[None, :seen]])
    return ct.StateSpace(whole, entry, whole[-1:], entry[-1:], config.control_period)


def _answers(
    controller: Controller, config: EnvConfig, setpoint: float, seen: int,
    push: int | None = None, when: int = 0,
) -> FloatArray:  # fmt: skip
    state = equilibrium_state(config.rig, setpoint)[:3]
    measured = state if seen == 3 else state[1:2]
    volts = float(equilibrium_voltage(config.rig, setpoint))
    controller.reset(1)
    answers = np.zeros(_STEPS + 2)
    for k in range(len(answers)):
        observation = np.array([[*measured, setpoint, volts]])
        # Two calls first, so that whatever starts from the first measurement is not pushed.
        if k == when + 2 and push is not None:
            observation[0, push if push < seen else seen + 1] += _PUSH
        answers[k] = controller.act(observation)[0]
    return answers[2:]


def loop_of(law: ct.StateSpace, plant: ct.StateSpace) -> ct.StateSpace:
    """The loop cut at the voltage, with the sign of negative feedback."""
    return -(law * plant)


def closed_poles(law: ct.StateSpace, plant: ct.StateSpace) -> ComplexArray:
    """Poles of the closed loop in 1/s (logarithms over the period)."""
    whole = np.block(
        [
            [plant.A + plant.B @ law.D @ plant.C, plant.B @ law.C],
            [law.B @ plant.C, law.A],
        ]
    )
    multipliers = np.linalg.eigvals(whole).astype(complex)
    multipliers[np.abs(multipliers) < 1e-12] = 1e-12
    return np.asarray(np.log(multipliers) / float(plant.dt), dtype=complex)


def design_facts(
    maker: Callable[[EnvConfig], Controller], config: EnvConfig, setpoints: Sequence[float]
) -> pd.DataFrame:
    """Poles, margins and sensitivity peak of a controller on the nominal rig.

    Returns:
        Columns setpoint, stable, slowest_pole_per_s (largest real part of the closed loop),
        frequency_rad_s (of that pole), gain_margin (nearest to 1 of the factors at which the
        loop loses or gains stability), phase_margin_deg, delay_margin_s and sensitivity_peak;
        the margins are NaN where the loop is unstable or never crosses.
    """
    rows = []
    controller = maker(config)
    for setpoint in setpoints:
        plant = sampled_rig(config, setpoint)
        if controller.view == "surface":
            plant = surface_part(plant)
        law = realise(controller, config, setpoint)
        rows.append({"setpoint": float(setpoint), **_facts(law, plant)})
    return pd.DataFrame(rows)


def _facts(law: ct.StateSpace, plant: ct.StateSpace) -> dict[str, Any]:
    poles = closed_poles(law, plant)
    slowest = poles[np.argmax(poles.real)]
    stable = bool(slowest.real < 0.0)
    found: dict[str, Any] = {
        "stable": stable,
        "slowest_pole_per_s": float(slowest.real),
        "frequency_rad_s": float(abs(slowest.imag)),
    }
    nothing = dict.fromkeys(
        ("gain_margin", "phase_margin_deg", "delay_margin_s", "sensitivity_peak"), float("nan")
    )
    return found | (_margins(loop_of(law, plant)) if stable else nothing)


def _margins(loop: ct.StateSpace) -> dict[str, float]:
    omega = np.geomspace(1e-3, np.pi / float(loop.dt), _FREQUENCIES)
    response = np.asarray(loop(np.exp(1j * omega * float(loop.dt)))).ravel()
    # From the response, as the polynomials of so many states have lost their digits.
    measured = ct.FrequencyResponseData(response, omega, smooth=True)
    gains, phases, _, _, crossing, _ = ct.stability_margins(measured, returnall=True)
    gains = [float(g) for g in np.atleast_1d(gains) if np.isfinite(g) and g > 0.0]
    phases, crossing = np.atleast_1d(phases), np.atleast_1d(crossing)
    delays = [np.radians(p % 360.0) / w for p, w in zip(phases, crossing, strict=True)]
    folded = [abs((p + 180.0) % 360.0 - 180.0) for p in phases]
    return {
        "gain_margin": min(gains, key=lambda g: abs(np.log(g)), default=float("nan")),
        "phase_margin_deg": float(min(folded, default=float("nan"))),
        "delay_margin_s": float(min(delays, default=float("nan"))),
        "sensitivity_peak": float((1.0 / np.abs(1.0 + response)).max()),
    }


def surface_bound(rig: Rig, omega: float) -> float:
    """Least sensitivity peak that any linear law from omega_u to volts can have.

    The rig's unstable poles p lie next to the zeros z of omega_u, which are the poles of the
    lower disc on a held string and as unstable. S is 1 at z and 0 at p, so that by the maximum
    principle its peak is at least the product of |z + p*| / |z - p|. Delays make it worse.

    Args:
        rig: nominal.
        omega: set point, rad/s.

    Returns:
        The bound; 1 where the open loop is stable.
    """
    a, _ = rig_matrices(rig, omega)
    poles = np.linalg.eigvals(a)
    poles = poles[poles.real > 0.0]
    held = np.linalg.eigvals(a[np.ix_([0, 2], [0, 2])])
    zeros = held[held.real > 0.0]
    if not len(poles) or not len(zeros):
        return 1.0
    at_zero = np.array([np.prod(np.abs((z + poles.conj()) / (z - poles))) for z in zeros])
    return float(at_zero.max())
