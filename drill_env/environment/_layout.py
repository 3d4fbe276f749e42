"""The arrays with which environments carry their rig's effects."""

from __future__ import annotations

import math

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.effects.declared import Declared
from drill_env.effects.signal import PORTS, SIGNAL
from drill_env.environment._extended import Extension
from drill_env.environment._records import Buffers
from drill_env.environment.config import EnvConfig
from drill_env.integrator.modes import start_with_effects
from drill_env.integrator.prepared import equip
from drill_env.integrator.records import N_STATE

_SAME = 1e-9


def lay_out(config: EnvConfig, n: int, effects: Declared, buffers: Buffers) -> Extension:
    """What `n` environments need beside the others.

    Args:
        config: options.
        n: number of environments.
        effects: of the rig.
        buffers: working arrays, which are told of the effects.
    """
    interval = config.control_period / config.samples
    times, per, places = _sampled(effects.encoder_delays, interval, buffers.times)
    back = int(places[:, 0].max(initial=0))
    whole = math.floor(effects.delay / config.control_period + _SAME)
    wrong = effects.entries["senses"] == 1
    senses, looks_back = bool(wrong.any()), bool(effects.entries["delayed"][wrong].any())
    equip(buffers.work, effects)
    inner = np.zeros((len(times), effects.inner if effects.acts and senses else 0))
    buffers.work["inner_out"] = inner.ctypes.data if inner.size else 0
    return Extension(
        entries=effects.entries,
        begin=start_with_effects.address,
        signal=np.zeros(1, dtype=SIGNAL),
        ports=np.zeros(1, dtype=PORTS),
        senses=senses,
        looks_back=looks_back,
        whole=whole,
        part=max(effects.delay - whole * config.control_period, 0.0),
        volts=np.zeros((n, whole + 2)),
        breaks=np.zeros(3),
        pieces=np.zeros((2, 2)),
        times=times,
        per=per,
        places=places,
        past=np.zeros((n, back + 2, per, 2)),
        late=np.zeros((len(effects.entries), 2)),
        out=np.zeros((len(times), N_STATE)) if senses else buffers.out,
        inner=inner,
        modes=np.zeros((len(times), 2), dtype=np.int64),
    )


def _sampled(
    delays: FloatArray, interval: float, samples: FloatArray
) -> tuple[FloatArray, int, IntArray]:
    """Times that delays ask for within a period, how many a sample, and each delay's place."""
    whole = np.floor(delays / interval + _SAME)
    offsets = interval - np.maximum(delays - whole * interval, 0.0)
    inner = np.unique(offsets[offsets < interval - _SAME])
    per = len(inner) + 1
    before = samples - interval
    times = np.column_stack([before[:, None] + inner, samples]).ravel()
    which = np.where(offsets < interval - _SAME, np.searchsorted(inner, offsets), per - 1)
    return times, per, np.column_stack([whole, which]).astype(np.int64)
