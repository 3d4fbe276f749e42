"""Compiled event-driven integration through a piecewise-polynomial voltage."""

from drill_env._jit import entry, inlined, kernel, unit
from drill_env.integrator._events import LOWER, UPPER, first_event
from drill_env.integrator._modes import MAXIMUM, MINIMUM, change, note, overdue
from drill_env.integrator._records import N_STATE
from drill_env.integrator._signatures import ADVANCE, call_advance, call_fill, call_step
from drill_env.integrator._step import dense_at, fill_rates
from drill_env.integrator._variational import copy_sensitivity
from drill_env.integrator._voltage_piece import voltage_at

DONE, LOG_FULL, STEP_TOO_SMALL, TOO_MANY_STEPS = 0, 1, 2, 3

# So many mode changes at one instant are chatter: one tiny step is then taken as it is.
_CHATTER_LIMIT = 12
_CHATTER_STEP = 1e-7
# One step may log this many events.
_LOG_MARGIN = 8


@kernel
def load_piece(run, work, breaks, pieces):
    """Make the present voltage piece the one that steps read."""
    work.start, work.end = breaks[run.piece], breaks[run.piece + 1]
    work.coefficients = pieces.shape[1]
    for i in range(pieces.shape[1]):
        work.piece[i] = pieces[run.piece, i]
    work.has_rates = 0


@inlined
def load_rates(p, run, work):
    """Stage 0 of the step that starts now."""
    for i in range(N_STATE):
        work.ys[0, i] = run.y[i]
    if not work.has_rates:
        fill_rates(p, run, work, 0, voltage_at(work, run.t))
        work.has_rates = 1


@kernel
def pass_overdue(p, run, work, log):
    """Change a mode that cannot last; whether one was."""
    u = voltage_at(work, run.t)
    for which in (UPPER, LOWER):
        if overdue(which, p, run, work, u):
            change(which, p, run, work, log, u)
            run.chatter += 1
            return True
    return False


@kernel
def rest_to_end(run, work, t_eval, out, modes, sens_out):
    """Both discs stuck under a constant voltage: nothing moves until the piece ends."""
    while run.sample < t_eval.size and t_eval[run.sample] <= work.end:
        for i in range(N_STATE):
            out[run.sample, i] = run.y[i]
        modes[run.sample, 0] = modes[run.sample, 1] = 0
        if work.sensitivity:
            copy_sensitivity(work, sens_out, run.sample)
        run.sample += 1
    run.t = work.end
    run.chatter = 0


@inlined
def choose_step(run, work, t_eval):
    """Step to try, and the time at which it ends exactly (or infinity)."""
    target = work.end
    if work.sensitivity and run.sample < t_eval.size:
        # Sensitivities have no dense output: end a step at every sample.
        target = min(target, t_eval[run.sample])
    limit = target - run.t
    h = min(run.h, work.max_step)
    if run.chatter >= _CHATTER_LIMIT:
        h = min(h, _CHATTER_STEP)
    if h >= limit * (1.0 - 1e-9):
        return limit, target
    # Two equal steps rather than a step and a sliver.
    return min(h, 0.5 * limit) if h > 0.5 * limit else h, 1e300


@kernel
def reject(run, tab, h, error):
    """Shorten the next try; a collapse of the step is a failure."""
    run.rejected += 1
    factor = 0.8 * error ** (-1.0 / tab.order) if error == error else 0.1
    run.h = h * max(0.2, factor)
    return STEP_TOO_SMALL if run.h < 1e-14 * (1.0 + abs(run.t)) else DONE


@kernel
def adapt(run, tab, h, clipped, error):
    """Set the next step from the error of an accepted one."""
    # Slow growth: the friction is steep near rest, and a long step into it is lost.
    grow = 2.0 if error < 1e-3 else min(2.0, 0.8 * error ** (-1.0 / tab.order))
    new = h * max(grow, 0.3)
    # A step cut short by a sample or a jump says nothing against longer ones.
    run.h = max(new, run.h) if clipped and grow >= 1.0 else new


@kernel
def note_turn(run, work, tab, h, log):
    """Log the turning point of omega_l inside the step."""
    first = work.k[0, 2]
    a, b = 0.0, 1.0
    for _ in range(60):
        s = 0.5 * (a + b)
        slope = 0.0
        for m in range(tab.degree - 1, -1, -1):
            slope = slope * s + (m + 1) * work.dense[2, m]
        if slope * first > 0.0:
            a = s
        else:
            b = s
    s = 0.5 * (a + b)
    for i in range(N_STATE):
        work.turn[i] = dense_at(work, tab, i, s)
    note(log, run, run.t + s * h, LOWER, MAXIMUM if first > 0.0 else MINIMUM, work.turn)


