"""Whether a motion obeys the rig's laws: an energy balance by quadrature, and what holds a disc.

The powers are taken from the state alone, see `powers`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss

from benchmarks.fuzz.draws import Case
from benchmarks.fuzz.powers import look_along
from drill_env._types import FloatArray
from drill_env.effects import LIBRARY
from drill_env.effects.declared import Declared, declared
from drill_env.effects.signal import PORTS, RESTING, SIGNAL
from drill_env.friction import kernel_record
from drill_env.integrator import Disc, Kind, Trajectory, Voltage, simulate

_NODES, _WEIGHTS = leggauss(6)
OPEN, OPEN_MEMORY = 1e-6, 1e-4
"""Largest open share of the balance of energy, and of a memory's, see `judge`."""
# All panels may err the same way: one is halved, so often at most, where its balance is open by
# more than this share of what all together may be.
_SHARE, _ROUNDS, _NARROWEST, _MOST = 0.1, 26, 1e-11, 200_000
# Where it is a tie which way a disc leaves, the integrator lets so much time decide.
_TIE = 1e-6


@dataclass(frozen=True)
class Verdict:
    """How far a motion is from the laws, as shares of what there is."""

    energy: float
    memory: float
    held: float
    panels: int


def _drive(voltage: Voltage, delay: float, before: float, t: FloatArray) -> FloatArray:
    """Voltage, its slope and the voltage a delay ago."""
    cell = np.clip(np.searchsorted(voltage.breaks, t, side="right") - 1, 0, len(voltage.pieces) - 1)
    length = np.diff(voltage.breaks)[cell]
    share = (t - voltage.breaks[cell]) / length
    slope = np.zeros_like(t)
    for i in range(voltage.pieces.shape[1] - 1, 0, -1):
        slope = slope * share + i * voltage.pieces[cell, i]
    past = np.where(t < delay, before, voltage(np.maximum(t - delay, 0.0)))
    return np.column_stack([voltage(t), slope / length, past])


def _dwells(run: Trajectory, t: FloatArray) -> FloatArray:
    """Time since the lower disc last came to rest."""
    stops = np.concatenate([[0.0], run.events.where(Disc.LOWER, Kind.STICK).t])
    return t - stops[np.searchsorted(stops, t, side="right") - 1]


def _look(
    case: Case, effects: Declared, t: FloatArray
) -> tuple[Trajectory, FloatArray, FloatArray]:
    rig = case.rig
    run = simulate(rig, case.voltage, case.voltage.breaks[-1], initial=case.start, t_eval=t)
    before = 0.0 if abs(case.start[1]) < RESTING else float(case.voltage(0.0))
    found, rates = np.zeros((len(t), 4)), np.zeros((len(t), effects.inner))
    look_along(
        kernel_record(rig)[0], effects.entries, np.zeros(1, dtype=SIGNAL)[0],
        np.zeros(1, dtype=PORTS)[0], t, _drive(case.voltage, effects.delay, before, t), run.state,
        run.modes, run.inner, _dwells(run, t), LIBRARY["slew_limit"].kernel.address,
        np.zeros((2, 2)), found,
        rates,
    )  # fmt: skip
    return run, found, rates


def _energy(case: Case, run: Trajectory, inertia: float) -> FloatArray:
    rig, (x, v, w, _) = case.rig, run.state.T
    return 0.5 * ((rig.Ju + inertia) * v**2 + rig.Jl * w**2 + rig.ktheta * x**2)


def _edges(case: Case, effects: Declared) -> FloatArray:
    """Where something may jump, and a hundred places besides."""
    voltage = case.voltage
    end = float(voltage.breaks[-1])
    events = simulate(case.rig, voltage, end, initial=case.start, rate=1.0).events.t
    late = voltage.breaks + effects.delay
    cuts = [np.linspace(0.0, end, 101), events, voltage.breaks, late[late < end]]
    return np.unique(np.concatenate(cuts))


class _Panels(NamedTuple):
    """What the balances of some panels lack, n panels and d of them: the energy and d - 1 memories.

    Attributes:
        lacks: change less integral, shape (n, d).
        scale: of each balance by these panels, shape (d,).
        held: largest excess over stiction in a panel, shape (n,).
    """

    lacks: FloatArray
    scale: FloatArray
    held: FloatArray


def _balances(case: Case, effects: Declared, left: FloatArray, right: FloatArray) -> _Panels:
    width = right - left
    nodes = (left[:, None] + 0.5 * width[:, None] * (1.0 + _NODES)).ravel()
    t, place = np.unique(np.concatenate([left, right, nodes]), return_inverse=True)
    run, found, rates = _look(case, effects, t)
    a, b, inside = np.split(place, [len(left), 2 * len(left)])
    weights = (0.5 * width[:, None] * _WEIGHTS)[:, :, None]
    flow = np.column_stack([found[:, :1], rates])[inside].reshape(len(left), len(_NODES), -1)
    energy = _energy(case, run, float(found[0, 3]))
    kept = np.column_stack([energy, run.inner])
    spent = float(weights.ravel() @ found[inside, 1])
    largest = np.abs(run.inner).max(axis=0, initial=0.0)
    scale = np.append(1e-7 + spent + energy.max(), 1e-3 + largest)
    excess = found[inside, 2].reshape(len(left), -1).max(axis=1)
    return _Panels(kept[b] - kept[a] - (weights * flow).sum(axis=1), scale, excess)


def judge(case: Case) -> Verdict:
    """Open shares of the energy balance and of the memories' balances, and excess over stiction.

    Between two edges the change of the energy must be the integral of the power, and that of an
    inner state the integral of its rate; where it is not, the panel is halved.
    """
    effects = declared(case.rig)
    edges = _edges(case, effects)
    left, right = edges[:-1], edges[1:]
    may = np.append(OPEN, np.full(effects.inner, OPEN_MEMORY)) * _SHARE / len(left)
    scale, panels, held, closed = np.zeros(0), 0, 0.0, []
    for turn in range(_ROUNDS):
        found = _balances(case, effects, left, right)
        scale = found.scale if turn == 0 else scale
        panels += len(left)
        bad = (np.abs(found.lacks) > may * scale).any(axis=1) & (right - left > _NARROWEST)
        if turn == _ROUNDS - 1 or panels > len(edges) + _MOST:
            bad[:] = False
        closed.append(np.column_stack([left, found.lacks])[~bad])
        good = ~bad & (right - left >= _TIE)
        held = max(held, float(found.held[good].max(initial=0.0)))
        if not bad.any():
            break
        middle = 0.5 * (left + right)[bad]
        left, right = np.concatenate([left[bad], middle]), np.concatenate([middle, right[bad]])
    # Summed up to every time, so that what one event gains another cannot hide.
    whole = np.concatenate(closed)
    lacks = np.abs(np.cumsum(whole[np.argsort(whole[:, 0]), 1:], axis=0)).max(axis=0) / scale
    return Verdict(float(lacks[0]), float(lacks[1:].max(initial=0.0)), held, panels)
