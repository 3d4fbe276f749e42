"""Whether a motion obeys the rig's laws: an energy balance by quadrature, and what holds a disc.

The powers are taken from the state alone: every switch of an effect is put where its function says,
whatever the integrator held it at, and no acceleration is asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.polynomial.legendre import leggauss

from benchmarks.fuzz.draws import Case
from drill_env._types import FloatArray
from drill_env.effects import LIBRARY
from drill_env.effects.declared import Declared, declared
from drill_env.effects.signal import PORTS, RESTING, SIGNAL, respond
from drill_env.friction import kernel_record
from drill_env.friction.kernels import lower_sliding
from drill_env.integrator import Disc, Kind, Trajectory, Voltage, simulate

_NODES, _WEIGHTS = leggauss(6)
# A panel whose balance is open by more than this share of the whole is halved, so often at most:
# for the energy, and for memories, whose samples between quick steps err by up to 1e-6.
_PANEL, _PANEL_MEMORY, _ROUNDS = 1e-9, 1e-6, 26
# A motor this slow rests, and a voltage this near (V) has arrived.
_SLOW, _NEAR = 1e-9, 1e-7
# Where it is a tie which way a disc leaves, the integrator lets so much time decide.
_TIE = 1e-6


@njit(cache=True)
def _law(p, speed):
    torque = lower_sliding(p, speed)
    return max(torque, 0.0) if p.clamp else torque


@njit(cache=True)
def _ask(p, entries, s, out, inner, late, slew, fresh):
    """Ports of all effects at the signal, every switch put anew or left where it is."""
    out.volts = out.torque_u = out.torque_l = out.string = out.size_u = out.size_l = 0.0
    out.scale_u = out.scale_l = out.inertia_u = out.angle_u = out.angle_l = 0.0
    out.drive, out.read_l, s.choose, s.first = 1.0, s.speed_l, int(fresh), 0
    for i in range(entries.size):
        e = entries[i]
        for j in range(e.states):
            e.z[j] = inner[e.first_state + j]
        if fresh:
            _reset(e, s, slew)
        e.u_late = late
        respond(e.code, p, e, s, out)


@njit(cache=True)
def _reset(e, s, slew):
    for j in range(e.switches):
        e.side[j] = 0
    if e.drives:
        e.side[0] = 0 if abs(e.z[1]) < _SLOW else (1 if e.z[1] > 0.0 else -1)
    if e.code == slew:
        # It would take the last stretch for arrived.
        gap = s.u - e.z[0]
        e.side[0] = 0 if abs(gap) < _NEAR else (1 if gap > 0.0 else -1)


@njit(cache=True)
def _stand(p, s, state, modes, push_u, push_l):
    """Signal of a state whose discs at rest are asked in a direction."""
    s.twist, s.omega_u, s.omega_l, s.theta_l = state[0], state[1], state[2], state[3]
    s.theta_u, s.pull = state[3] + state[0], p.ktheta * state[0]
    s.rest_u, s.rest_l = modes[0] == 0, modes[1] == 0
    s.side_u = push_u if s.rest_u else float(modes[0])
    s.side_l = push_l if s.rest_l else float(modes[1])
    s.speed_u = 0.0 if s.rest_u else s.side_u * s.omega_u
    s.speed_l = 0.0 if s.rest_l else s.side_l * s.omega_l
    s.friction_u = p.Tsu + s.side_u * p.dTsu + (p.bu + s.side_u * p.dbu) * s.speed_u
    s.friction_l = _law(p, s.speed_l)


@njit(cache=True)
def _sizes(p, s, out):
    """Torque of the motor on the disc, and sizes of both frictions."""
    motor = out.drive * p.km * (s.u + out.volts) + out.torque_u
    size_u = s.friction_u * (1.0 + out.scale_u) + out.size_u
    return motor, size_u, _law(p, out.read_l) * (1.0 + out.scale_l) + out.size_l


@njit(cache=True)
def _excess(held, scale):
    """By how much a disc at rest is driven away; to both sides, it may rest where nothing pulls."""
    driven = -min(held[0], held[1]) / scale
    return 0.0 if max(held[0], held[1]) < 0.0 else driven


@njit(cache=True)
def _ahead(held):
    """Share with which a disc at rest leans ahead, 0 or 1 where it leaves."""
    if min(held[0], held[1]) < 0.0 or held[0] + held[1] == 0.0:
        return 1.0 if held[1] <= held[0] else 0.0
    return held[0] / (held[0] + held[1])


@njit(cache=True)
def look_along(p, entries, s, out, t, u, states, modes, inner, dwell, slew, held, found, rates):
    """Rows of `found`: power, its parts' sizes, excess over stiction and added inertia."""
    for k in range(t.size):
        s.t, s.u, s.u_rate, s.dwell_l = t[k], u[k, 0], u[k, 1], dwell[k]
        for side in range(2):
            push = 2.0 * side - 1.0
            _stand(p, s, states[k], modes[k], push, push)
            _ask(p, entries, s, out, inner[k], u[k, 2], slew, True)
            motor, size_u, size_l = _sizes(p, s, out)
            held[0, side] = size_u - s.side_u * (motor - s.pull - out.string)
            held[1, side] = size_l - s.side_l * (s.pull + out.string + out.torque_l)
        push_u = -1.0 if held[0, 0] < held[0, 1] else 1.0
        push_l = -1.0 if held[1, 0] < held[1, 1] else 1.0
        _stand(p, s, states[k], modes[k], push_u, push_l)
        _ask(p, entries, s, out, inner[k], u[k, 2], slew, True)
        motor, size_u, size_l = _sizes(p, s, out)
        lost_u, lost_l = s.speed_u * size_u, s.speed_l * size_l
        v, w = s.omega_u, s.omega_l
        given = motor * v + out.torque_l * w - out.string * (v - w)
        found[k, 0] = given - lost_u - lost_l
        found[k, 1] = abs(motor * v) + abs(out.torque_l * w) + abs(out.string * (v - w))
        found[k, 1] += abs(lost_u) + abs(lost_l)
        found[k, 2] = 0.0
        if s.rest_u:
            found[k, 2] = _excess(held[0], 1.0 + abs(motor) + abs(s.pull))
        if s.rest_l:
            found[k, 2] = max(found[k, 2], _excess(held[1], 1.0 + abs(s.pull)))
        found[k, 3] = out.inertia_u
        _keep_rates(p, entries, s, out, states[k], modes[k], inner[k], u[k, 2], held, rates[k])


