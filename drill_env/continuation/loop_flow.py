"""Steady motions of a sampled loop as zeros: fixed points, and cycles of a fitting clock."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.cycle import PeriodMap
from drill_env.continuation.describe import describe
from drill_env.continuation.flow import CycleError, LimitCycle, Shot
from drill_env.continuation.loop_period import SampledLoop
from drill_env.integrator.trajectory import Events
from drill_env.parameters import Rig


@dataclass(frozen=True, slots=True)
class LoopMotion(LimitCycle):
    """An equilibrium or a cycle of a controlled rig; the parameter is the set point in rad/s.

    An equilibrium has min = max, the control period as its period and no trivial multiplier;
    its multipliers are the eigenvalues of the map over one control period.

    Attributes:
        volts: smallest, mean and largest voltage, V.
        clock: control period, s; of a cycle the one that fits it a whole number of times.
        beats: control periods per period.
    """

    volts: tuple[float, float, float]
    clock: float
    beats: int

    @property
    def growth_rate(self) -> float:
        """Rate at which a small disturbance grows, 1/s; negative where it decays."""
        size = float(np.abs(self.multipliers).max())
        return float(np.log(max(size, 1e-300)) / self.period)

    def saturates(self, limit: float) -> bool:
        """Whether the voltage touches its limit (V) within the period."""
        return max(-self.volts[0], self.volts[2]) >= (1.0 - 1e-9) * limit


class LoopMap:
    """`beats` control periods of a sampled loop as a function of state, duration, set point.

    The duration is shared equally: the clock is stretched a little, so that a cycle, whose
    period is no multiple of the control period, closes after a whole number of them.

    Args:
        loop: the sampled loop.
        beats: control periods.
    """

    def __init__(self, loop: SampledLoop, beats: int) -> None:
        self.loop, self.beats = loop, beats
        self._plant = PeriodMap(loop.rig)
        self._volts = np.zeros(beats)

    def rig_at(self, value: float) -> Rig:
        """The rig, whatever the set point."""
        return self.loop.rig

    def shoot(self, state: FloatArray, period: float, value: float) -> Shot:
        """Run all control periods and chain their derivatives."""
        if not (0.5 < period / (self.beats * self.loop.config.control_period) < 2.0):
            raise CycleError(f"a period of {period:.6g} s does not fit {self.beats} beats")
        n, clock = self.loop.size, period / self.beats
        by_all = np.hstack([np.eye(n), np.zeros((n, 2))])
        modes, events = None, []
        self._volts = np.zeros(self.beats)
        for k in range(self.beats):
            step = self.loop.advance(state, clock, value, modes)
            by_all = step.jacobian[:, :n] @ by_all
            by_all[:, n] += step.jacobian[:, n] / self.beats
            by_all[:, n + 1] += step.jacobian[:, n + 1]
            state, modes, self._volts[k] = step.state, step.run.final_modes, step.volts
            if len(step.run.events):
                found = step.run.events
                events.append(dataclasses.replace(found, t=found.t + k * clock))
        return Shot(state, by_all, _joined(events))

    def phase(self, state: FloatArray, value: float) -> tuple[float, FloatArray]:
        """A sample falls on the maximum of omega_l: ktheta twist = T_l(omega_l)."""
        condition, slopes = self._plant.phase(state[:3], value)
        gradient = np.zeros(len(state) + 2)
        gradient[:3] = slopes[:3]
        return condition, gradient

    def describe(self, shot: Shot, z: FloatArray, steps: int) -> LoopMotion:
        """Everything about the closed cycle of `z`."""
        cycle = describe(shot, self.loop.rig, z, steps)
        return _motion(cycle, self._volts, float(z[-2]) / self.beats)


class LoopRest(LoopMap):
    """One control period of fixed length: its fixed points are the loop's equilibria.

    Args:
        loop: the sampled loop.
    """

    def __init__(self, loop: SampledLoop) -> None:
        super().__init__(loop, 1)

    def phase(self, state: FloatArray, value: float) -> tuple[float, FloatArray]:
        """No condition on the state: the clock is the loop's own, see `shoot`."""
        gradient = np.zeros(len(state) + 2)
        gradient[-2] = 1.0
        return 0.0, gradient

    def describe(self, shot: Shot, z: FloatArray, steps: int) -> LoopMotion:
        """Everything about the equilibrium of `z`."""
        values = np.asarray(np.linalg.eigvals(shot.jacobian[:, :-2]), dtype=np.complex128)
        values = values[np.argsort(-np.abs(values))]
        speed = float(z[2])
        cycle = LimitCycle(
            parameter=float(z[-1]), state=z[:-2].copy(), period=float(z[-2]), min=speed,
            max=speed, multipliers=values, trivial=float("nan"),
            stable=bool((np.abs(values) < 1.0).all()), character="slipping", sticking_s=0.0,
            reversed_s=0.0, hits=(), steps=steps,
            residual=float(np.abs(shot.end - z[:-2]).max()),
        )  # fmt: skip
        return _motion(cycle, self._volts, float(z[-2]))


def _motion(cycle: LimitCycle, volts: FloatArray, clock: float) -> LoopMotion:
    plain = {item.name: getattr(cycle, item.name) for item in dataclasses.fields(cycle)}
    spread = float(volts.min()), float(volts.mean()), float(volts.max())
    return LoopMotion(**plain, volts=spread, clock=clock, beats=len(volts))


def _joined(parts: list[Events]) -> Events:
    if not parts:
        none = np.zeros(0, dtype=np.int64)
        return Events(np.zeros(0), none, none, np.zeros((0, 4)))
    names = ("t", "disc", "kind", "state")
    return Events(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
