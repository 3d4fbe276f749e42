"""Compiled Kalman filter through the set-valued rig with a latent torque on each disc.

State: twist, omega_u, omega_l, theta_l, and the torques d_u and d_l (Nm, Ornstein-Uhlenbeck).
Each sample interval is one exact integration between events whose sensitivities are the
transition; a stuck disc's velocity has no variance, so nothing but the inclusion itself releases
it. `S` is the derivative of the filtered state by the parameters and by the start: the encoders'
difference, both velocities and theta_l there, and the twist at which the encoders agree. The
start is estimated and not filtered: a release is too sharp for its first wide variance.

Readings are theta_u and theta_l, then, where a velocity is recorded, omega_u and omega_l.
"""

from drill_env._jit import entry, kernel
from drill_env.identification._filter_effects import forget_acting, look_ahead
from drill_env.identification._filter_predict import load_state, predict
from drill_env.identification._filter_state import D_L, D_U, N_FILTER, N_SLOPES, START_OFFSET
from drill_env.identification._filter_update import (
    note_gain,
    note_transition,
    take_volume,
    update,
)
from drill_env.integrator.advance import DONE
from drill_env.integrator.modes import start_mode
from drill_env.integrator.records import N_STATE
from drill_env.parameters.record import N_PARAMETERS


@kernel
def restart(f, p, run, start, u):
    """Put the filter at a start."""
    for i in range(N_FILTER):
        for j in range(N_FILTER):
            f.P[i, j] = 0.0
        for c in range(N_SLOPES):
            f.S[i, c] = 0.0
        f.y[i] = 0.0
    f.P[D_U, D_U], f.P[D_L, D_L] = f.variance[0], f.variance[1]
    f.offset = start[START_OFFSET]
    for i in range(N_STATE):
        f.y[i] = start[i]
        f.S[i, N_PARAMETERS + i] = 1.0
    f.y[0] += f.offset
    f.S[0, N_PARAMETERS + START_OFFSET] = 1.0
    load_state(f, p, run)
    start_mode(p, run, u)
    settle(f, run)


@kernel
def settle(f, run):
    """A stuck disc has no velocity and no doubt about it."""
    for disc in range(2):
        if run.mode[disc] == 0:
            row = 1 + disc
            f.y[row] = run.y[row] = 0.0
            for j in range(N_FILTER):
                f.P[row, j] = f.P[j, row] = 0.0
            for c in range(N_SLOPES):
                f.S[row, c] = 0.0


@kernel
def stop_reversed(f, run):
    """A velocity that a measurement pushed through zero stops there."""
    for disc in range(2):
        row = 1 + disc
        if run.mode[disc] != 0 and run.mode[disc] * f.y[row] < 0.0:
            f.y[row] = 0.0


@kernel
def follow_modes(f, p, run, u):
    """Modes after a measurement moved the state and effects changed the torques."""
    load_state(f, p, run)
    start_mode(p, run, u)
    settle(f, run)


@kernel
def release(f, run, reading, gap, variance, dt):
    """Let a disc turn that a wrong rig holds although its sensor says that it moves."""
    disc = reading % 2
    if run.mode[disc] != 0 or gap * gap < f.release * f.release * variance:
        return
    row = 1 + disc
    if reading < 2:
        f.y[row] = gap / dt
        f.P[row, row] = (gap * gap + variance) / (dt * dt)
    else:
        f.y[row], f.P[row, row] = gap, gap * gap + variance
    run.mode[disc] = 1 if gap > 0.0 else -1


@entry
def run_filter(
    f, p, run, work, tab, t, u, loads, effects, angles, noise, restarts, starts, buffers,
    gradients, informations, trace, path, slopes,
):  # fmt: skip
    """Filter one recording; the likelihood goes to `f`.

    Args:
        f: record of `FILTER`.
        p: record of `PARAMETERS`.
        run: record of the integrator.
        work: record of the integrator.
        tab: record of the integrator.
        t: times in s, shape (n,).
        u: held voltages in V (torques in Nm with km = 1), shape (n,).
        loads: known torques on the discs, held as the voltage is, Nm, shape (n, 2).
        effects: whose torques follow the filtered state.
        angles: theta_u and theta_l (rad), then omega_u and omega_l (rad/s) where the shape is
            (n, 4) and not (n, 2), NaN where missing.
        noise: variances of the samples, rad^2 or rad^2/s^2, likewise.
        restarts: rows at which the filter starts anew, ascending, the first 0; shape (m,).
        starts: theta_u - theta_l, omega_u, omega_l, theta_l and twist offset there, shape (m, 5).
        buffers: working arrays.
        gradients: filled with the descent of `f.value` / 2 from each restart to the next with
            the gains held, shape (m, 19).
        informations: filled with its expected curvature, lower triangle, shape (m, 19, 19).
        trace: filled per row and reading with the innovation and its variance, then the
            filtered state, shape (n, 2 readings + 6), or no rows.
        path: filled with what the filter did to errors, records of `path_type`, or no rows.
        slopes: filled with the slopes of the predicted readings by the parameters and the start,
            over the standard deviations, shape (n, readings, 19), or no rows.

    Returns:
        `DONE` or a failure of the integrator.
    """
    window, readings = -1, angles.shape[1]
    f.volume = 1.0
    for k in range(t.size):
        if window + 1 < restarts.size and restarts[window + 1] == k:
            window += 1
            f.load[0], f.load[1] = loads[k, 0], loads[k, 1]
            forget_acting(f, effects)
            restart(f, p, run, starts[window], u[k])
        elif k > 0:
            buffers.breaks[0], buffers.breaks[1] = t[k - 1], t[k]
            buffers.piece[0, 0] = u[k - 1]
            status = predict(f, p, run, work, tab, buffers.breaks, buffers.piece, effects, buffers)
            if status != DONE:
                return status
        for e in range(readings):
            gap, variance, read = 0.0, 0.0, angles[k, e]
            if e == 1 and f.relative:
                read -= angles[k, 0]
            if read == read:
                gap, variance = update(
                    f, e, read, noise[k, e], gradients[window], informations[window]
                )
            if trace.shape[0] > 0:
                trace[k, 2 * e], trace[k, 2 * e + 1] = gap, variance
            if path.size > 0:
                weight = note_gain(f, path[k], e, gap, variance)
                if slopes.shape[0] > 0:
                    for c in range(N_SLOPES):
                        slopes[k, e, c] = f.slope[c] * weight
            if f.release > 0.0 and variance > 0.0 and k > 0:
                release(f, run, e, gap, variance, t[k] - t[k - 1])
        f.load[0], f.load[1] = loads[k, 0], loads[k, 1]
        stop_reversed(f, run)
        if effects.entries.size > 0 and k + 1 < t.size:
            load_state(f, p, run)
            look_ahead(f, p, run, effects, t[k], t[k + 1] - t[k], u[k])
        follow_modes(f, p, run, u[k])
        if path.size > 0:
            note_transition(f, run, path[k])
        if trace.shape[0] > 0:
            for i in range(N_FILTER):
                trace[k, 2 * readings + i] = f.y[i]
    take_volume(f)
    return DONE
