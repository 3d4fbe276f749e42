"""SciPy: `solve_ivp` DOP853 with terminal events, no step cap, scalar mathematics."""

from __future__ import annotations

import time
from collections.abc import Sequence
from math import tanh
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from peers.common import (
    BETA1,
    BETA2,
    BL,
    BU,
    DBU,
    DTSU,
    JL,
    JU,
    KM,
    KTHETA,
    T1,
    T2,
    TSL,
    TSU,
    Peer,
)  # fmt: skip


def _field(su: int, sl: int, volts: float) -> Any:
    drive, viscous = KM * volts - su * TSU - DTSU, BU + su * DBU

    def rates(_: float, x: Any) -> tuple[float, float, float]:
        twist, wu, wl = x.tolist()
        al = 0.0
        if sl:
            torque = T1 * tanh(0.5 * BETA1 * wl) + T2 * tanh(0.5 * BETA2 * wl) + BL * wl
            al = (KTHETA * twist - sl * TSL - torque) / JL
        au = (drive - KTHETA * twist - viscous * wu) / JU if su else 0.0
        return wu - wl, au, al

    return rates


def _events(su: int, sl: int, volts: float) -> list[Any]:
    def upper(_: float, x: Any) -> float:
        return su * x[1] if su else TSU - abs(KM * volts - DTSU - KTHETA * x[0])

    def lower(_: float, x: Any) -> float:
        return sl * x[2] if sl else TSL - abs(KTHETA * x[0])

    for g in (upper, lower):
        g.terminal, g.direction = True, -1  # type: ignore[attr-defined]
    return [upper, lower]


def _rest(torque: float, hold: float) -> int:
    return 0 if abs(torque) <= hold else (1 if torque > 0.0 else -1)


def solve(volts: float, times: Sequence[float], rtol: float, atol: float) -> list[float]:
    """omega_l at the sample times, from rest."""
    t, end, x = 0.0, times[-1], np.zeros(3)
    grid, out = np.asarray(times), np.zeros(len(times))
    su, sl = _rest(KM * volts - DTSU, TSU), 0
    done = 0
    while t < end:
        run = solve_ivp(
            _field(su, sl, volts), (t, end), x, method="DOP853", t_eval=grid[done:],
            events=_events(su, sl, volts), rtol=rtol, atol=atol,
        )  # fmt: skip
        if len(run.t):
            out[done : done + len(run.t)] = run.y[2]
            done += len(run.t)
        if run.status == 0:
            break
        which = 0 if len(run.t_events[0]) else 1
        t, x = float(run.t_events[which][0]), run.y_events[which][0].copy()
        if which == 0:
            torque = KM * volts - DTSU - KTHETA * x[0]
            if su:
                x[1] = 0.0
            su = _rest(torque, TSU) if su else (1 if torque > 0.0 else -1)
        else:
            torque = KTHETA * x[0]
            if sl:
                x[2] = 0.0
            sl = _rest(torque, TSL) if sl else (1 if torque > 0.0 else -1)
    return out.tolist()


def peer() -> Peer:
    def measure(volts: float, times: Sequence[float]) -> tuple[float, list[float]]:
        start = time.perf_counter()
        out = solve(volts, times, 1e-9, 1e-11)
        return time.perf_counter() - start, out

    return Peer("SciPy DOP853 with events, rtol 1e-9", measure)
