"""heyoka: adaptive Taylor integration with terminal events, modes as runtime parameters."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

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
    NotInstalledError,
    Peer,
)  # fmt: skip

# Runtime parameters: upper sign, upper slips, lower sign, lower slips, voltage.
SU, AU, SL, AL, VOLTS = range(5)


def _rest(torque: float, hold: float) -> float:
    return 0.0 if abs(torque) <= hold else float(np.sign(torque))


def build(tolerance: float) -> Any:
    """The compiled integrator."""
    import heyoka as hy

    x, wu, wl = hy.make_vars("x", "wu", "wl")
    su, au, sl, al, volts = (hy.par[i] for i in range(5))
    law = T1 * hy.tanh(0.5 * BETA1 * wl) + T2 * hy.tanh(0.5 * BETA2 * wl) + BL * wl
    system = [
        (x, wu - wl),
        (wu, au * (KM * volts - KTHETA * x - su * TSU - DTSU - (BU + su * DBU) * wu) / JU),
        (wl, al * (KTHETA * x - sl * TSL - law) / JL),
    ]
    free = KM * volts - DTSU - KTHETA * x

    def upper(ta: Any, _: int) -> bool:
        torque = KM * ta.pars[VOLTS] - DTSU - KTHETA * ta.state[0]
        ta.state[1] = 0.0
        sign = _rest(torque, TSU) if ta.pars[AU] else float(np.sign(torque))
        ta.pars[SU], ta.pars[AU] = sign, abs(sign)
        return True

    def lower(ta: Any, _: int) -> bool:
        torque = KTHETA * ta.state[0]
        ta.state[2] = 0.0
        sign = _rest(torque, TSL) if ta.pars[AL] else float(np.sign(torque))
        ta.pars[SL], ta.pars[AL] = sign, abs(sign)
        return True

    events = [
        hy.t_event(au * wu + (1.0 - au) * (TSU * TSU - free * free), callback=upper),
        hy.t_event(al * wl + (1.0 - al) * (TSL * TSL - KTHETA * KTHETA * x * x), callback=lower),
    ]
    return hy.taylor_adaptive(system, [0.0, 0.0, 0.0], tol=tolerance, pars=[0.0] * 5,
                              t_events=events)  # fmt: skip


def peer(tolerance: float = 1e-9) -> Peer:
    try:
        ta = build(tolerance)
    except ImportError as error:
        raise NotInstalledError(str(error)) from error

    def measure(volts: float, times: Sequence[float]) -> tuple[float, list[float]]:
        grid = np.asarray(times, dtype=float)
        ta.time = 0.0
        ta.state[:] = 0.0
        ta.reset_cooldowns()
        sign = _rest(KM * volts - DTSU, TSU)
        ta.pars[:] = [sign, abs(sign), 0.0, 0.0, volts]
        start = time.perf_counter()
        out = ta.propagate_grid(grid)
        wall = time.perf_counter() - start
        return wall, out[-1][:, 2].tolist()

    return Peer(f"heyoka Taylor with events, tol {tolerance:g}", measure)
