"""SciPy: `least_squares` over `solve_ivp` with events, output error, finite differences.

Written as one would by hand: scalar mathematics, one call from event to event, the voltage
interpolated so that its steps do not shorten the solver's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log, tanh
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import OptimizeResult, least_squares

Array = NDArray[np.float64]
RTOL, ATOL = 1e-6, 1e-9
# Of the logarithms: where truncation and the solver's own error are about equal.
STEP = 1e-4
# Of the logarithms, or shares of the rest; starts are 30 % off at most.
REACH = 0.7
LOGS = frozenset({"km", "Ju", "Tsu", "bu", "Jl", "ktheta", "Tsl", "beta1", "beta2"})


@dataclass(frozen=True)
class Measured:
    """Voltage and angles at a constant rate."""

    rate: float
    u: Array
    angles: Array


def _field(p: dict[str, float], su: int, sl: int, volts: Any) -> Any:
    km, ktheta, ju, jl = p["km"], p["ktheta"], 1.0 / p["Ju"], 1.0 / p["Jl"]
    level, viscous = su * p["Tsu"] + p["dTsu"], p["bu"] + su * p["dbu"]
    hold, t1, t2, bl = sl * p["Tsl"], p["T1"], p["T2"], p["bl"]
    h1, h2 = 0.5 * p["beta1"], 0.5 * p["beta2"]

    def rates(t: float, x: Any) -> tuple[float, float, float, float]:
        twist, wu, wl, _ = x.tolist()
        al = au = 0.0
        if sl:
            al = (ktheta * twist - hold - t1 * tanh(h1 * wl) - t2 * tanh(h2 * wl) - bl * wl) * jl
        if su:
            au = (km * volts(t) - level - ktheta * twist - viscous * wu) * ju
        return wu - wl, au, al, wl

    return rates


def _events(p: dict[str, float], su: int, sl: int, volts: Any) -> list[Any]:
    def upper(t: float, x: Any) -> float:
        if su:
            return su * x[1]
        return p["Tsu"] - abs(p["km"] * volts(t) - p["dTsu"] - p["ktheta"] * x[0])

    def lower(_: float, x: Any) -> float:
        return sl * x[2] if sl else p["Tsl"] - abs(p["ktheta"] * x[0])

    for g in (upper, lower):
        g.terminal, g.direction = True, -1  # type: ignore[attr-defined]
    return [upper, lower]


def _rest(torque: float, hold: float) -> int:
    # With a margin: a disc that has barely broken away may come back at once, for ever.
    return 0 if abs(torque) <= hold * (1.0 + 1e-9) else (1 if torque > 0.0 else -1)


def simulated(p: dict[str, float], measured: Measured) -> Array:
    """Both angles at the samples, from rest, shape (n, 2)."""
    # A held voltage is, in the mean, the line through the middles of its holds.
    shifted = np.append(measured.u, measured.u[-1]).tolist()
    rate, last = measured.rate, len(measured.u) - 1

    def volts(t: float) -> float:
        place = max(t * rate - 0.5, 0.0)
        i = min(int(place), last)
        return shifted[i] + (place - i) * (shifted[i + 1] - shifted[i])

    grid = np.arange(len(measured.u)) / rate
    out = np.zeros((len(grid), 2))
    t, x, done = 0.0, np.zeros(4), 0
    su, sl = _rest(p["km"] * volts(0.0) - p["dTsu"], p["Tsu"]), 0
    while t < grid[-1]:
        run = solve_ivp(
            _field(p, su, sl, volts), (t, grid[-1]), x, t_eval=grid[done:],
            events=_events(p, su, sl, volts), rtol=RTOL, atol=ATOL,
        )  # fmt: skip
        if len(run.t):
            out[done : done + len(run.t), 0] = run.y[0] + run.y[3]
            out[done : done + len(run.t), 1] = run.y[3]
            done += len(run.t)
        if run.status == 0:
            break
        which = 0 if len(run.t_events[0]) else 1
        t, x = float(run.t_events[which][0]), run.y_events[which][0].copy()
        pull = p["km"] * volts(t) - p["dTsu"] - p["ktheta"] * x[0]
        torque, hold, moving = (pull, p["Tsu"], su) if which == 0 else (
            p["ktheta"] * x[0], p["Tsl"], sl,
        )  # fmt: skip
        if moving:
            x[1 + which] = 0.0
        mode = _rest(torque, hold) if moving else (1 if torque > 0.0 else -1)
        su, sl = (mode, sl) if which == 0 else (su, mode)
    return out


@dataclass(frozen=True)
class Fit:
    """The peer's problem.

    Args:
        start: parameters to begin with.
        free: names of those to fit.
        recordings: all of them at once.
    """

    start: dict[str, float]
    free: tuple[str, ...]
    recordings: Sequence[Measured]

    def vector(self, values: dict[str, float]) -> Array:
        return np.array([log(values[n]) if n in LOGS else values[n] for n in self.free])

    def values(self, vector: Array) -> dict[str, float]:
        moved = zip(self.free, vector.tolist(), strict=True)
        return self.start | {n: exp(v) if n in LOGS else v for n, v in moved}

    def residuals(self, vector: Array) -> Array:
        p = self.values(vector)
        return np.concatenate([(simulated(p, m) - m.angles).ravel() for m in self.recordings])

    def solve(self, most: int | None = None) -> tuple[OptimizeResult, int]:
        """Least squares, and how many times it simulated all recordings."""
        calls = 0

        def counted(vector: Array) -> Array:
            nonlocal calls
            calls += 1
            return self.residuals(vector)

        first = self.vector(self.start)
        # Without bounds a first step sends some parameters off by orders of magnitude.
        reach = np.where([n in LOGS for n in self.free], REACH, REACH * np.abs(first))
        found = least_squares(
            counted, first, diff_step=STEP, x_scale="jac", method="trf", max_nfev=most,
            bounds=(first - reach, first + reach),
        )  # fmt: skip
        return found, calls
