"""Compiled Kalman filter through the set-valued rig with a latent torque on each disc.

State: twist, omega_u, omega_l, theta_l, and the torques d_u and d_l (Nm, Ornstein-Uhlenbeck).
Each sample interval is one exact integration between events whose sensitivities are the
transition; a stuck disc's velocity has no variance, so nothing but the inclusion itself releases
it. `S` is the derivative of the filtered state by the parameters and by the start: the encoders'
difference, both velocities and theta_l there, and the twist at which the encoders agree. The
start is estimated and not filtered: a release is too sharp for its first wide variance.

Readings are theta_u and theta_l, then, where a velocity is recorded, omega_u and omega_l.
"""

from math import exp, log

from drill_env._jit import kernel
from drill_env.identification._filter_effects import (
    act,
    bend_transition,
    forget_acting,
    look_ahead,
)
from drill_env.identification._filter_state import (
    D_L,
    D_U,
    N_FILTER,
    N_SLOPES,
    START_OFFSET,
)
from drill_env.integrator._advance import DONE, advance
from drill_env.integrator._modes import start_mode
from drill_env.integrator._records import FIRST_PARAMETER, LOAD_L, LOAD_U, N_STATE
from drill_env.parameters._record import N_PARAMETERS


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
def load_state(f, p, run):
    """Hand the filtered state and torques to the integrator."""
    p.load_u = f.load[0] + f.y[D_U] + f.acted[0]
    p.load_l = f.load[1] + f.y[D_L] + f.acted[1]
    for i in range(N_STATE):
        run.y[i] = f.y[i]


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


@kernel
def spread_covariance(f, dt):
    """P <- F P F' + Q and S <- F S + G, with the transition over `dt` s in `f.F`."""
    for i in range(N_STATE):
        for j in range(N_FILTER):
            total = 0.0
            for m in range(N_FILTER):
                total += f.F[i, m] * f.P[m, j]
            f.FP[i, j] = total
        if f.slopes > 0:
            for m in range(N_FILTER):
                share = f.F[i, m]
                for c in range(N_SLOPES):
                    f.FS[i, c] += share * f.S[m, c]
    decay_u, decay_l = exp(-f.rate[0] * dt), exp(-f.rate[1] * dt)
    for j in range(N_FILTER):
        f.FP[D_U, j] = decay_u * f.P[D_U, j]
        f.FP[D_L, j] = decay_l * f.P[D_L, j]
    for i in range(N_FILTER):
        for j in range(N_STATE):
            total = 0.0
            for m in range(N_FILTER):
                total += f.FP[i, m] * f.F[j, m]
            f.P[i, j] = f.P[j, i] = total
    f.P[D_U, D_U] = decay_u * f.FP[D_U, D_U] + (1.0 - decay_u * decay_u) * f.variance[0]
    f.P[D_L, D_L] = decay_l * f.FP[D_L, D_L] + (1.0 - decay_l * decay_l) * f.variance[1]
    f.P[D_U, D_L] = f.P[D_L, D_U] = decay_l * f.FP[D_U, D_L]
    for c in range(f.slopes):
        for i in range(N_STATE):
            f.S[i, c] = f.FS[i, c]
        f.S[D_U, c] *= decay_u
        f.S[D_L, c] *= decay_l
    f.y[D_U] *= decay_u
    f.y[D_L] *= decay_l


@kernel
def predict(f, p, run, work, tab, breaks, piece, effects, buffers):
    """Carry state, covariance and sensitivities over one sample interval."""
    load_state(f, p, run)
    for i in range(N_STATE):
        for c in range(work.columns):
            work.sens[i, c] = 1.0 if i == c else 0.0
    begin, dt, parts = breaks[0], breaks[1] - breaks[0], f.parts
    for part in range(parts):
        breaks[0], breaks[1] = begin + part * dt / parts, begin + (part + 1) * dt / parts
        if part > 0:
            act(f, p, run, effects, breaks[0], dt / parts, piece[0, 0])
        run.t, run.piece, run.sample, run.logged, run.steps = breaks[0], 0, 0, 0, 0
        status = advance(
            p, run, work, tab, breaks, piece, buffers.t_eval, buffers.out, buffers.modes,
            buffers.log, buffers.sens,
        )  # fmt: skip
        if status != DONE:
            return status
    for i in range(N_STATE):
        f.y[i] = run.y[i]
        for m in range(N_STATE):
            f.F[i, m] = work.sens[i, m]
        f.F[i, D_U] = work.sens[i, LOAD_U]
        f.F[i, D_L] = work.sens[i, LOAD_L]
        for c in range(f.slopes):
            f.FS[i, c] = work.sens[i, FIRST_PARAMETER + c] if c < N_PARAMETERS else 0.0
    if effects.bundle.codes.size > 0:
        bend_transition(f)
    spread_covariance(f, dt)
    return DONE


