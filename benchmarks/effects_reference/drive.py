"""Effects of the voltage path and of the gear behind the motor."""

from __future__ import annotations

from math import pi, sqrt
from typing import Any

from .view import Effect, Start, Sums, View, clip_by_signs


class ActuatorLag(Effect):
    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.initial = [start.volts_before]

    def add(self, s: Sums, v: View) -> None:
        s.volts += v.inner[0] - v.u

    def rates(self, v: View) -> list[float]:
        return [(v.u - v.inner[0]) / self.q["time_constant"]]


class DriveResonance(Effect):
    """Inner states: the voltage that acts, and how fast it changes."""

    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.initial = [start.volts_before, 0.0]

    def add(self, s: Sums, v: View) -> None:
        s.volts += v.inner[0] - v.u

    def rates(self, v: View) -> list[float]:
        w = 2 * pi * self.q["frequency"]
        acting, rate = v.inner
        return [rate, w * w * (v.u - acting) - 2 * self.q["damping"] * w * rate]


class SlewLimit(Effect):
    """Follows the voltage in straight pieces, known beforehand: (time, value, slope)."""

    def setup(self, q: dict[str, Any], start: Start) -> None:
        now, self.pieces = start.volts_before, []
        times = [max(t, 0.0) for t, _ in start.volts.steps]
        for t, end in zip(times, [*times[1:], start.seconds], strict=True):
            aim = start.volts(t)
            slope = q["rate"] if aim > now else -q["rate"]
            reach = t + abs(aim - now) / q["rate"]
            if reach > t:
                self.pieces.append((t, now, slope))
            if reach <= end:
                self.pieces.append((reach, aim, 0.0))
                now = aim
            else:
                now += slope * (end - t)
        self.breaks = [piece[0] for piece in self.pieces]

    def add(self, s: Sums, v: View) -> None:
        start, value, slope = [p for p in self.pieces if p[0] <= v.inside][-1]
        s.volts += value + slope * (v.t - start) - v.u


class InputDelay(Effect):
    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.breaks = [max(t, 0.0) + q["delay"] for t, _ in start.volts.steps]
        self.start, self.before = start, start.volts_before

    def add(self, s: Sums, v: View) -> None:
        then = v.inside - self.q["delay"]
        s.volts += (self.start.volts(then) if then >= 0.0 else self.before) - v.u


class CurrentLimit(Effect):
    def lacking(self, v: View) -> float:
        return v.u - self.q["back_emf"] * v.wu

    def add(self, s: Sums, v: View) -> None:
        wanted = self.lacking(v)
        s.volts += clip_by_signs(wanted, self.q["level"], v.signs) - wanted

    def switches(self, v: View) -> list[float]:
        wanted = self.lacking(v)
        return [wanted - self.q["level"], wanted + self.q["level"]]


class MotorHeating(Effect):
    initial = [0.0]

    def add(self, s: Sums, v: View) -> None:
        s.volts -= self.q["loss"] * v.inner[0] * v.u

    def rates(self, v: View) -> list[float]:
        return [(v.u**2 / 9.0 - v.inner[0]) / self.q["time_constant"]]


# The gear between motor and upper disc; the motor is a third body with dry friction.
class GearCompliance(Effect):
    """Inner states: angle of the motor ahead of the disc, speed of the motor."""

    def setup(self, q: dict[str, Any], start: Start) -> None:
        share = q["motor_share"]
        self.inertia = share * start.rig.Ju
        reduced = self.inertia * (1.0 - share)
        self.stiffness = (2 * pi * q["frequency"]) ** 2 * reduced
        self.damper = 2 * q["damping"] * sqrt(self.stiffness * reduced)
        self.initial = [0.0, start.state[1]]

    def torque(self, v: View) -> float:
        return self.stiffness * v.inner[0] + self.damper * (v.inner[1] - v.wu)

    def friction(self, v: View, direction: int) -> float:
        """Size of the motor's friction in a direction."""
        rig, speed = v.rig, direction * v.inner[1]
        level = rig.Tsu + direction * rig.dTsu + (rig.bu + direction * rig.dbu) * speed
        return self.q["friction_share"] * level

    def add(self, s: Sums, v: View) -> None:
        s.drive = 0.0
        s.inertia_u -= self.inertia
        s.torque_u += self.torque(v)
        s.scale_u -= self.q["friction_share"]

    def rates(self, v: View) -> list[float]:
        return [v.inner[1] - v.wu, 0.0]  # the motor's acceleration comes from its contact


class GearBacklash(GearCompliance):
    def pushing(self, v: View) -> float:
        wound = v.inner[0] - clip_by_signs(v.inner[0], 0.5 * self.q["gap"], v.signs)
        return self.stiffness * wound + self.damper * (v.inner[1] - v.wu)

    def torque(self, v: View) -> float:
        above, below = v.signs[0] > 0, v.signs[1] < 0
        pushes = (above and v.signs[2] > 0) or (below and v.signs[2] < 0)
        return self.pushing(v) if pushes else 0.0

    def switches(self, v: View) -> list[float]:
        half = 0.5 * self.q["gap"]
        return [v.inner[0] - half, v.inner[0] + half, self.pushing(v)]
