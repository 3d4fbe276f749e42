"""Effects of the friction of both discs that remember or are switched."""

from __future__ import annotations

from math import exp, log
from typing import Any

from .view import MOVING, Effect, Start, Sums, View


class FrictionStep(Effect):
    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.breaks = [q["time"]]

    def add(self, s: Sums, v: View) -> None:
        s.scale_l += self.q["step"] if v.inside >= self.q["time"] else 0.0


class TorquePulse(Effect):
    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.breaks = [q["time"], q["time"] + q["duration"]]

    def add(self, s: Sums, v: View) -> None:
        s.torque_l += self.q["torque"] if self.breaks[0] <= v.inside < self.breaks[1] else 0.0


class FrictionHeating(Effect):
    initial = [0.0]

    def add(self, s: Sums, v: View) -> None:
        s.scale_l -= self.q["loss"] * v.inner[0]

    def rates(self, v: View) -> list[float]:
        power = v.law(v.speed_l) * v.speed_l
        return [(power / 0.5 - v.inner[0]) / self.q["time_constant"]]


class Wear(Effect):
    initial = [0.0]

    def add(self, s: Sums, v: View) -> None:
        s.scale_l -= self.q["loss"] * (1.0 - exp(-v.inner[0] / self.q["distance"]))

    def rates(self, v: View) -> list[float]:
        return [v.speed_l]


class Presliding(Effect):
    initial = [0.0]

    def add(self, s: Sums, v: View) -> None:
        s.scale_l -= 1.0
        s.torque_l -= v.inner[0] * v.law(v.speed_l)

    def rates(self, v: View) -> list[float]:
        return [v.wl * (1.0 - v.sl * v.inner[0]) / self.q["distance"]]


class LowerLuGre(Effect):
    initial = [0.0]

    def add(self, s: Sums, v: View) -> None:
        s.scale_l -= 1.0
        s.torque_l -= v.inner[0]

    def rates(self, v: View) -> list[float]:
        level = max(v.law(v.speed_l), v.rig.Tsl / 10.0)
        yielded = v.speed_l * v.inner[0] / level
        return [self.q["stiffness"] * (v.wl - yielded)]


class UpperPresliding(Effect):
    def setup(self, q: dict[str, Any], start: Start) -> None:
        speed = start.state[1]
        self.initial = [0.0 if abs(speed) < MOVING else (1.0 if speed > 0 else -1.0)]

    def add(self, s: Sums, v: View) -> None:
        s.size_u -= self.q["torque"]
        s.torque_u -= self.q["torque"] * v.inner[0]

    def rates(self, v: View) -> list[float]:
        return [v.wu * (1.0 - v.su * v.inner[0]) / self.q["distance"]]


class UpperFrictionLag(Effect):
    asks_hold = True

    def setup(self, q: dict[str, Any], start: Start) -> None:
        speed = start.state[1]
        self.initial = [0.0 if abs(speed) < MOVING else (1.0 if speed > 0 else -1.0)]

    def add(self, s: Sums, v: View) -> None:
        s.size_u -= self.q["torque"]
        s.torque_u -= self.q["torque"] * v.inner[0]

    def rates(self, v: View) -> list[float]:
        return [(v.hold - v.inner[0]) / self.q["time_constant"]]


class FrictionLag(Effect):
    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.initial = [abs(start.state[2])]

    def add(self, s: Sums, v: View) -> None:
        s.read = v.inner[0]

    def rates(self, v: View) -> list[float]:
        return [(v.speed_l - v.inner[0]) / self.q["time_constant"]]


class RateState(Effect):
    def settled(self, speed: float) -> float:
        # A step may overshoot zero speed before its event is located: stay off the pole.
        slow = self.q["speed"] / 20.0
        return self.q["distance"] / (max(speed, -0.5 * slow) + slow)

    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.initial = [self.settled(abs(start.state[2]))]

    def add(self, s: Sums, v: View) -> None:
        pace, settled = self.q["speed"] / self.q["distance"], self.settled(v.speed_l)
        s.size_l += self.q["torque"] * log((1 + pace * v.inner[0]) / (1 + pace * settled))

    def rates(self, v: View) -> list[float]:
        return [1.0 - v.inner[0] / self.settled(v.speed_l)]
