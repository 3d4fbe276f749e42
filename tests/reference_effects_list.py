"""The effects of `reference_effects`, one function or class each, written from their formulas.

An effect adds its terms to the `Sums` of the equations of motion. One with a memory brings
inner states and their rates; one with a kink brings *switches*, functions of the state whose
sign is frozen between two events, so that what is integrated is always smooth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, exp, log, pi, sqrt
from typing import Any

Law = Callable[[float], float]
MOVING = 0.15  # a rig that starts below this speed (rad/s) was at rest before the start


@dataclass
class Sums:
    """What all effects together add to the equations of motion."""

    read: float
    volts: float = 0.0
    torque_u: float = 0.0
    torque_l: float = 0.0
    string: float = 0.0
    size_u: float = 0.0
    size_l: float = 0.0
    scale_u: float = 0.0
    scale_l: float = 0.0
    inertia_u: float = 0.0
    drive: float = 1.0


@dataclass
class View:
    """What an effect may see: time, voltage, state, directions and its own inner states."""

    rig: Any
    law: Law
    t: float
    inside: float
    """A time strictly inside the present segment, which tells what is switched on in it."""
    u: float
    x: float
    wu: float
    wl: float
    angle_l: float
    su: int
    sl: int
    dwell: float | None
    """Time since the lower disc came to rest, None while it moves."""
    inner: Sequence[float] = ()
    signs: Sequence[int] = ()

    @property
    def angle_u(self) -> float:
        return self.x + self.angle_l

    @property
    def speed_u(self) -> float:
        return self.su * self.wu

    @property
    def speed_l(self) -> float:
        return self.sl * self.wl


class Volts:
    """The piecewise-constant voltage."""

    def __init__(self, u: float | Sequence[tuple[float, float]], before: float = 0.0) -> None:
        steps = sorted(u) if isinstance(u, Sequence) else [(0.0, float(u))]
        self.steps = [(float(t), float(v)) for t, v in steps]

    def __call__(self, t: float) -> float:
        now = self.steps[0][1]
        for start, volts in self.steps:
            now = volts if start <= t else now
        return now


@dataclass
class Start:
    """What an effect needs to set up its memory."""

    rig: Any
    law: Law
    volts: Volts
    state: Sequence[float]
    seconds: float

    @property
    def volts_before(self) -> float:
        return 0.0 if abs(self.state[1]) < MOVING else self.volts(0.0)


class Effect:
    """An effect without memory, kink or switching time; the others override what they need."""

    initial: list[float] = []
    breaks: list[float] = []

    def __init__(self, q: dict[str, Any], start: Start) -> None:
        self.q = q
        self.setup(q, start)

    def setup(self, q: dict[str, Any], start: Start) -> None: ...

    def add(self, s: Sums, v: View) -> None: ...

    def rates(self, v: View) -> list[float]:
        return []

    def switches(self, v: View) -> list[float]:
        return []


def clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def clip_by_signs(value: float, limit: float, signs: Sequence[int]) -> float:
    """The clip, on the piece told by the signs of value - limit and value + limit."""
    if signs[0] > 0:
        return limit
    return value if signs[1] > 0 else -limit


# Effects that are a formula of the present state.
def amplifier_saturation(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts += clip(v.u, q["level"]) - v.u


def soft_saturation(q: dict[str, Any], s: Sums, v: View) -> None:
    sharp = 1.0 / q["softness"]
    s.volts += v.u * (1.0 + (abs(v.u) / q["level"]) ** sharp) ** (-1.0 / sharp) - v.u


def amplifier_deadzone(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts -= clip(v.u, q["width"])


def supply_sag(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts -= q["sag"] * abs(v.u) * v.u


def gain_asymmetry(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts += q["asymmetry"] * abs(v.u)


def drive_braking_loss(q: dict[str, Any], s: Sums, v: View) -> None:
    if v.u * v.su < 0.0:
        s.volts -= q["loss"] * v.u


def motor_fade(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts -= q["loss"] * (1.0 - exp(-v.t / q["time_constant"])) * v.u


def torque_ripple(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u += q["torque"] * cos(q["order"] * v.angle_u + q["phase"])


def gear_eccentricity(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts += v.u * q["eccentricity"] * cos(v.angle_u + q["phase"])


def commutation_ripple(q: dict[str, Any], s: Sums, v: View) -> None:
    s.volts += v.u * q["depth"] * cos(q["order"] * v.angle_u + q["phase"])


def upper_coulomb(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_u += q["torque"]


def upper_stribeck(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_u += q["torque"] * exp(-v.speed_u / q["velocity"])


def lower_stribeck(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_l += q["torque"] * exp(-v.speed_l / q["velocity"])


def upper_load_friction(q: dict[str, Any], s: Sums, v: View) -> None:
    s.size_u += q["coefficient"] * abs(v.rig.km * v.u)


def upper_spring(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["stiffness"] * (v.angle_u - q["centre"])


def upper_viscous(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["damping"] * v.wu


def upper_quadratic_drag(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["coefficient"] * v.speed_u * v.wu


def quadratic_drag(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_l -= q["coefficient"] * v.speed_l * v.wl


def upper_asymmetry(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["damping"] * v.speed_u


def upper_offset(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u -= q["torque"]


def friction_warmup(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_u += q["excess"] * exp(-v.t / q["time_constant"])


def lower_disturbance(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_l += q["torque"] * cos(2 * pi * q["frequency"] * v.t + q["phase"])


def upper_disturbance(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u += q["torque"] * cos(2 * pi * q["frequency"] * v.t + q["phase"])


def string_damping(q: dict[str, Any], s: Sums, v: View) -> None:
    s.string += q["damping"] * (v.wu - v.wl)


def string_hardening(q: dict[str, Any], s: Sums, v: View) -> None:
    s.string += q["coefficient"] * v.x**3


def unbalance(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_l += q["torque"] * cos(v.angle_l + q["phase"])


def upper_unbalance(q: dict[str, Any], s: Sums, v: View) -> None:
    s.torque_u += q["torque"] * cos(v.angle_u + q["phase"])


def brake_runout(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_l += q["runout"] * cos(q["order"] * v.angle_l + q["phase"])


def lower_asymmetry(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_l += q["asymmetry"] * v.sl


def friction_drift(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_l += q["drift"] * v.t / 60.0


def friction_settling(q: dict[str, Any], s: Sums, v: View) -> None:
    s.scale_l -= q["change"] * (1.0 - exp(-v.t / q["time_constant"]))


def whirl_drag(q: dict[str, Any], s: Sums, v: View) -> None:
    r = v.wl / q["speed"]
    s.torque_l -= q["torque"] * r**5 / ((1 - r * r) ** 2 + (2 * q["damping"] * r) ** 2)


def dwell_stiction(q: dict[str, Any], s: Sums, v: View) -> None:
    if v.dwell is not None:
        s.size_l += q["torque"] * (1.0 - exp(-v.dwell / q["time_constant"]))


FORMULAS: dict[str, Callable[[dict[str, Any], Sums, View], None]] = {
    f.__name__: f
    for f in (
        amplifier_saturation, amplifier_deadzone, supply_sag, gain_asymmetry, torque_ripple,
        gear_eccentricity, upper_coulomb, upper_stribeck, lower_stribeck, upper_viscous,
        upper_quadratic_drag, quadratic_drag, upper_asymmetry, upper_offset, friction_warmup,
        lower_disturbance, upper_disturbance, string_damping, string_hardening, unbalance,
        upper_unbalance, brake_runout, lower_asymmetry, friction_drift, whirl_drag,
        dwell_stiction, drive_braking_loss, motor_fade, upper_load_friction, upper_spring,
        friction_settling, commutation_ripple, soft_saturation,
    )
}  # fmt: skip


class Formula(Effect):
    """One of the functions above."""

    def add(self, s: Sums, v: View) -> None:
        FORMULAS[self.q["id"]](self.q, s, v)


# The voltage path.
class ActuatorLag(Effect):
    def setup(self, q: dict[str, Any], start: Start) -> None:
        self.initial = [start.volts_before]

    def add(self, s: Sums, v: View) -> None:
        s.volts += v.inner[0] - v.u

    def rates(self, v: View) -> list[float]:
        return [(v.u - v.inner[0]) / self.q["time_constant"]]


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


# The string.
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
        s.torque_u += 2 * v.rig.ktheta * v.inner[0]
        s.torque_l += 2 * v.rig.ktheta * v.inner[0]

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


# The lower disc's brake, and presliding of both discs.
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


class UpperPresliding(Effect):
    def setup(self, q: dict[str, Any], start: Start) -> None:
        speed = start.state[1]
        self.initial = [0.0 if abs(speed) < MOVING else (1.0 if speed > 0 else -1.0)]

    def add(self, s: Sums, v: View) -> None:
        s.size_u -= self.q["torque"]
        s.torque_u -= self.q["torque"] * v.inner[0]

    def rates(self, v: View) -> list[float]:
        return [v.wu * (1.0 - v.su * v.inner[0]) / self.q["distance"]]


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


EFFECTS: dict[str, type[Effect]] = {
    **dict.fromkeys(FORMULAS, Formula),
    "actuator_lag": ActuatorLag,
    "slew_limit": SlewLimit,
    "input_delay": InputDelay,
    "current_limit": CurrentLimit,
    "motor_heating": MotorHeating,
    "gear_compliance": GearCompliance,
    "gear_backlash": GearBacklash,
    "load_dependent_friction": LoadDependentFriction,
    "string_asymmetry": StringAsymmetry,
    "string_play": StringPlay,
    "string_hysteresis": StringHysteresis,
    "string_creep": StringCreep,
    "string_inertia": StringInertia,
    "upper_resonator": UpperResonator,
    "lower_resonator": LowerResonator,
    "friction_step": FrictionStep,
    "torque_pulse": TorquePulse,
    "friction_heating": FrictionHeating,
    "wear": Wear,
    "presliding": Presliding,
    "upper_presliding": UpperPresliding,
    "friction_lag": FrictionLag,
    "rate_state": RateState,
}
