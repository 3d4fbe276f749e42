"""What a closed cycle does within its period."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from drill_env._types import FloatArray
from drill_env.continuation.flow import Character, LimitCycle, Shot
from drill_env.integrator.trajectory import Disc, Kind
from drill_env.parameters import Rig

_LOWER = int(Disc.LOWER)
_STICK, _REVERSAL, _MINIMUM = int(Kind.STICK), int(Kind.REVERSAL), int(Kind.MINIMUM)
_TOUCH = (_STICK, _REVERSAL)
_Mark: TypeAlias = tuple[float, int, list[float]]


def describe(shot: Shot, rig: Rig, z: FloatArray, steps: int) -> LimitCycle:
    """Everything about the closed cycle of z = (state, period, parameter)."""
    state, period = z[:-2], float(z[-2])
    values = np.asarray(np.linalg.eigvals(shot.jacobian[:, :-2]), dtype=np.complex128)
    own = int(np.abs(values - 1.0).argmin())
    rest = np.array(sorted(np.delete(values, own), key=lambda m: -abs(m)))
    lower = [
        (t, kind, place)
        for t, disc, kind, place in zip(
            shot.events.t.tolist(), shot.events.disc.tolist(), shot.events.kind.tolist(),
            shot.events.state.tolist(), strict=True,
        )
        if disc == _LOWER
    ]  # fmt: skip
    kinds = [kind for _, kind, _ in lower]
    margins = [rig.Tsl - abs(rig.ktheta * place[0]) for _, kind, place in lower if kind in _TOUCH]
    stuck, turned = _shares(lower, period)
    minima = [place[2] for _, kind, place in lower if kind == _MINIMUM]
    return LimitCycle(
        parameter=float(z[-1]),
        state=state.copy(),
        period=period,
        min=float(min([*minima, 0.0 if margins else state[2]])),
        max=float(state[2]),
        multipliers=rest,
        trivial=float(values[own].real),
        stable=bool((np.abs(rest) < 1.0).all()),
        character=_character(_STICK in kinds, turned > 0.0),
        sticking_s=stuck,
        reversed_s=turned,
        hits=tuple(margins),
        steps=steps,
        residual=float(np.abs(shot.end - state).max()),
    )


def _character(sticks: bool, reverses: bool) -> Character:
    if sticks and reverses:
        return "reversing and sticking"
    return "sticking" if sticks else "reversing" if reverses else "slipping"


def _shares(lower: list[_Mark], period: float) -> tuple[float, float]:
    """Seconds stuck and seconds reversed in one period that starts slipping forward."""
    stuck = turned = since = 0.0
    mode = 1
    marks = [mark for mark in lower if mark[1] <= _REVERSAL]
    for t, kind, place in [*marks, (period, _REVERSAL, [0.0])]:
        stuck += t - since if mode == 0 else 0.0
        turned += t - since if mode < 0 else 0.0
        since = t
        if kind == _STICK:
            mode = 0
        else:
            # The string pulls the disc away to the side of its twist.
            mode = -mode if kind == _REVERSAL else (1 if place[0] > 0.0 else -1)
    return stuck, turned
