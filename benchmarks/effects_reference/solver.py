"""Slow, independent reference for a rig with effects.

It shares no code with `drill_env`: SciPy's DOP853 between events. Each disc (and the motor,
behind a gear) has a mode: -1 or 1 while it slips that way, 0 while it rests; each kink of an
effect has a frozen sign. In given modes the vector field is smooth. A *guard* is a function
that stays positive while its mode is right; the first guard to fall below zero ends the piece.
Its time is found on the dense output, then polished by integrating anew exactly up to it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from .simulation import Array, Simulation

TINY = 1e-15  # rounding left in a guard by the event before; not a new event
SAMPLES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])  # of a step, where the guards are looked at


class Solver:
    """Steps a simulation from event to event."""

    def __init__(self, simulation: Simulation, rtol: float, atol: float, cap: float) -> None:
        self.sim, self.rtol, self.atol, self.cap = simulation, rtol, atol, cap

    def stepper(self, t: float, y: Array, end: float) -> DOP853:
        first = min(1e-5, end - t)
        return DOP853(self.sim.field, t, y, end, max_step=self.cap, rtol=self.rtol,
                      atol=self.atol, first_step=first)  # fmt: skip

    def advance(self, t: float, y: Array, end: float) -> Array:
        """The state at `end`, by steps that end exactly there."""
        if end <= t:
            return y.copy()
        stepper = self.stepper(t, y, end)
        while stepper.status == "running":
            stepper.step()
        return stepper.y.copy()

    def crossing(self, guard: int, dense: Any, times: Array, values: Array) -> float | None:
        """First time in a step at which a guard, known at the samples, falls below zero."""

        def g(t: float) -> float:
            return float(self.sim.guards(t, dense(t))[guard])

        for k in range(len(times) - 1):
            a, b = float(times[k]), float(times[k + 1])
            if values[k + 1] < -TINY:
                return a if values[k] <= 0.0 else float(brentq(g, a, b, xtol=1e-15))
            if k and values[k - 1] > values[k] < values[k + 1] and values[k] > 0.0:
                bend = values[k - 1] - 2 * values[k] + values[k + 1]
                lowest = values[k] - (values[k + 1] - values[k - 1]) ** 2 / (8 * bend)
                if lowest < 0.5 * values[k]:  # a dip between the samples
                    a = float(times[k - 1])
                    dip = minimize_scalar(g, bounds=(a, b), method="bounded",
                                          options={"xatol": 1e-10})  # fmt: skip
                    if dip.fun < -TINY:
                        return float(brentq(g, a, dip.x, xtol=1e-15))
        return None

    def polish(self, guard: int, t0: float, y0: Array, t: float) -> tuple[float, Array]:
        """The event's time and state, by Newton steps on exact integrations from t0."""
        y = self.advance(t0, y0, t)
        for _ in range(2):
            rate, d = np.array(self.sim.field(t, y)), 1e-6
            ahead = self.sim.guards(t + d, y + d * rate)[guard]
            behind = self.sim.guards(t - d, y - d * rate)[guard]
            slope = (ahead - behind) / (2 * d)
            move = -self.sim.guards(t, y)[guard] / slope if slope else 0.0
            if abs(move) > 1e-7 or t + move <= t0:  # a grazing event: as good as it gets
                break
            t += float(move)
            y = self.advance(t0, y0, t)
        return t, y

    def run(self, t_eval: Array) -> Array:
        """All samples, inner states of the effects included."""
        sim, y, now, fired = self.sim, self.sim.state.copy(), 0.0, -1
        samples = np.tile(y, (len(t_eval), 1))
        idle = 0
        for start, end in zip(sim.breaks, sim.breaks[1:], strict=False):
            now, sim.inside, stepper, fired = start, 0.5 * (start + end), None, -1
            while now < end:
                if stepper is None:
                    stepper = self.fresh(now, y, end, fired)
                before, y_before = now, y
                stepper.step()
                if stepper.status == "failed":
                    raise RuntimeError(f"the reference failed at {now}")
                dense, times = stepper.dense_output(), now + (stepper.t - now) * SAMPLES
                times[-1] = stepper.t
                values = np.array([sim.guards(t, dense(t)) for t in times])
                found = [(t, guard) for guard in range(values.shape[1])
                         if (t := self.crossing(guard, dense, times, values[:, guard]))
                         is not None]  # fmt: skip
                now, y = float(stepper.t), stepper.y.copy()
                if found:
                    now, fired = min(found)
                    now, y = self.polish(fired, before, y_before, min(now, stepper.t))
                chosen = slice(*np.searchsorted(t_eval, [before, now], "right"))
                samples[chosen] = dense(t_eval[chosen]).T
                if found:
                    idle = idle + 1 if now - before < 1e-13 else 0
                    if idle > 50:
                        raise RuntimeError(f"modes chatter at {now}")
                    sim.change(fired, now, y)
                    stepper = None
        samples[np.searchsorted(t_eval, now, "left") :] = y
        return samples

    def fresh(self, t: float, y: Array, end: float, fired: int) -> DOP853:
        """A stepper at a new piece, after the modes that a jump has made wrong are mended.

        The switch that has just changed is zero but for the rounding of time: leave it alone.
        """
        for _ in range(20):
            values = self.sim.guards(t, y)
            if fired >= 2 * len(self.sim.speeds):
                values[fired] = 0.0
            wrong = np.flatnonzero(values < -1e-12)
            if not wrong.size:
                return self.stepper(t, y, end)
            self.sim.change(int(wrong[0]), t, y)
        raise RuntimeError(f"no consistent modes at {t}")


def reference(
    rig: Any,
    effects: Sequence[dict[str, Any]],
    u: float | Sequence[tuple[float, float]],
    seconds: float,
    t_eval: Sequence[float] | Array,
    initial: Sequence[float] | None = None,
    *,
    rtol: float = 1e-12,
    atol: float = 1e-13,
    cap: float = 0.02,
) -> Array:
    """Samples of (twist, w_u, w_l, theta_l) at `t_eval`, shape (len(t_eval), 4).

    Args:
        rig: parameters, a `drill_env.Rig` with the humped law.
        effects: the effects, each with its "id" and its parameters by name.
        u: a constant voltage, or its steps (from when, volts) in order.
        seconds: length of the run, from 0.
        t_eval: times in [0, seconds], in order.
        initial: state at 0, at rest by default.
        rtol, atol, cap: tolerances and longest step of the integration.
    """
    start = (0.0, 0.0, 0.0, 0.0) if initial is None else initial
    simulation = Simulation(rig, effects, u, seconds, start)
    return Solver(simulation, rtol, atol, cap).run(np.asarray(t_eval, dtype=float))[:, :4]
