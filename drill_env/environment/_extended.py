"""Compiled step and start of environments whose rig has effects."""

from typing import NamedTuple

import numpy as np

from drill_env._jit import entry, kernel
from drill_env._types import FloatArray, IntArray
from drill_env.effects.readings import errors_in
from drill_env.effects.signal import RESTING
from drill_env.environment._kernel import end_period, fill_reward, fill_torques, follow_schedule
from drill_env.environment._sensing import fill_observation, start_sensors
from drill_env.integrator.acting import rates_now
from drill_env.integrator.advance import DONE, LOG_FULL, advance
from drill_env.integrator.modes import start_mode
from drill_env.integrator.records import MOST_INNER, N_STATE
from drill_env.integrator.signatures import call_change

# Of `start_with_effects`: modes and inner states anew.
_ALL = 3


class Extension(NamedTuple):
    """What environments with effects need beside the others."""

    entries: np.ndarray  # records of `ENTRY`
    begin: int  # address of `start_with_effects`
    signal: np.ndarray
    ports: np.ndarray
    delay: float  # by which the voltage acts late, s
    volts: FloatArray  # of the last periods, in a ring, V; shape (environments, periods)
    breaks: FloatArray  # ends of a period's pieces
    pieces: FloatArray
    times: FloatArray  # of all that is sampled in a period, s
    per: int  # samples from one of the encoders to the next
    places: IntArray  # of each effect: intervals back, and which sample of these
    past: FloatArray  # angles in a ring, rad; shape (environments, intervals, per, 2)
    late: FloatArray
    out: FloatArray
    inner: FloatArray
    modes: IntArray


@kernel
def load_voltages(i, row, extension, setting, work):
    """Pieces of the present period; the past of the voltage changes within it once."""
    x, ring = extension, extension.volts[i]
    ring[row.step % ring.size] = row.voltage
    whole = int(x.delay / setting.period + 1e-9)
    part = max(x.delay - whole * setting.period, 0.0)
    x.breaks[0], x.breaks[1], x.breaks[2] = 0.0, part, setting.period
    x.pieces[0, 0] = x.pieces[1, 0] = row.voltage
    x.pieces[0, 1] = ring[(row.step - whole - 1) % ring.size]
    x.pieces[1, 1] = ring[(row.step - whole) % ring.size]
    work.late = 1
    return 1 if part < 1e-9 else 0


@kernel
def run_period(i, row, extension, setting, tab, buffers):
    """Carry one environment over a control period; samples with their errors go to `buffers`."""
    x, run, work = extension, row.run, buffers.work[0]
    skipped = load_voltages(i, row, extension, setting, work)
    run.t, run.origin = 0.0, row.step * setting.period
    run.piece, run.sample, run.steps = skipped, 0, 0
    status = LOG_FULL
    while status == LOG_FULL:
        run.logged = 0
        status = advance(
            row.p, run, work, tab, x.breaks, x.pieces, x.times, x.out, x.modes, buffers.log,
            buffers.sens,
        )  # fmt: skip
    if status == DONE:
        for j in range(setting.samples):
            read_sample(i, j, row, extension, setting, buffers.out)
    return status


@kernel
def read_sample(i, j, row, extension, setting, out):
    """Encoder sample `j` of the period with its errors."""
    x, s = extension, extension.signal[0]
    last, now = (j + 1) * x.per - 1, row.step * setting.samples + j
    ring = x.past[i]
    for a in range(x.per):
        state = x.out[j * x.per + a]
        ring[now % ring.shape[0], a, 0] = state[0] + state[3]
        ring[now % ring.shape[0], a, 1] = state[3]
    for k in range(x.entries.size):
        place = ring[(now - x.places[k, 0]) % ring.shape[0], x.places[k, 1]]
        x.late[k, 0], x.late[k, 1] = place[0], place[1]
    state = x.out[last]
    s.t, s.u = row.run.origin + x.times[last], row.voltage
    s.twist, s.omega_u, s.omega_l, s.theta_l = state[0], state[1], state[2], state[3]
    s.theta_u = state[0] + state[3]
    errors_in(row.p, x.entries, s, x.ports[0], x.inner[last], x.late)
    for k in range(N_STATE):
        out[j, k] = state[k]
    out[j, 0] += x.ports[0].angle_u - x.ports[0].angle_l
    out[j, 3] += x.ports[0].angle_l


@kernel
def fill_own_torques(row, work, tab):
    """Friction torques (Nm) of the rig's own laws, those that hold where a disc rests."""
    if work.acting == 0:
        fill_torques(row)
        return
    s, mode = work.signal, row.run.mode
    if work.restless or not work.has_rates or mode[0] != 0 or mode[1] != 0:
        rates_now(row.p, row.run, work, tab, row.voltage)
    row.torque[0] = work.net[0] if mode[0] == 0 else mode[0] * s.friction_u
    row.torque[1] = work.net[1] if mode[1] == 0 else mode[1] * s.friction_l


@entry
def step_extended(first, last, skip, volts, rows, setting, tab, buffers, extension):
    """As `step_rows`, with effects."""
    limit = setting.limit
    for i in range(first, last):
        if skip[i]:
            continue
        row = rows.row[i]
        old = row.voltage
        row.voltage = min(max(volts[i], -limit), limit)
        follow_schedule(row, rows.schedule_steps[i], rows.schedule_values[i])
        if run_period(i, row, extension, setting, tab, buffers) != DONE:
            return i
        end_period(i, rows, old, buffers.out, setting)
        fill_own_torques(row, buffers.work[0], tab)
        fill_observation(row, False, setting, rows.observation[i])
    return -1


@entry
def start_extended(i, rows, setting, tab, buffers, extension):
    """As `start_row`, with effects that remember nothing yet."""
    row, x, work = rows.row[i], extension, buffers.work[0]
    run, y, s = row.run, row.run.y, extension.signal[0]
    run.t = run.origin = 0.0
    run.push[0] = run.push[1] = 0
    for r in range(MOST_INNER):
        run.z[r] = 0.0
    before = 0.0 if abs(y[1]) < RESTING else row.voltage
    for k in range(x.volts.shape[1]):
        x.volts[i, k] = before
    work.start, work.end, work.coefficients, work.late = 0.0, 1.0, 1, 1
    work.piece[0], work.past[0] = row.voltage, before
    if work.acting == 0:
        # Effects of the sensors alone: nothing of theirs is in the equations of motion.
        start_mode(row.p, run, row.voltage)
    else:
        call_change(x.begin, row.p, run, work, tab, _ALL, row.voltage)
    ring = x.past[i]
    for k in range(ring.shape[0]):
        for a in range(x.per):
            ring[k, a, 0], ring[k, a, 1] = y[0] + y[3], y[3]
    for k in range(x.entries.size):
        x.late[k, 0], x.late[k, 1] = y[0] + y[3], y[3]
    s.t, s.u = 0.0, row.voltage
    s.twist, s.omega_u, s.omega_l, s.theta_l = y[0], y[1], y[2], y[3]
    s.theta_u = y[0] + y[3]
    errors_in(row.p, x.entries, s, x.ports[0], run.z, x.late)
    start_sensors(row, rows.ring[i], setting, x.ports[0].angle_u, x.ports[0].angle_l)
    fill_reward(row, row.voltage, setting)
    fill_own_torques(row, work, tab)
    fill_observation(row, True, setting, rows.observation[i])
