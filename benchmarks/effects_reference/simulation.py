"""A rig with effects in given modes: its smooth vector field and what ends them."""

from __future__ import annotations

from collections.abc import Sequence
from math import expm1, tanh
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .drive import GearCompliance
from .effects import EFFECTS
from .view import Effect, Start, Sums, View, Volts

Array = NDArray[np.float64]


def lower_law(rig: Any, w: float) -> float:
    """T_l at speed w >= 0, equation (7), where 1 - 2/(1 + e^a) is tanh(a/2), or another law."""
    bent = 0.0
    if rig.friction == "humped":
        bent = rig.T1 * tanh(0.5 * rig.beta1 * w) + rig.T2 * tanh(0.5 * rig.beta2 * w)
    elif rig.friction == "stribeck":
        # A step may reach far past zero before its event is located; no float holds e^1000.
        bent = -rig.T1 * expm1(min(-rig.beta1 * w, 100.0))
    return rig.Tsl + bent + rig.bl * w


class Clamp(Effect):
    """Friction that is never negative: what is frozen is the sign of the law at the own speed."""

    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.rig = start.rig

    def switches(self, v: View) -> list[float]:
        return [lower_law(self.rig, v.speed_l)]


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
        if rig.inertias != 2 or (rig.clamp and any(q["id"] == "friction_lag" for q in effects)):
            raise ValueError("the reference knows two discs, and no clamp where friction lags")
        self.rig, self.volts, self.seconds = rig, Volts(u), seconds
        self.signs: list[list[int]] = []
        start = Start(rig, self.law, self.volts, initial, seconds)
        clamp: list[Effect] = [Clamp({}, start)] if rig.clamp else []
        self.effects = [*clamp, *(EFFECTS[q["id"]](q, start) for q in effects)]
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
        self.signs = [[] for _ in self.effects]
        self.rest_since = 0.0
        self.first_modes()

    def law(self, w: float) -> float:
        """T_l at speed w, on the present side of the clamp."""
        off = self.rig.clamp and self.signs and self.signs[0][0] < 0
        return 0.0 if off else lower_law(self.rig, w)

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
            view = self.view(t, values, i)
            if effect.asks_hold:
                view.hold = self.hold(t, values)
            rates += effect.rates(view)
        for k, mode, (net, size, inertia) in zip(
            self.speeds, self.modes, self.forces(t, values, self.modes), strict=True
        ):
            rates[k] = (net - mode * size) / inertia if mode else 0.0
        return rates

    def hold(self, t: float, y: Sequence[float]) -> float:
        """Direction of the upper disc, or the share of its friction that holds it at rest."""
        if self.modes[0]:
            return self.modes[0]
        (net, ahead, _), *_ = self.forces(t, y, [1, *self.modes[1:]])
        (_, back, _), *_ = self.forces(t, y, [-1, *self.modes[1:]])
        return (2.0 * net - ahead + back) / (ahead + back)

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
