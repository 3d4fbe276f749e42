"""diffrax: Dopri8 with root-found terminal events in float64, one compiled solve per mode run.

Run as a script it answers `peers.common.ask`, so that it may live in an environment of its
own. The clock starts after compilation.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
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
    ask,
    serve,
)  # fmt: skip

RTOL, ATOL = 1e-9, 1e-11


def _build(times: list[float]) -> Any:
    import diffrax  # pyright: ignore[reportMissingImports]
    import equinox as eqx  # pyright: ignore[reportMissingImports]
    import jax  # pyright: ignore[reportMissingImports]
    import jax.numpy as jnp  # pyright: ignore[reportMissingImports]
    import optimistix  # pyright: ignore[reportMissingImports]

    jax.config.update("jax_enable_x64", True)
    grid = jnp.asarray(times, dtype=jnp.float64)

    def rates(_: Any, x: Any, args: Any) -> Any:
        volts, su, sl = args
        law = T1 * jnp.tanh(0.5 * BETA1 * x[2]) + T2 * jnp.tanh(0.5 * BETA2 * x[2]) + BL * x[2]
        au = KM * volts - KTHETA * x[0] - su * TSU - DTSU - (BU + su * DBU) * x[1]
        al = KTHETA * x[0] - sl * TSL - law
        return jnp.stack([x[1] - x[2], jnp.abs(su) * au / JU, jnp.abs(sl) * al / JL])

    def upper(t: Any, y: Any, args: Any, **_: Any) -> Any:
        volts, su, _sl = args
        free = TSU - jnp.abs(KM * volts - DTSU - KTHETA * y[0])
        return jnp.where(su == 0.0, free, su * y[1])

    def lower(t: Any, y: Any, args: Any, **_: Any) -> Any:
        return jnp.where(args[2] == 0.0, TSL - jnp.abs(KTHETA * y[0]), args[2] * y[2])

    root = optimistix.Newton(1e-12, 1e-12)
    event = diffrax.Event([upper, lower], root, direction=False)
    save = diffrax.SaveAt(subs=[diffrax.SubSaveAt(ts=grid), diffrax.SubSaveAt(t1=True)])

    @jax.jit
    def segment(t0: Any, x: Any, args: Any) -> Any:
        ts = jnp.clip(grid, t0, grid[-1])
        saveat = eqx.tree_at(lambda s: s.subs[0].ts, save, ts)
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(rates), diffrax.Dopri8(), t0, grid[-1], 1e-3, x, args=args,
            stepsize_controller=diffrax.PIDController(rtol=RTOL, atol=ATOL), event=event,
            saveat=saveat, max_steps=100_000, throw=False,
        )  # fmt: skip
        sampled, ends = found.ys
        return found.ts[1][0], ends[0], sampled[:, 2], jnp.stack(found.event_mask)

    return segment


def _rest(torque: float, hold: float) -> float:
    return 0.0 if abs(torque) <= hold else (1.0 if torque > 0.0 else -1.0)


def _solve(segment: Any, volts: float, times: list[float]) -> Any:
    grid, out = np.asarray(times), np.zeros(len(times))
    t, x = 0.0, np.zeros(3)
    su, sl = _rest(KM * volts - DTSU, TSU), 0.0
    while t < grid[-1]:
        end, last, sampled, mask = map(
            np.asarray, segment(t, x, (np.float64(volts), np.float64(su), np.float64(sl)))
        )
        inside = (grid >= t) & (grid <= end)
        out[inside] = sampled[inside]
        t, x = float(end), last.copy()
        if mask[0]:
            torque = KM * volts - DTSU - KTHETA * x[0]
            x[1] = 0.0
            su = _rest(torque, TSU if su else 0.0)
        elif mask[1]:
            x[2] = 0.0
            sl = _rest(KTHETA * x[0], TSL if sl else 0.0)
        else:
            break
    return out


def run(volts: float, times: list[float]) -> tuple[float, list[float]]:
    """Wall seconds and omega_l at the samples."""
    segment = _build(times)
    _solve(segment, volts, times)
    start = time.perf_counter()
    out = _solve(segment, volts, times)
    return time.perf_counter() - start, out.tolist()


def peer(python: Sequence[str]) -> Peer:
    def measure(volts: float, times: Sequence[float]) -> tuple[float, list[float]]:
        return ask(python, "diffrax_events.py", volts, times)

    return Peer(f"diffrax Dopri8 with events, rtol {RTOL:g}", measure)


if __name__ == "__main__":
    serve(run)