@kernel
def foresee_angle(f, upper):
    """Put an encoder's row of the measurement into `PH` and `slope`; its reading and variance."""
    a = 1.0 if upper else 0.0
    for i in range(N_FILTER):
        f.PH[i] = a * f.P[i, 0] + f.P[i, 3]
    for c in range(f.slopes):
        f.slope[c] = a * f.S[0, c] + f.S[3, c]
    if f.slopes > 0:
        f.slope[N_PARAMETERS + START_OFFSET] -= a
    return a * (f.y[0] - f.offset) + f.y[3], a * f.PH[0] + f.PH[3]


@kernel
def foresee_velocity(f, row):
    """As `foresee_angle`, for the velocity in a row of the state."""
    for i in range(N_FILTER):
        f.PH[i] = f.P[i, row]
    for c in range(f.slopes):
        f.slope[c] = f.S[row, c]
    return f.y[row], f.PH[row]


@kernel
def update(f, reading, measured, noise, gradient, information):
    """Take one sample in; returns its innovation (rad or rad/s) and the variance of that."""
    if reading < 2:
        expected, spread = foresee_angle(f, reading == 0)
    else:
        expected, spread = foresee_velocity(f, reading - 1)
    gap, variance = measured - expected, spread + noise
    used, loss = variance, gap * gap / variance
    if gap * gap > f.robust * f.robust * variance:
        # Huber's weight: the sample counts as one of larger noise.
        used = abs(gap) * variance**0.5 / f.robust
        loss = 2.0 * gap * gap / used - f.robust * f.robust
    f.value += loss + log(variance)
    f.count += 1
    # A path's reader sums them up itself, and the errors of its own along with them.
    if f.summed:
        for c in range(f.slopes):
            gradient[c] += f.slope[c] * gap / used
            for d in range(c + 1):
                information[c, d] += f.slope[c] * f.slope[d] / used
    for i in range(N_FILTER):
        gain = f.PH[i] / used
        f.y[i] += gain * gap
        for c in range(f.slopes):
            f.S[i, c] -= gain * f.slope[c]
        for j in range(N_FILTER):
            f.P[i, j] -= gain * f.PH[j]
    return gap, variance


@kernel
def note_gain(f, row, reading, gap, variance):
    """Keep the gain of the sample just taken."""
    used = max(variance, abs(gap) * variance**0.5 / f.robust)
    row.weight[reading] = 1.0 / used**0.5 if variance > 0.0 else 0.0
    row.white[reading] = gap * row.weight[reading]
    for i in range(N_FILTER):
        row.gain[reading, i] = f.PH[i] / used if variance > 0.0 else 0.0
    for c in range(f.slopes):
        row.slopes[reading, c] = f.slope[c] * row.weight[reading]


@kernel
def note_transition(f, run, row):
    """Keep the transition into the row, the doubt after it, and which discs stick there."""
    for i in range(N_FILTER):
        for j in range(N_FILTER):
            row.P[i, j] = f.P[i, j]
    for i in range(N_STATE):
        for m in range(N_FILTER):
            row.F[i, m] = f.F[i, m]
    row.stuck[0], row.stuck[1] = run.mode[0] == 0, run.mode[1] == 0


@kernel
def run_filter(
    f, p, run, work, tab, t, u, loads, effects, angles, noise, restarts, starts, buffers,
    gradients, informations, trace, path,
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

    Returns:
        `DONE` or a failure of the integrator.
    """
    window, readings = -1, angles.shape[1]
    for k in range(t.size):
        if window + 1 < restarts.size and restarts[window + 1] == k:
            window += 1
            f.load[0], f.load[1] = loads[k, 0], loads[k, 1]
            restart(f, p, run, starts[window], u[k])
            forget_acting(f, effects)
        elif k > 0:
            buffers.breaks[0], buffers.breaks[1] = t[k - 1], t[k]
            buffers.piece[0, 0] = u[k - 1]
            status = predict(
                f, p, run, work, tab, buffers.breaks, buffers.piece, effects, buffers
            )
            if status != DONE:
                return status
        for e in range(readings):
            gap, variance = 0.0, 0.0
            if angles[k, e] == angles[k, e]:
                gap, variance = update(
                    f, e, angles[k, e], noise[k, e], gradients[window], informations[window]
                )
            if trace.shape[0] > 0:
                trace[k, 2 * e], trace[k, 2 * e + 1] = gap, variance
            if path.size > 0:
                note_gain(f, path[k], e, gap, variance)
            if f.release > 0.0 and variance > 0.0 and k > 0:
                release(f, run, e, gap, variance, t[k] - t[k - 1])
        f.load[0], f.load[1] = loads[k, 0], loads[k, 1]
        stop_reversed(f, run)
        if effects.bundle.codes.size > 0 and k + 1 < t.size:
            load_state(f, p, run)
            look_ahead(f, p, run, effects, t[k], t[k + 1] - t[k], u[k])
        follow_modes(f, p, run, u[k])
        if path.size > 0:
            note_transition(f, run, path[k])
        if trace.shape[0] > 0:
            for i in range(N_FILTER):
                trace[k, 2 * readings + i] = f.y[i]
    return DONE
