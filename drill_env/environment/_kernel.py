"""Compiled step and start of any number of environments."""

from drill_env._jit import entry, inlined
from drill_env.dynamics.kernels import lower_rate, upper_rate
from drill_env.environment._records import (
    EFFORT,
    ERROR,
    STICK,
    STICK_SPEED,
    TRACK,
    TWIST_RATE,
    WIDTH,
)
from drill_env.environment._sensing import fill_observation, read_samples, start_sensors
from drill_env.integrator.advance import DONE, LOG_FULL, advance
from drill_env.integrator.modes import MAXIMUM, start_mode
from drill_env.integrator.records import N_STATE


@inlined
def follow_schedule(row, steps, values):
    """Set point and friction step that take effect at the present step."""
    for k in range(steps.size):
        if steps[k] == row.step:
            row.setpoint = values[k]
    if row.step == row.friction_step:
        p = row.p
        p.Tsl *= row.friction_factor
        p.T1 *= row.friction_factor
        p.T2 *= row.friction_factor
        p.bl *= row.friction_factor


@inlined
def fill_reward(row, old_voltage, setting):
    """Reward and its parts, from the true state."""
    omega_u, omega_l, target = row.run.y[1], row.run.y[2], row.setpoint
    w, parts = setting.weights, row.parts
    error = abs(omega_l - target) / target
    parts[TRACK] = w[TRACK] / (1.0 + (error / w[WIDTH]) ** 2)
    parts[ERROR] = -w[ERROR] * min(error, 2.0)
    parts[TWIST_RATE] = -w[TWIST_RATE] * min(abs(omega_u - omega_l) / target, 2.0)
    parts[STICK] = -w[STICK] if abs(omega_l) < w[STICK_SPEED] else 0.0
    parts[EFFORT] = -w[EFFORT] * ((row.voltage - old_voltage) / setting.limit) ** 2
    row.reward = parts[0] + parts[1] + parts[2] + parts[3] + parts[4]


@inlined
def fill_torques(row):
    """True friction torques (Nm), from the balance of each disc."""
    p, y, mode = row.p, row.run.y, row.run.mode
    rate_u = upper_rate(p, mode[0], y[0], y[1], row.voltage)
    rate_l = lower_rate(p, mode[1], mode[2], y[0], y[2])
    set_torques(row, rate_u, rate_l)


@inlined
def set_torques(row, rate_u, rate_l):
    """Friction torques (Nm) that go with two accelerations (rad/s^2)."""
    p, twist = row.p, row.run.y[0]
    row.torque[0] = p.km * row.voltage - p.ktheta * twist - p.Ju * rate_u
    row.torque[1] = p.ktheta * twist - p.Jl * rate_l


@inlined
def run_constant(p, run, volts, seconds, times, tab, buffers):
    """Carry a run on under a constant voltage (V); returns the status of `advance`.

    States at `times` (s after the start) are left in `buffers.out`.
    """
    buffers.breaks[1] = seconds
    buffers.piece[0, 0] = volts
    run.t = 0.0
    run.piece = run.sample = run.steps = 0
    status = LOG_FULL
    while status == LOG_FULL:
        run.logged = 0
        status = advance(
            p, run, buffers.work[0], tab, buffers.breaks, buffers.piece, times, buffers.out,
            buffers.modes, buffers.log, buffers.sens,
        )  # fmt: skip
    return status


@inlined
def end_period(i, rows, old_voltage, out, setting):
    """Read the encoders of environment `i` and judge its new state."""
    row = rows.row[i]
    read_samples(row, rows.ring[i], rows.noise[i], out, setting)
    row.step += 1
    row.noise_row += 1
    fill_reward(row, old_voltage, setting)


@entry
def step_rows(first, last, skip, volts, rows, setting, tab, buffers):
    """One control period for the environments first..last-1 that are not skipped.

    Returns:
        The first environment whose integration failed, or -1.
    """
    limit = setting.limit
    for i in range(first, last):
        if skip[i]:
            continue
        row = rows.row[i]
        old = row.voltage
        row.voltage = min(max(volts[i], -limit), limit)
        follow_schedule(row, rows.schedule_steps[i], rows.schedule_values[i])
        if run_constant(
            row.p, row.run, row.voltage, setting.period, buffers.times, tab, buffers
        ) != DONE:  # fmt: skip
            return i
        end_period(i, rows, old, buffers.out, setting)
        work = buffers.work[0]
        if work.has_rates:
            # The last stage of the last step holds them.
            set_torques(row, work.k[0, 1], work.k[0, 2])
        else:
            fill_torques(row)
        fill_observation(row, False, setting, rows.observation[i])
    return -1


@entry
def start_row(i, rows, setting):
    """Modes, sensors, truth and observation of environment `i` in its initial state."""
    row = rows.row[i]
    start_mode(row.p, row.run, row.voltage)
    start_sensors(row, rows.ring[i], setting, 0.0, 0.0)
    fill_reward(row, row.voltage, setting)
    fill_torques(row)
    fill_observation(row, True, setting, rows.observation[i])


@entry
def settle_on_cycle(p, run, volts, phase, settle, watch, tab, buffers):
    """Put `run` on the open-loop limit cycle, `phase` of a period after a maximum of omega_l.

    Where the rig does not vibrate, it ends at its equilibrium. Returns whether the
    integration succeeded.
    """
    none, log, work = buffers.times[:0], buffers.log, buffers.work[0]
    for i in range(N_STATE):
        run.y[i] = 0.0
    start_mode(p, run, volts)
    status = run_constant(p, run, volts, settle, none, tab, buffers)
    work.extrema = 1
    if status == DONE:
        status = run_constant(p, run, volts, watch, none, tab, buffers)
    work.extrema = 0
    last = before = -1
    for i in range(run.logged):
        if log[i].kind == MAXIMUM:
            before, last = last, i
    if before >= 0 and status == DONE:
        period = log[last].t - log[before].t
        for i in range(N_STATE):
            run.y[i] = log[last].y[i]
        start_mode(p, run, volts)
        if phase > 0.0:
            status = run_constant(p, run, volts, phase * period, none, tab, buffers)
    run.y[3] = 0.0
    return status == DONE
