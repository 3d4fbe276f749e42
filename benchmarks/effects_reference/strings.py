"""Effects of the string, and bodies on a spring at a disc."""

from __future__ import annotations

from math import pi
from typing import Any

from .view import Effect, Start, Sums, View, clip_by_signs


class LoadDependentFriction(Effect):
    def add(self, s: Sums, v: View) -> None:
        s.size_u += self.q["coefficient"] * v.rig.ktheta * v.signs[0] * v.x

    def switches(self, v: View) -> list[float]:
        return [v.x]


class StringAsymmetry(Effect):
    def add(self, s: Sums, v: View) -> None:
        s.string += self.q["coefficient"] * v.signs[0] * v.x

    def switches(self, v: View) -> list[float]:
        return [v.x]


class StringPlay(Effect):
    def add(self, s: Sums, v: View) -> None:
        s.string -= v.rig.ktheta * clip_by_signs(v.x, 0.5 * self.q["gap"], v.signs)

    def switches(self, v: View) -> list[float]:
        return [v.x - 0.5 * self.q["gap"], v.x + 0.5 * self.q["gap"]]


class StringHysteresis(Effect):
    initial = [0.0]

    def add(self, s: Sums, v: View) -> None:
        s.string += self.q["torque"] * v.inner[0]

    def rates(self, v: View) -> list[float]:
        r, z = v.wu - v.wl, v.inner[0]
        size_r, size_z = v.signs[0] * r, v.signs[1] * z
        return [(r - 0.5 * (size_r * z + r * size_z)) / self.q["width"]]

    def switches(self, v: View) -> list[float]:
        return [v.wu - v.wl, v.inner[0]]


class StringCreep(Effect):
    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.initial = [start.state[0]]

    def add(self, s: Sums, v: View) -> None:
        s.string -= self.q["compliance"] * v.rig.ktheta * v.inner[0]

    def rates(self, v: View) -> list[float]:
        return [(v.x - v.inner[0]) / self.q["time_constant"]]


class StringInertia(Effect):
    """Inner states: z and y = z' + (w_u + w_l)/2, which is free of accelerations."""

    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.initial = [0.0, 0.5 * (start.state[1] + start.state[2])]

    def add(self, s: Sums, v: View) -> None:
        # Two halves: each pulls its disc by its own stretch and the rate of that.
        damper = 2 * self.q["damping"] * 2 * v.rig.ktheta / (2 * pi * self.q["frequency"])
        body = v.inner[1]
        s.torque_u += 2 * v.rig.ktheta * v.inner[0] + damper * (body - v.wu)
        s.torque_l += 2 * v.rig.ktheta * v.inner[0] + damper * (body - v.wl)

    def rates(self, v: View) -> list[float]:
        z, w = v.inner[0], 2 * pi * self.q["frequency"]
        speed = v.inner[1] - 0.5 * (v.wu + v.wl)
        return [speed, -w * w * z - 2 * self.q["damping"] * w * speed]


# Bodies on a spring at a disc.
class UpperResonator(Effect):
    """Inner states: angle of the body ahead of the disc, speed of the body."""

    place = 1

    def inertia(self, rig: Any) -> float:
        return self.q["share"] * rig.Ju

    def disc(self, v: View) -> float:
        return v.wu

    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.initial = [0.0, start.state[self.place]]

    def push(self, v: View) -> float:
        """Of spring and damper on the disc, by the body's inertia."""
        w = 2 * pi * self.q["frequency"]
        return w * w * v.inner[0] + 2 * self.q["damping"] * w * (v.inner[1] - self.disc(v))

    def add(self, s: Sums, v: View) -> None:
        s.torque_u += self.inertia(v.rig) * self.push(v)

    def rates(self, v: View) -> list[float]:
        return [v.inner[1] - self.disc(v), -self.push(v)]


class LowerResonator(UpperResonator):
    place = 2

    def inertia(self, rig: Any) -> float:
        return self.q["share"] * rig.Jl

    def disc(self, v: View) -> float:
        return v.wl

    def add(self, s: Sums, v: View) -> None:
        s.torque_l += self.inertia(v.rig) * self.push(v)


class UpperViscousDamper(Effect):
    """Inner state: speed of the body."""

    place = 1

    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.initial = [start.state[self.place]]

    def rates(self, v: View) -> list[float]:
        return [((v.wu if self.place == 1 else v.wl) - v.inner[0]) / self.q["time_constant"]]

    def add(self, s: Sums, v: View) -> None:
        s.torque_u += self.q["share"] * v.rig.Ju * -self.rates(v)[0]


class LowerViscousDamper(UpperViscousDamper):
    place = 2

    def add(self, s: Sums, v: View) -> None:
        s.torque_l += self.q["share"] * v.rig.Jl * -self.rates(v)[0]