@inlined
def write_samples(run, work, tab, h, t_new, t_eval, out, modes, sens_out):
    """Fill the samples in (t, t_new]."""
    while run.sample < t_eval.size and t_eval[run.sample] <= t_new:
        row = run.sample
        s = (t_eval[row] - run.t) / h
        for i in range(N_STATE):
            if t_eval[row] == t_new:
                out[row, i] = work.ys[tab.stages, i]
            else:
                out[row, i] = dense_at(work, tab, i, s)
        modes[row, 0], modes[row, 1] = run.mode[0], run.mode[1]
        if work.sensitivity:
            copy_sensitivity(work, sens_out, row)
        run.sample += 1


@kernel
def finish_step(p, run, work, tab, h, t_new, t_eval, out, modes, log, sens_out):
    """Accept the step: samples, turning points, sensitivities, new state."""
    last = tab.stages
    # A released disc starts with a rate of about +-1e-17: no turning point.
    turns = (
        work.extrema
        and run.mode[1] != 0
        and abs(work.k[0, 2]) > 1e-10
        and work.k[0, 2] * work.k[last, 2] < 0.0
    )
    if turns or (run.sample < t_eval.size and t_eval[run.sample] < t_new):
        call_fill(tab.fill, p, run, work, tab, h)
    if work.sensitivity:
        call_fill(tab.carry, p, run, work, tab, h)
    write_samples(run, work, tab, h, t_new, t_eval, out, modes, sens_out)
    if turns:
        note_turn(run, work, tab, h, log)
    for i in range(N_STATE):
        run.y[i] = work.ys[last, i]
        work.k[0, i] = work.k[last, i]
    work.shares[0, 0], work.shares[0, 1] = work.shares[last, 0], work.shares[last, 1]
    run.max_speed = max(run.max_speed, abs(run.y[2]))
    run.t = t_new
    run.chatter = 0


@kernel
def one_step(p, run, work, tab, t_eval, out, modes, log, sens_out):
    """One try: a mode change, a rest, a rejected or an accepted step."""
    load_rates(p, run, work)
    watching = run.chatter < _CHATTER_LIMIT
    if watching and pass_overdue(p, run, work, log):
        return DONE
    if watching and run.mode[0] == 0 and run.mode[1] == 0 and work.coefficients == 1:
        rest_to_end(run, work, t_eval, out, modes, sens_out)
        return DONE
    h, t_new = choose_step(run, work, t_eval)
    clipped = t_new < 1e300
    error = call_step(tab.step, p, run, work, tab, h)
    run.steps += 1
    if not error <= 1.0:
        return reject(run, tab, h, error)
    if run.steps > work.max_steps:
        return TOO_MANY_STEPS
    adapt(run, tab, h, clipped, error)
    which = -1
    if watching:
        which, h = first_event(p, run, work, tab, h)
    if which >= 0 and h == 0.0:
        change(which, p, run, work, log, voltage_at(work, run.t))
        run.chatter += 1
        return DONE
    if which >= 0 or not clipped:
        t_new = run.t + h
    finish_step(p, run, work, tab, h, t_new, t_eval, out, modes, log, sens_out)
    if which >= 0:
        change(which, p, run, work, log, voltage_at(work, run.t))
    return DONE


@unit(ADVANCE)
def run_pieces(p, run, work, tab, breaks, pieces, t_eval, out, modes, log, sens_out):
    """What `advance` calls."""
    while run.piece < pieces.shape[0]:
        load_piece(run, work, breaks, pieces)
        while run.t < work.end:
            if run.logged + _LOG_MARGIN > log.size:
                return LOG_FULL
            status = one_step(p, run, work, tab, t_eval, out, modes, log, sens_out)
            if status != DONE:
                return status
        run.piece += 1
    return DONE


@entry
def advance(p, run, work, tab, breaks, pieces, t_eval, out, modes, log, sens_out):
    """Integrate from `run.t` to `breaks[-1]`; everything is updated in place.

    Args:
        p: record of `PARAMETERS`.
        run: record of `RUN`, state and clock.
        work: record of `WORK`, options and working arrays.
        tab: record of `TABLEAU`.
        breaks: ends of the voltage pieces in s, shape (n + 1,).
        pieces: polynomial coefficients in the share of each piece, shape (n, d).
        t_eval: sample times in s, ascending, after the start; shape (m,).
        out: states at the samples, shape (m, 4).
        modes: disc modes at the samples, shape (m, 2).
        log: records of `EVENT`.
        sens_out: sensitivities at the samples, shape (m, 4, 18), or empty.

    Returns:
        `DONE`, `LOG_FULL` (empty the log and call again) or a failure.
    """
    return call_advance(
        tab.advance, p, run, work, tab, breaks, pieces, t_eval, out, modes, log, sens_out
    )