@njit(cache=True)
def _keep_rates(p, entries, s, out, state, modes, inner, late, held, rates):
    """Rates of the inner states: between those of both sides where their disc rests."""
    for side in range(2):
        push = 2.0 * side - 1.0
        _stand(p, s, state, modes, push, push)
        _ask(p, entries, s, out, inner, late, 0, False)
        for i in range(entries.size):
            e = entries[i]
            share = _ahead(held[0 if e.upper else 1]) if side == 1 else 1.0
            for j in range(e.states):
                rates[e.first_state + j] += share * (e.rate[j] - rates[e.first_state + j])
            if side == 1 and e.drives and abs(inner[e.first_state + 1]) < _SLOW:
                # One side alone may push it off; what both together turn back friction holds.
                if e.side[0] * rates[e.first_state + 1] < 0.0:
                    rates[e.first_state + 1] = 0.0


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


def judge(case: Case) -> Verdict:
    """Open shares of the energy balance and of the memories' balances, and excess over stiction.

    Between two edges the change of the energy must be the integral of the power, and that of an
    inner state the integral of its rate; where it is not, the panel is halved.
    """
    effects, voltage = declared(case.rig), case.voltage
    end = float(voltage.breaks[-1])
    events = simulate(case.rig, voltage, end, initial=case.start, rate=1.0).events.t
    late = voltage.breaks + effects.delay
    cuts = [np.linspace(0.0, end, 101), events, voltage.breaks, late[late < end]]
    edges = np.unique(np.concatenate(cuts))
    left, right = edges[:-1], edges[1:]
    scale, memory_scale, panels = 1e-7, np.full(effects.inner, 1e-3), 0
    held, closed = 0.0, []
    for turn in range(_ROUNDS):
        width = right - left
        nodes = (left[:, None] + 0.5 * width[:, None] * (1.0 + _NODES)).ravel()
        t, place = np.unique(np.concatenate([left, right, nodes]), return_inverse=True)
        run, found, rates = _look(case, effects, t)
        a, b, inside = np.split(place, [len(left), 2 * len(left)])
        weights = 0.5 * width[:, None] * _WEIGHTS
        energy = _energy(case, run, float(found[0, 3]))
        powers = (weights * found[inside, 0].reshape(weights.shape)).sum(axis=1)
        lack = energy[b] - energy[a] - powers
        flow = rates[inside].reshape(*weights.shape, effects.inner)
        flow = (weights[:, :, None] * flow).sum(axis=1)
        kept = run.inner[b] - run.inner[a] - flow
        if turn == 0:
            spent = (weights * found[inside, 1].reshape(weights.shape)).sum()
            scale += float(spent + energy.max())
            memory_scale += np.abs(run.inner).max(axis=0, initial=0.0)
        panels += len(left)
        bad = np.abs(lack) > _PANEL * scale
        bad |= (np.abs(kept) > _PANEL_MEMORY * memory_scale).any(axis=1)
        bad &= width > 1e-11
        if turn == _ROUNDS - 1 or panels > 200_000:
            bad[:] = False
        closed.append(np.column_stack([left, lack, kept])[~bad])
        good = ~(bad | (width < _TIE))[np.repeat(np.arange(len(left)), len(_NODES))]
        held = max(held, float(found[inside, 2][good].max(initial=0.0)))
        if not bad.any():
            break
        middle = 0.5 * (left + right)[bad]
        left, right = np.concatenate([left[bad], middle]), np.concatenate([middle, right[bad]])
    # Summed up to every time, so that what one event gains another cannot hide.
    whole = np.concatenate(closed)
    lacks = np.abs(np.cumsum(whole[np.argsort(whole[:, 0]), 1:], axis=0)).max(axis=0)
    share = float((lacks[1:] / memory_scale).max(initial=0.0))
    return Verdict(float(lacks[0]) / scale, share, held, panels)
