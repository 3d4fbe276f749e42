"""Slow, independent reference for a rig with effects (formulas in `reference_effects_list`).

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
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from tests.reference_effects_list import EFFECTS, Effect, GearCompliance, Start, Sums, View, Volts

Array = NDArray[np.float64]
TINY = 1e-15  # rounding left in a guard by the event before; not a new event
SAMPLES = np.array([0.0, 0.25, 0.5, 0.75, 1.0])  # of a step, where the guards are looked at
LAST_EVENTS: list[tuple[float, int]] = []
"""Time and guard of every event of the last run, for whoever wants to look."""


def lower_law(rig: Any, w: float) -> float:
    """T_l at speed w >= 0, equation (7): 1 - 2/(1 + e^a) is tanh(a/2)."""
    humps = rig.T1 * np.tanh(0.5 * rig.beta1 * w) + rig.T2 * np.tanh(0.5 * rig.beta2 * w)
    return float(rig.Tsl + humps + rig.bl * w)


class Simulation:
    """The rig, its effects, and the modes that are frozen at present."""

    def __init__(
        self,
        rig: Any,
        effects: Sequence[dict[str, Any]],
        u: float | Sequence[tuple[float, float]],
        seconds: float,
        initial: Sequence[float],
    ) -> None:
        if rig.friction != "humped" or rig.clamp or rig.inertias != 2:
            raise ValueError("the reference knows the humped law, without clamp, of two discs")
        self.rig, self.volts, self.seconds = rig, Volts(u), seconds
        start = Start(rig, self.law, self.volts, initial, seconds)
        self.effects: list[Effect] = [EFFECTS[q["id"]](q, start) for q in effects]
        self.places: list[slice] = []  # of the inner states of each effect
        state = [float(value) for value in initial]
        for effect in self.effects:
            self.places.append(slice(len(state), len(state) + len(effect.initial)))
            state += effect.initial
        self.state = np.array(state)
        gears = [i for i, e in enumerate(self.effects) if isinstance(e, GearCompliance)]
        self.gear = gears[0] if gears else None
        # Where the speeds of the bodies with dry friction are in the state.
        self.speeds = [1, 2] + [self.places[i].start + 1 for i in gears]
        self.breaks = self.all_breaks()
        self.inside = 0.5 * (self.breaks[0] + self.breaks[1])
        self.modes = [int(np.sign(self.state[k])) for k in self.speeds]
        self.signs: list[list[int]] = [[] for _ in self.effects]
        self.rest_since = 0.0
        self.first_modes()

    def law(self, w: float) -> float:
        """T_l at speed w."""
        return lower_law(self.rig, w)

    def all_breaks(self) -> list[float]:
        """Start, end and every time in between at which a formula changes."""
        times = {t for t, _ in self.volts.steps}.union(*(e.breaks for e in self.effects))
        return [0.0, *sorted(t for t in times if 0.0 < t < self.seconds), self.seconds]

    def first_modes(self) -> None:
        """Signs of the switches (some depend on others), then discs at rest."""
        for i, effect in enumerate(self.effects):
            self.signs[i] = [1] * len(effect.switches(self.view(0.0, self.state, i, [1] * 9)))
        for _ in range(2):
            for i, effect in enumerate(self.effects):
                values = effect.switches(self.view(0.0, self.state, i))
                self.signs[i] = [1 if value >= 0.0 else -1 for value in values]
        for body, k in enumerate(self.speeds):
            if self.state[k] == 0.0:
                self.modes[body] = self.rest_mode(body, 0.0, self.state)

    def view(
        self,
        t: float,
        y: Sequence[float] | Array,
        which: int,
        signs: Sequence[int] | None = None,
        directions: Sequence[int] | None = None,
    ) -> View:
        """What effect number `which` sees."""
        su, sl, *_ = directions or self.modes
        dwell = t - self.rest_since if self.modes[1] == 0 else None
        inner = y[self.places[which]]
        signs = self.signs[which] if signs is None else signs
        return View(self.rig, self.law, t, self.inside, self.volts(self.inside),
                    y[0], y[1], y[2], y[3], su, sl, dwell, inner, signs)  # fmt: skip

    def forces(
        self, t: float, y: Sequence[float], directions: Sequence[int]
    ) -> list[tuple[float, float, float]]:
        """Of each body: torque without friction, size of friction in its direction, inertia."""
        rig, (su, sl, *sm) = self.rig, directions
        s = Sums(read=sl * y[2])
        for i, effect in enumerate(self.effects):
            effect.add(s, self.view(t, y, i, None, directions))
        push = rig.km * (self.volts(self.inside) + s.volts)
        string = rig.ktheta * y[0] + s.string
        level = rig.Tsu + su * rig.dTsu + (rig.bu + su * rig.dbu) * su * y[1]
        upper = push * s.drive + s.torque_u - string
        found = [
            (upper, level * (1.0 + s.scale_u) + s.size_u, rig.Ju + s.inertia_u),
            (string + s.torque_l, self.law(s.read) * (1.0 + s.scale_l) + s.size_l, rig.Jl),
        ]
        if self.gear is not None:
            gear = self.effects[self.gear]
            assert isinstance(gear, GearCompliance)
            view = self.view(t, y, self.gear)
            found.append((push - gear.torque(view), gear.friction(view, sm[0]), gear.inertia))
        return found

    def field(self, t: float, y: Array) -> list[float]:
        """The rates of the state in the present modes."""
        values = y.tolist()
        rates = [values[1] - values[2], 0.0, 0.0, values[2]]
        for i, effect in enumerate(self.effects):
            rates += effect.rates(self.view(t, values, i))
        for k, mode, (net, size, inertia) in zip(
            self.speeds, self.modes, self.forces(t, values, self.modes), strict=True
        ):
            rates[k] = (net - mode * size) / inertia if mode else 0.0
        return rates

    def margins(self, body: int, t: float, y: Sequence[float]) -> tuple[float, float]:
        """How far a body at rest is from leaving forward and backward."""
        found = []
        for direction in (1, -1):
            tried = list(self.modes)
            tried[body] = direction
            net, size, _ = self.forces(t, y, tried)[body]
            found.append(max(size, 0.0) - direction * net)
        return found[0], found[1]

    def guards(self, t: float, y: Array) -> Array:
        """Positive while the modes are right: two for each body, then the switches."""
        values = y.tolist()
        found: list[float] = []
        for body, (k, mode) in enumerate(zip(self.speeds, self.modes, strict=True)):
            found += [mode * values[k], 1.0] if mode else self.margins(body, t, values)
        for i, effect in enumerate(self.effects):
            if self.signs[i]:
                switches = effect.switches(self.view(t, values, i))
                found += [a * b for a, b in zip(self.signs[i], switches, strict=True)]
        return np.array(found)

    def rest_mode(self, body: int, t: float, y: Array) -> int:
        """Mode of a body at zero speed: at rest, or leaving along the excess torque."""
        self.modes[body] = 0
        if body == 1:
            self.rest_since = t
        forward, backward = self.margins(body, t, y.tolist())
        return 1 if forward < 0.0 else (-1 if backward < 0.0 else 0)

    def change(self, guard: int, t: float, y: Array) -> None:
        """The mode after a guard has fallen; sets the speed of a stopped body to zero."""
        bodies = len(self.speeds)
        if guard >= 2 * bodies:
            place = guard - 2 * bodies
            for signs in self.signs:
                if 0 <= place < len(signs):
                    signs[place] = -signs[place]
                place -= len(signs)
            return
        body = guard // 2
        if self.modes[body]:
            y[self.speeds[body]] = 0.0
            self.modes[body] = self.rest_mode(body, t, y)
        else:
            self.modes[body] = 1 if guard % 2 == 0 else -1


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
        LAST_EVENTS.clear()
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
                    LAST_EVENTS.append((now, fired))
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
            LAST_EVENTS.append((t, int(wrong[0])))
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
