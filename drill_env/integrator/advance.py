"""Compiled event-driven integration through a piecewise-polynomial voltage."""

from drill_env._intrinsics import address_of
from drill_env._jit import entry, inlined, kernel, unit
from drill_env.integrator._events import first_event
from drill_env.integrator._samples import rest_to_end, write_samples
from drill_env.integrator._step import (
    CHATTER_LIMIT,
    DONE,
    LOG_FULL,
    TOO_MANY_STEPS,
    adapt,
    choose_step,
    fill_rates,
    next_sample,
    reject,
)
from drill_env.integrator._voltage_piece import load_piece, voltage_at
from drill_env.integrator.modes import change, note_turn, overdue
from drill_env.integrator.records import LOWER_LAW, N_STATE
from drill_env.integrator.signatures import ADVANCE, call_advance, call_fill, call_step

_NO_TIME = 1e-13
_LAST_DIGIT = 2.0**-52
# One step may log this many events.
_LOG_MARGIN = 8


@inlined
def load_rates(p, run, work, tab):
    """Stage 0 of the step that starts now."""
    for i in range(N_STATE):
        work.ys[0, i] = run.y[i]
    if not work.has_rates:
        for r in range(work.inner):
            work.ys[0, N_STATE + r] = run.z[r]
        fill_rates(p, run, work, tab, 0.0, 0)
        work.has_rates = 1


@kernel
def pass_overdue(p, run, work, tab):
    """Change a mode that cannot last; whether one was."""
    u = voltage_at(work, run.t)
    for which in range(3 + work.switches):
        if which != LOWER_LAW and overdue(which, p, run, work, u):
            change(which, p, run, work, tab, u)
            run.chatter += 1
            return True
    return False


@inlined
def nothing_moves(run, work):
    """Whether all is the same until the piece ends: both discs rest, and nothing else changes.

    An inner state that moves by less than the last digit of the error allowed counts as at rest:
    one that decays would never be.
    """
    if run.mode[0] != 0 or run.mode[1] != 0 or work.restless == 2:
        return False
    if work.coefficients > 1 or work.late > 1:
        return False
    for r in range(work.inner):
        allowed = work.atol + work.rtol * abs(run.z[r])
        if abs(work.k[0, N_STATE + r]) * (work.end - run.t) > _LAST_DIGIT * allowed:
            return False
    return True


@kernel
def finish_step(p, run, work, tab, h, t_new):
    """Accept the step: samples, turning points, sensitivities, new state."""
    last = tab.stages
    # A released disc starts with a rate of about +-1e-17: no turning point.
    turns = (
        work.extrema
        and run.mode[1] != 0
        and abs(work.k[0, 2]) > 1e-10
        and work.k[0, 2] * work.k[last, 2] < 0.0
    )
    if turns or next_sample(run, work) < t_new:
        call_fill(tab.fill, p, run, work, tab, h)
    if work.sensitivity:
        call_fill(tab.carry, p, run, work, tab, h)
    write_samples(run, work, tab, h, t_new)
    if turns:
        note_turn(run, work, tab, h)
    for i in range(N_STATE):
        run.y[i] = work.ys[last, i]
        work.k[0, i] = work.k[last, i]
    work.shares[0, 0], work.shares[0, 1] = work.shares[last, 0], work.shares[last, 1]
    if work.acting != 0:
        keep_inner(run, work, last, h)
    run.max_speed = max(run.max_speed, abs(run.y[2]))
    run.t = t_new
    # A step that no clock could tell lets a chatter of effects go on.
    if work.acting == 0 or h > _NO_TIME * (1.0 + abs(t_new)):
        run.chatter = 0


@kernel
def keep_inner(run, work, last, h):
    """Inner states, their rates and the event functions of a step's end are those of the next."""
    for r in range(N_STATE, N_STATE + work.inner):
        run.z[r - N_STATE] = work.ys[0, r] = work.ys[last, r]
        work.k[0, r] = work.k[last, r]
    work.pace[2] = max(work.pace[1] - work.pace[0], 0.0) / h
    work.pace[0] = work.pace[1]
    for j in range(3 + work.switches):
        work.gaps[0, j] = work.gaps[last, j]
    if work.asked == last:
        work.asked = 0


@kernel
def one_step(p, run, work, tab):
    """One try: a mode change, a rest, a rejected or an accepted step."""
    load_rates(p, run, work, tab)
    watching = run.chatter < CHATTER_LIMIT
    if watching and pass_overdue(p, run, work, tab):
        return DONE
    if watching and nothing_moves(run, work):
        rest_to_end(run, work)
        return DONE
    h, t_new = choose_step(run, work)
    clipped = t_new < 1e300
    error = call_step(tab.step, p, run, work, tab, h)
    run.steps += 1
    if not error <= 1.0:
        return reject(run, tab, h, error)
    if run.steps > work.max_steps:
        return TOO_MANY_STEPS
    adapt(run, tab, h, clipped, error)
    which, tried = -1, h
    if watching:
        which, h, error = first_event(p, run, work, tab, h)
        if not error <= 1.0:
            return reject(run, tab, h, error)
    if which >= 0 and h == 0.0:
        # A switch whose function is zero right here.
        work.located = 1 if which > LOWER_LAW else 0
        change(which, p, run, work, tab, voltage_at(work, run.t))
        work.located = 0
        run.chatter += 1
        return DONE
    if which >= 0 or h < tried or not clipped:
        t_new = run.t + h
    finish_step(p, run, work, tab, h, t_new)
    if which >= 0:
        work.located = 1
        change(which, p, run, work, tab, voltage_at(work, run.t))
        work.located = 0
    return DONE


@unit(ADVANCE)
def run_pieces(p, run, work, tab):
    """What `advance` calls."""
    while run.piece < work.piece_count:
        load_piece(run, work)
        while run.t < work.end:
            if run.logged + _LOG_MARGIN > work.log_size:
                return LOG_FULL
            status = one_step(p, run, work, tab)
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
        pieces: polynomial coefficients in the share of each piece, then `work.late` of those of
            the voltage a delay ago; shape (n, d).
        t_eval: sample times in s, ascending, after the start; shape (m,).
        out: states at the samples, shape (m, 4).
        modes: disc modes at the samples, shape (m, 2).
        log: records of `EVENT`.
        sens_out: sensitivities at the samples, shape (m, 4, 20), or empty.

    Returns:
        `DONE`, `LOG_FULL` (empty the log and call again) or a failure.
    """
    work.breaks, work.pieces, work.piece_count = address_of(breaks), address_of(pieces), len(pieces)
    work.coefficients = pieces.shape[1] - work.late
    work.t_eval, work.samples = address_of(t_eval), t_eval.size
    work.out, work.modes, work.sens_out = address_of(out), address_of(modes), address_of(sens_out)
    work.log, work.log_size = address_of(log), log.size
    return call_advance(tab.advance, p, run, work, tab)
