"""Compiled step and start of environments whose rig has effects."""

from typing import NamedTuple

import numpy as np

from drill_env._jit import entry, kernel
from drill_env._types import FloatArray, IntArray
from drill_env.effects.readings import errors_in
from drill_env.effects.signal import RESTING
from drill_env.environment._kernel import end_period, fill_reward, fill_torques, follow_schedule
from drill_env.environment._sensing import fill_observation, start_sensors
from drill_env.friction.kernels import upper_sliding
from drill_env.integrator.acting import lower_law
from drill_env.integrator.advance import DONE, LOG_FULL, advance
from drill_env.integrator.modes import rates_now, start_mode
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
    senses: bool  # whether an encoder is wrong
    looks_back: bool  # whether one reads late
    whole: int  # periods by which the voltage acts late, and the rest of that, s
    part: float
    volts: FloatArray  # of the last periods, in a ring, V; shape (environments, periods)
    breaks: FloatArray  # ends of a period's pieces
    pieces: FloatArray
    times: FloatArray  # of all that is sampled in a period, s
    per: int  # samples from one of the encoders to the next
    places: IntArray  # of each effect: intervals back, and which sample of these
    past: FloatArray  # angles in a ring, rad; shape (environments, intervals, per, 2)
    late: FloatArray
    out: FloatArray  # states at all that is sampled; those of `Buffers` where no encoder is wrong
    inner: FloatArray
    modes: IntArray


@kernel
def load_voltages(i, row, extension, setting, work):
    """Pieces of the present period; the past of the voltage changes within it once."""
    x, ring = extension, extension.volts[i]
    x.breaks[0], x.breaks[1], x.breaks[2] = 0.0, x.part, setting.period
    x.pieces[0, 0] = x.pieces[1, 0] = x.pieces[0, 1] = x.pieces[1, 1] = row.voltage
    work.late = 1
    if x.whole > 0 or x.part > 0.0:
        now = row.step % ring.size
        ring[now] = row.voltage
        x.pieces[0, 1] = ring[(now - x.whole - 1) % ring.size]
        x.pieces[1, 1] = ring[(now - x.whole) % ring.size]
    if x.part < 1e-9 or x.pieces[0, 1] == x.pieces[1, 1]:
        # Nothing jumps within the period: it is the second piece alone.
        x.breaks[1] = 0.0
        return 1
    return 0


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
    if status == DONE and x.senses:
        for j in range(setting.samples):
            if x.looks_back:
                look_back(i, row.step * setting.samples + j, j, extension)
            read_sample(j, row, extension, buffers.out)
    return status


@kernel
def look_back(i, now, j, extension):
    """Put the angles of sample `j` into the ring as number `now`; each effect's late ones."""
    x, ring = extension, extension.past[i]
    for a in range(x.per):
        state = x.out[j * x.per + a]
        ring[now % ring.shape[0], a, 0] = state[0] + state[3]
        ring[now % ring.shape[0], a, 1] = state[3]
    for k in range(x.entries.size):
        place = ring[(now - x.places[k, 0]) % ring.shape[0], x.places[k, 1]]
        x.late[k, 0], x.late[k, 1] = place[0], place[1]


@kernel
def read_sample(j, row, extension, out):
    """Encoder sample `j` of the period with its errors."""
    x, s = extension, extension.signal[0]
    last = (j + 1) * x.per - 1
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
    run, mode = row.run, row.run.mode
    if (mode[0] == 0 or mode[1] == 0) and not (work.has_rates and work.asked == 0):
        rates_now(row.p, run, work, tab, row.voltage)
    row.torque[0], row.torque[1] = work.net[0], work.net[1]
    if mode[0] != 0:
        row.torque[0] = upper_sliding(row.p, mode[0], run.y[1])
    if mode[1] != 0:
        row.torque[1] = mode[1] * lower_law(row.p, run, mode[1] * run.y[2])


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
