"""Compiled step and start of environments whose rig has effects."""

from typing import NamedTuple

from drill_env._jit import entry, kernel
from drill_env._types import FloatArray
from drill_env.effects._bundle import Bundle, forget_all
from drill_env.environment._kernel import end_period, fill_reward, fill_torques, follow_schedule
from drill_env.environment._sensing import fill_observation, start_sensors
from drill_env.integrator._advance import DONE
from drill_env.integrator._extended import Scratch, read_errors, run_substep
from drill_env.integrator._modes import start_mode
from drill_env.integrator._records import N_STATE


class Extension(NamedTuple):
    """What environments with effects need beside the others."""

    bundle: Bundle
    memories: FloatArray  # one set of them for each environment
    scratch: Scratch
    substeps: int  # between encoder samples


@kernel
def run_period(row, extension, memories, setting, tab, times, out):
    """Carry one environment over a control period; samples with their errors go to `out`."""
    p, run, scratch = row.p, row.run, extension.scratch
    start, count, begin = row.step * setting.period, extension.substeps, 0.0
    run.steps = 0
    for j in range(times.size):
        first = times[j - 1] if j > 0 else 0.0
        width = (times[j] - first) / count
        for i in range(count):
            end = times[j] if i + 1 == count else first + (i + 1) * width
            # The signal's record serves all environments in turn.
            scratch.signal[0].first = 1 if row.step == 0 and j == 0 and i == 0 else 0
            run.logged = 0
            status = run_substep(
                p, run, tab, extension.bundle, memories, scratch, begin, end, start, row.voltage
            )
            if status != DONE:
                return status
            begin = end
        t = start + times[j]
        read_errors(
            p, run, extension.bundle, memories, scratch, t, times[j] - first, row.voltage
        )  # fmt: skip
        for k in range(N_STATE):
            out[j, k] = run.y[k]
        answer = scratch.response[0]
        out[j, 0] += answer.angle_u - answer.angle_l
        out[j, 3] += answer.angle_l
    return DONE


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
        if run_period(
            row, extension, extension.memories[i], setting, tab, buffers.times, buffers.out
        ) != DONE:  # fmt: skip
            return i
        end_period(i, rows, old, buffers.out, setting)
        fill_torques(row)
        # The balance of a disc gives its friction less what the effects add.
        row.torque[0] += row.p.load_u
        row.torque[1] += row.p.load_l
        fill_observation(row, False, setting, rows.observation[i])
    return -1


@entry
def start_extended(i, rows, setting, extension):
    """As `start_row`, with effects that remember nothing yet."""
    row, memories, scratch = rows.row[i], extension.memories[i], extension.scratch
    forget_all(memories)
    start_mode(row.p, row.run, row.voltage)
    scratch.signal[0].first = 1
    read_errors(row.p, row.run, extension.bundle, memories, scratch, 0.0, 0.0, row.voltage)
    answer = scratch.response[0]
    start_sensors(row, rows.ring[i], setting, answer.angle_u, answer.angle_l)
    fill_reward(row, row.voltage, setting)
    fill_torques(row)
    fill_observation(row, True, setting, rows.observation[i])
