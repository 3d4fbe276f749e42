"""Linear design: the rig and its encoders as one sampled system, and laws over the set point."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import control as ct
import numpy as np
from scipy.linalg import expm

from drill_env._types import FloatArray
from drill_env.dynamics import equilibrium_voltage
from drill_env.dynamics.kernels import fill_jacobian
from drill_env.environment.config import EnvConfig, View
from drill_env.friction import kernel_record
from drill_env.parameters import Rig

from ._kernels import advance_laws, law_volts

SAMPLED_STATES = 9
TWIST, OMEGA_U, OMEGA_L = 0, 1, 2
_SEEN = (TWIST, 7, 8)
_GRID = 1.02


@dataclass(frozen=True, slots=True)
class Law:
    """One linear law, all in deviations from the reference that goes with the set point.

    memory' = f memory + g error + h applied, voltage = m memory + d error; `applied` is the
    voltage after clipping, so that an observer inside knows what the rig really got.
    """

    f: FloatArray
    g: FloatArray
    h: FloatArray
    m: FloatArray
    d: FloatArray

    def unclipped(self, period: float) -> ct.StateSpace:
        """From measurement errors to volts, where the limit is not met."""
        return ct.StateSpace(
            self.f + np.outer(self.h, self.m), self.g + np.outer(self.h, self.d),
            self.m[None, :], self.d[None, :], period,
        )  # fmt: skip


def rig_matrices(rig: Rig, omega: float) -> tuple[FloatArray, FloatArray]:
    """A (3, 3) and B (3,) of (twist, omega_u, omega_l) about steady turning at `omega`."""
    entry = np.zeros(4)
    fill_jacobian(kernel_record(rig)[0], 1, 1, 0, omega, entry)
    a = np.array([[0.0, 1.0, -1.0], [entry[0], entry[1], 0.0], [entry[2], 0.0, entry[3]]])
    return a, np.array([0.0, rig.km / rig.Ju, 0.0])


def sampled_rig(config: EnvConfig, omega: float, rig: Rig | None = None) -> ct.StateSpace:
    """The rig with encoders and filters, from volts to (twist, omega_u, omega_l) as seen.

    Exact but for quantisation: encoder differences are integrals of the true speed, filters
    run at the encoder's rate, and a voltage is held over a control period.

    Returns:
        Nine states: the three of the rig, two a filter, the two filtered speeds.
    """
    encoder, rig = config.encoder, rig or config.rig
    a, b = rig_matrices(rig, omega)
    whole = np.zeros((6, 6))
    whole[:3, :3], whole[:3, 5] = a, b
    whole[3, OMEGA_U] = whole[4, OMEGA_L] = 1.0
    step = expm(whole / encoder.rate_hz)
    one, force = np.zeros((SAMPLED_STATES, SAMPLED_STATES)), np.zeros(SAMPLED_STATES)
    one[:3, :3], force[:3] = step[:3, :3], step[:3, 5]
    num, den = encoder.coefficients()
    for disc, (first, seen) in enumerate(((3, 7), (5, 8))):
        moved, push = step[3 + disc, :3] * encoder.rate_hz, step[3 + disc, 5] * encoder.rate_hz
        # Transposed direct form: y = b0 x + s1, s1' = b1 x - a1 y + s2, s2' = b2 x - a2 y.
        one[seen, :3], one[seen, first], force[seen] = num[0] * moved, 1.0, num[0] * push
        for k in (1, 2):
            row = first + k - 1
            one[row] = -den[k] * one[seen]
            one[row, :3] += num[k] * moved
            force[row] = num[k] * push - den[k] * force[seen]
        one[first, first + 1] += 1.0
    total, gain = np.eye(SAMPLED_STATES), np.zeros(SAMPLED_STATES)
    for _ in range(config.samples):
        total, gain = one @ total, one @ gain + force
    c = np.eye(SAMPLED_STATES)[list(_SEEN)]
    return ct.StateSpace(total, gain[:, None], c, np.zeros((3, 1)), config.control_period)


def surface_part(system: ct.StateSpace) -> ct.StateSpace:
    """The sampled rig without what only the lower encoder sees: six states, omega_u alone."""
    keep = [0, 1, 2, 3, 4, 7]
    return ct.StateSpace(
        system.A[np.ix_(keep, keep)], system.B[keep], system.C[[1]][:, keep], [[0.0]], system.dt
    )


def noise_levels(config: EnvConfig) -> FloatArray:
    """Standard deviation of (twist, omega_u, omega_l) as seen, from whole counts, shape (3,)."""
    encoder = config.encoder
    count = np.hypot(encoder.quantum / np.sqrt(12.0), encoder.noise_rad)
    num, den = encoder.coefficients()
    impulse = np.zeros(400)
    impulse[:2] = encoder.rate_hz * np.array([1.0, -1.0])
    from scipy.signal import lfilter

    speed = float(np.linalg.norm(np.asarray(lfilter(num, den, impulse)))) * count
    return np.maximum(np.array([np.sqrt(2.0) * count, speed, speed]), 1e-5)


class ScheduledLaw(ABC):
    """A controller that follows one linear law per set point.

    Laws are designed when a set point is first met and kept; set points share a law within
    2 %. References are the nominal rig's equilibrium at the very set point.

    Args:
        config: environment; its rig is the design model.
    """

    view: View = "both"
    history: int = 0

    def __init__(self, config: EnvConfig) -> None:
        self.config = config
        self._known: dict[int, int] = {}
        self._laws: list[Law] = []
        self._stacked: tuple[FloatArray, ...] = ()
        self._memory = np.zeros((0, 0))
        self._setpoints = np.zeros(0)

    @abstractmethod
    def law(self, setpoint: float) -> Law:
        """The linear law at a set point (rad/s)."""

    def reset(self, n: int) -> None:
        """Forget every state."""
        self._memory = np.zeros((n, 0))
        self._setpoints = np.full(n, np.nan)

    def memory(self) -> FloatArray:
        """States of the laws, shape (n, m)."""
        return self._memory.copy()

    def recall(self, memory: FloatArray) -> None:
        """Continue from states of the laws, shape (n, m)."""
        self._memory = memory.copy()
        self._setpoints = np.full(len(memory), np.nan)

    def act(self, observation: FloatArray) -> FloatArray:
        """Voltage (V) from the measurements and the set point."""
        seen = observation.shape[1] - 2
        if not np.array_equal(observation[:, seen], self._setpoints):
            self._follow(observation[:, seen].copy())
        error = observation[:, :seen] - self._references
        volts = self._decide(error)
        advance_laws(
            self._index, error, self._volts, self._stacked, volts, self._memory, self._scratch
        )
        return volts

    def _decide(self, error: FloatArray) -> FloatArray:
        """Voltages (V) within the limit for measurement errors of shape (n, p)."""
        volts = np.empty(len(error))
        law_volts(
            self._index, error, self._volts, self.config.voltage_limit, self._stacked,
            self._memory, volts,
        )  # fmt: skip
        return volts

    def _follow(self, setpoints: FloatArray) -> None:
        rig = self.config.rig
        self._setpoints = setpoints
        self._volts = equilibrium_voltage(rig, setpoints)
        twist = (rig.km * self._volts - rig.Tsu - rig.dTsu) - (rig.bu + rig.dbu) * setpoints
        columns = [twist / rig.ktheta, setpoints, setpoints]
        self._references = np.column_stack(columns if self.view == "both" else columns[1:2])
        keys = np.round(np.log(setpoints) / np.log(_GRID)).astype(int)
        for key in np.unique(keys).tolist():
            if key not in self._known:
                self._known[key] = len(self._laws)
                self._laws.append(self.law(_GRID**key))
        self._index = np.array([self._known[key] for key in keys.tolist()])
        self._stacked = tuple(
            np.ascontiguousarray(np.array([getattr(law, name) for law in self._laws]))
            for name in ("f", "g", "h", "m", "d")
        )
        states = self._stacked[0].shape[1]
        if self._memory.shape[1] != states:
            self._memory = np.zeros((len(setpoints), states))
        self._scratch = np.zeros(states)
