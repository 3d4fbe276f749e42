"""Slow, independent reference for the set-valued rig, written from the paper's equations.

It shares no code with `drill_env`: SciPy's DOP853 (the stepper of `solve_ivp`) between
terminal events located by `brentq` on its dense output, one vector field per stick/slip
mode. The step is capped at 2 ms and every minimum of an event function inside a step is
looked at, so that a grazing contact cannot hide in one.

    python tests/reference.py            # recomputes tests/data/reference.npz (minutes)
    python tests/reference.py cases...   # only these, the others are kept
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853
from scipy.optimize import brentq

Array = NDArray[np.float64]
DATA = Path(__file__).parent / "data" / "reference.npz"

# Equations (6) and (8).
PAPER: dict[str, Any] = {
    "km": 3.5693, "Ju": 0.4765, "Tsu": 0.3212, "dTsu": 0.0095, "bu": 1.9833, "dbu": -0.0167,
    "Jl": 0.0326, "ktheta": 0.078, "Tsl": 0.0094, "T1": 0.0826, "T2": -0.291,
    "beta1": 6.3598, "beta2": 0.0768, "bl": 0.0042, "friction": "humped", "clamp": False,
}  # fmt: skip
STICK, SLIP, REVERSAL = 0, 1, 2
TINY = 1e-15  # rounding left by a release; not a new contact


def lower_law(par: dict[str, Any]) -> Callable[[float], float]:
    """T_l as a function of the speed |omega_l|: equation (7) or its alternatives."""
    tsl, t1, t2, bl = par["Tsl"], par["T1"], par["T2"], par["bl"]
    b1, b2 = par["beta1"], par["beta2"]

    def humped(w: float) -> float:
        return tsl + t1 * np.tanh(0.5 * b1 * w) + t2 * np.tanh(0.5 * b2 * w) + bl * w

    def stribeck(w: float) -> float:
        return tsl - t1 * np.expm1(-b1 * w) + bl * w

    def coulomb(w: float) -> float:
        return tsl + bl * w

    law = {"humped": humped, "stribeck": stribeck, "coulomb": coulomb}[par["friction"]]
    if par["clamp"]:
        return lambda w: max(law(w), 0.0)
    return law


@dataclass
class Reference:
    """Sampled states (twist, omega_u, omega_l, theta_l) and the located mode changes."""

    t: Array
    state: Array
    events: Array
    """Rows (time, disc 0 upper or 1 lower, kind)."""


class Rig:
    """Vector fields and margins of one parameter set."""

    def __init__(self, par: dict[str, Any]) -> None:
        self.par, self.lower = par, lower_law(par)

    def rates(self, x: Array, modes: Sequence[int], u: float) -> list[float]:
        """Equation (4), in the given slip directions; 0 means stuck."""
        par = self.par
        twist, wu, wl, _ = x
        su, sl = modes
        au = al = 0.0
        if su:
            t_u = par["Tsu"] + par["dTsu"] * su + (par["bu"] + par["dbu"] * su) * su * wu
            au = (par["km"] * u - par["ktheta"] * twist - t_u * su) / par["Ju"]
        if sl:
            # A step may overshoot zero before the event is located: the law's smooth side.
            al = (par["ktheta"] * twist - sl * self.lower(sl * wl)) / par["Jl"]
        return [wu - wl, au, al, wl]

    def field(self, modes: tuple[int, ...], u: float, _: float, x: Array) -> list[float]:
        """Right-hand side for SciPy."""
        return self.rates(x, modes, u)

    def event_functions(
        self, disc: int, modes: list[int], u: float, dense: Callable[[float], Array]
    ) -> list[tuple[Callable[[float], float], Callable[[float], float]]]:
        """Functions whose fall below zero ends the mode of `disc`, with their slopes."""
        mode, row = modes[disc], 1 + disc
        if mode:
            return [(
                lambda t: mode * dense(t)[row],
                lambda t: mode * self.rates(dense(t), modes, u)[row],
            )]  # fmt: skip

        def margin(sign: int, t: float) -> float:
            torque, hold = self.torque(disc, dense(t), u)
            return hold - sign * torque

        def slope(sign: int, t: float) -> float:
            x = dense(t)
            return sign * self.par["ktheta"] * (x[1] - x[2]) * (1 if disc == 0 else -1)

        return [(partial(margin, s), partial(slope, s)) for s in (1, -1)]

    def torque(self, disc: int, x: Array, u: float) -> tuple[float, float]:
        """Torque that stiction must hold, centred, and the half width of its interval."""
        par = self.par
        if disc == 0:
            return par["km"] * u - par["ktheta"] * x[0] - par["dTsu"], par["Tsu"]
        return par["ktheta"] * x[0], par["Tsl"]

    def rest_mode(self, disc: int, x: Array, u: float) -> int:
        """Mode of a disc at zero velocity: it leaves along the torque that beats stiction."""
        torque, hold = self.torque(disc, x, u)
        return 0 if abs(torque) <= hold else int(np.sign(torque))


def _crossing(
    g: Callable[[float], float], slope: Callable[[float], float], t0: float, t1: float
) -> float | None:
    """First time in (t0, t1] at which `g` turns negative, an interior dip included."""
    end = t1
    if g(t1) >= -TINY:
        # The interior test: a dip below zero between two positive ends has a minimum.
        if not slope(t0) < 0.0 < slope(t1):
            return None
        end = brentq(slope, t0, t1, xtol=1e-15)
        if g(end) >= -TINY:
            return None
    return t0 if g(t0) <= 0.0 else brentq(g, t0, end, xtol=1e-15)


def solve(
    par: dict[str, Any],
    breaks: Array,
    volts: Array,
    t_eval: Array,
    initial: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0),
    rtol: float = 1e-12,
    atol: float = 1e-13,
    cap: float = 2e-3,
) -> Reference:
    """Integrate with zero-order hold: `volts[i]` holds from `breaks[i]` to `breaks[i + 1]`."""
    rig = Rig(par)
    x = np.array(initial, dtype=float)
    states = np.zeros((len(t_eval), 4))
    states[:] = x
    log: list[tuple[float, int, int]] = []
    modes = [0, 0]
    for i, u in enumerate(volts):
        t, end = float(breaks[i]), float(breaks[i + 1])
        for disc in (0, 1):
            old, speed = modes[disc], x[1 + disc]
            modes[disc] = int(np.sign(speed)) if speed else rig.rest_mode(disc, x, u)
            if i and old != modes[disc]:
                log.append((t, disc, SLIP if old == 0 else (REVERSAL if modes[disc] else STICK)))
        solver = None
        while t < end:
            if solver is None:
                field = partial(rig.field, tuple(modes), float(u))
                solver = DOP853(field, t, x, end, max_step=cap, rtol=rtol, atol=atol,
                                first_step=min(1e-5, end - t))  # fmt: skip
            solver.step()
            if solver.status == "failed":
                raise RuntimeError(f"reference failed at {t}")
            dense = solver.dense_output()
            t_new, which = float(solver.t), -1
            for disc in (0, 1):
                for g, slope in rig.event_functions(disc, modes, float(u), dense):
                    found = _crossing(g, slope, t, t_new)
                    if found is not None and (found < t_new or which < 0):
                        t_new, which = found, disc
            inside = slice(np.searchsorted(t_eval, t, "right"),
                           np.searchsorted(t_eval, t_new, "right"))  # fmt: skip
            states[inside] = dense(t_eval[inside]).T
            t, x = t_new, dense(t_new) if which >= 0 else solver.y.copy()
            if which < 0:
                continue
            solver = None
            if modes[which] == 0:
                modes[which], kind = int(np.sign(rig.torque(which, x, u)[0])), SLIP
            else:
                x[1 + which] = 0.0
                modes[which] = rig.rest_mode(which, x, u)
                kind = REVERSAL if modes[which] else STICK
            log.append((t, which, kind))
        states[np.searchsorted(t_eval, t) :] = x
    return Reference(t_eval, states, np.array(log).reshape(-1, 3))


def quasi_random(
    seconds: float = 50.0, hold: float = 0.25, seed: int = 2004
) -> tuple[Array, Array]:
    """Seeded voltage in [-5, 5] V, a fifth of it inside the stiction band."""
    rng = np.random.default_rng(2004)
    breaks = np.linspace(0.0, seconds, round(seconds / hold) + 1)
    volts = rng.uniform(-5.0, 5.0, len(breaks) - 1)
    volts[rng.random(len(volts)) < 0.2] *= 0.015
    return breaks, volts


def cases() -> dict[str, dict[str, Any]]:
    """The stored runs: parameter changes, voltage, sample times, initial state."""

    def constant(volts: float, seconds: float, hertz: float, **more: Any) -> dict[str, Any]:
        grid = np.linspace(0.0, seconds, round(seconds * hertz) + 1)
        return {
            "breaks": np.array([0.0, seconds]), "volts": np.array([volts]), "t_eval": grid,
            "par": {}, **more,
        }  # fmt: skip

    breaks, volts = quasi_random()
    stribeck = {"friction": "stribeck", "Tsl": 0.09, "T1": -0.06, "beta1": 1.5}
    return {
        "long": constant(3.5, 200.0, 10.0),
        "random": {"breaks": breaks, "volts": volts, "par": {},
                   "t_eval": np.linspace(0.0, 50.0, 1001)},
        "graze": constant(1.8138, 260.0, 2.0),
        "stribeck": constant(1.0, 30.0, 5.0, par=stribeck),
        "coulomb": constant(0.6, 30.0, 5.0, par={"friction": "coulomb", "Tsl": 0.05},
                            initial=(2.0, 0.0, -3.0, 0.0)),
        "clamp": constant(5.0, 30.0, 5.0, par={"clamp": True}),
        "both": constant(0.0, 20.0, 5.0, initial=(3.0, -4.0, 8.0, 0.0)),
    }  # fmt: skip


def main(names: list[str]) -> None:
    """Compute the named cases (all by default) and store them."""
    stored = dict(np.load(DATA)) if DATA.exists() else {}
    for name, case in cases().items():
        if names and name not in names:
            continue
        par = {**PAPER, **case.pop("par")}
        found = solve(par, **case)
        stored[f"{name}_state"], stored[f"{name}_events"] = found.state, found.events
        print(f"{name}: {len(found.events)} events, end {found.state[-1]}", flush=True)
    np.savez_compressed(DATA, **stored)


if __name__ == "__main__":
    main(sys.argv[1:])
