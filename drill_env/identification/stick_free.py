"""Whether a rig can vibrate without sticking at constant voltage: the paper's argument for a hump.

Limit cycles are continued with their multipliers, so an unstable or passing one does not count;
what is claimed is then run once, and what is denied is looked for by simulation.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from drill_env._errors import InputError
from drill_env.continuation import StepRule, bifurcation_diagram, hopf_points
from drill_env.dynamics import equilibrium_speed, equilibrium_state
from drill_env.identification.estimate import Estimate
from drill_env.integrator import Disc, Kind, NegativeFrictionWarning, simulate
from drill_env.parameters import Rig

Motion: TypeAlias = Literal["steady", "stick-free", "stopping", "unsettled"]
"""What the lower disc settles to: turning steadily, vibrating without or with standstill."""

_COARSE = StepRule(first=0.02, largest=0.2, turn=0.5)
_RUNS = 12
_PERIODS = 150.0
_WATCHED = 10.0
# Peak to peak over 1 + peak (rad/s): what falls below has died out.
_DEAD = 1e-2
_DRAWS = 200


@dataclass(frozen=True, slots=True)
class StickFree:
    """Vibration of the lower disc with omega_l > 0 throughout, at constant voltage.

    Attributes:
        exists: whether a stable limit cycle of that kind was found, and held in a simulation.
        volts: lowest and highest voltage of such cycles, V, or None.
        largest: voltage (V), smallest and largest omega_l (rad/s) and period (s) of the widest.
        hopf: voltages (V) where steady turning loses its stability, and whether stable
            vibration is born there.
        to_volts: end of the voltages searched, V.
        simulated: motion after 150 natural periods from near steady turning, by voltage (V).
        failures: what the continuation could not follow.
    """

    exists: bool
    volts: tuple[float, float] | None
    largest: tuple[float, float, float, float] | None
    hopf: tuple[tuple[float, bool], ...]
    to_volts: float
    simulated: tuple[tuple[float, Motion], ...]
    failures: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        names = ("volts", "min", "max", "period_s")
        return {
            **asdict(self),
            "largest": dict(zip(names, self.largest, strict=True)) if self.largest else None,
            "hopf": [{"volts": v, "stable_vibration": s} for v, s in self.hopf],
            "simulated": [{"volts": v, "motion": m} for v, m in self.simulated],
        }


def stick_free(rig: Rig, to_volts: float) -> StickFree:
    """Search a rig for vibration without sticking.

    Args:
        rig: parameters with two inertias.
        to_volts: highest constant voltage, V, above break-away.

    Raises:
        InputError: the rig has one inertia or `to_volts` lies below break-away.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NegativeFrictionWarning)
        diagram = bifurcation_diagram(rig, to_volts, _COARSE)
        cycles = [
            point.cycle for branch in diagram.branches for point in branch.points
            if point.cycle.stable and point.cycle.min > 0.0 and point.cycle.parameter <= to_volts
        ]  # fmt: skip
        grid = np.linspace(rig.breakaway_voltage, to_volts, _RUNS + 2)[1:-1]
        motions: tuple[tuple[float, Motion], ...] = tuple(
            (float(v), _motion(rig, float(v))) for v in grid
        )
        widest = max(cycles, key=lambda c: c.max - c.min, default=None)
        held = widest is not None and _holds(rig, widest.parameter, widest.state)
    volts = [c.parameter for c in cycles]
    return StickFree(
        exists=held or any(motion == "stick-free" for _, motion in motions),
        volts=(min(volts), max(volts)) if volts else None,
        largest=(widest.parameter, widest.min, widest.max, widest.period) if widest else None,
        hopf=tuple((h.voltage, h.supercritical) for h in diagram.hopf), to_volts=to_volts,
        simulated=motions, failures=diagram.failures,
    )  # fmt: skip


def soft_share(estimate: Estimate, to_volts: float, seed: int = 0) -> float:
    """Share of the estimate's posterior in which steady turning gives way to stable vibration.

    By linearisation and the first Lyapunov coefficient alone, over 200 draws.

    Args:
        estimate: a fit.
        to_volts: highest constant voltage, V.
        seed: of the draws.
    """
    found = []
    for draw in estimate.draws(_DRAWS, seed).tolist():
        try:
            rig = estimate.rig.replace(**dict(zip(estimate.free, draw, strict=True)))
            found.append(any(point.supercritical for point in hopf_points(rig, to_volts)))
        except InputError:
            # A draw past a bound makes no rig.
            continue
    return float(np.mean(found)) if found else math.nan


def _motion(rig: Rig, volts: float) -> Motion:
    try:
        speed = equilibrium_speed(rig, volts)
    except InputError:
        return "unsettled"
    start = equilibrium_state(rig, speed) + np.array([0.05, 0.0, 0.0, 0.0])
    return _settled(rig, volts, start)


def _holds(rig: Rig, volts: float, state: np.ndarray) -> bool:
    """Whether a cycle comes back after a knock of 1 %."""
    return _settled(rig, volts, np.append(1.01 * state[:3], 0.0)) == "stick-free"


def _settled(rig: Rig, volts: float, start: np.ndarray) -> Motion:
    """Where a rig ends that starts from a state (4,)."""
    watched = _WATCHED * rig.natural_period
    peaks, lowest = [], math.inf
    state, modes = start, None
    for _ in range(2):
        long = simulate(
            rig, volts, 0.5 * _PERIODS * rig.natural_period, t_eval=np.zeros(0), rtol=1e-7,
            initial=state, modes=modes,
        )  # fmt: skip
        end = simulate(
            rig, volts, watched, t_eval=np.linspace(0.0, watched, 400), extrema=True, rtol=1e-7,
            initial=long.final_state, modes=long.final_modes,
        )  # fmt: skip
        state, modes = end.final_state, end.final_modes
        tops = end.events.where(Disc.LOWER, Kind.MAXIMUM).state[:, 2]
        highest = float(max(tops.max(initial=-math.inf), end.omega_l.max()))
        marks = end.events.where(Disc.LOWER).state[:, 2]
        lowest = float(min(marks.min(initial=math.inf), end.omega_l.min()))
        peaks.append((highest, highest - lowest))
    (_, before), (highest, after) = peaks
    if after < _DEAD * (1.0 + abs(highest)):
        return "steady"
    if lowest <= 0.0:
        return "stopping"
    return "stick-free" if abs(after - before) < 0.02 * after else "unsettled"
