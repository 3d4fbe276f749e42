"""Compiled runs of one rig from many known states."""

from math import inf

from drill_env._intrinsics import address_of
from drill_env._jit import entry
from drill_env.integrator.advance import DONE, LOG_FULL, advance
from drill_env.integrator.modes import start_mode
from drill_env.integrator.records import N_STATE
from drill_env.integrator.signatures import call_change

# Of `start_with_effects`: modes anew, the inner states as given.
_MODES = 1


@entry
def hold(t, u, shift, ends, breaks, values):
    """Cut a held voltage where it changes and at given rows.

    Args:
        t: times of the rows, s, ascending, shape (n,).
        u: voltages from each row on, V, shape (n,).
        shift: by which they act later, s.
        ends: whether to cut at the time of a row, the first and the last one included; shape (n,).
        breaks: filled with the ends of the pieces, s; room for 2 n.
        values: filled with the voltage of each piece, V; room for 2 n.

    Returns:
        How many pieces there are.
    """
    # Before the first voltage acts it is taken for the same; then no row is held yet.
    held, row, count = -1, 1, 0
    breaks[0] = t[0]
    while held + 1 < t.size and t[held + 1] + shift <= t[0]:
        held += 1
    while row < t.size:
        # Equal neighbours are one piece, so that constant stretches cost nothing.
        while 0 <= held < t.size - 1 and u[held + 1] == u[held]:
            held += 1
        while not ends[row]:
            row += 1
        change = t[held + 1] + shift if held + 1 < t.size else inf
        values[count] = u[max(held, 0)]
        count += 1
        breaks[count] = min(change, t[row])
        ended = t[row] <= change
        if change <= t[row]:
            held += 1
        if ended:
            row += 1
    return count


@entry
def run_windows(p, run, work, tab, begin, drive, spans, t_eval, starts, inner, kept, scratch):
    """Run from every start through its part of a voltage.

    Args:
        p: record of `PARAMETERS`.
        run: record of `RUN`.
        work: record of `WORK`, told of the effects.
        tab: record of `TABLEAU`.
        begin: address of `start_with_effects`, 0 without effects.
        drive: breaks and pieces of the voltage.
        spans: first piece, the one after the last, first sample, the one after the last, of each
            window; shape (w, 4).
        t_eval: sample times, s, ascending within a window, after its start.
        starts: states, shape (w, 4).
        inner: inner states, shape (w, m).
        kept: states and inner states at the samples, filled; infinite where a run failed.
        scratch: disc modes at the samples, log of events, no sensitivities.
    """
    breaks, pieces = drive
    states, memory = kept
    modes, log, sens = scratch
    for w in range(len(spans)):
        a, b, first, last = spans[w]
        run.t, run.h, run.steps, run.piece, run.sample = breaks[a], 1e-3, 0, 0, 0
        run.push[0] = run.push[1] = run.chatter = 0
        run.mode[0] = run.mode[1] = run.mode[2] = 0
        for i in range(N_STATE):
            run.y[i] = starts[w, i]
        u = pieces[a, 0]
        if begin == 0:
            start_mode(p, run, u)
        else:
            for r in range(work.inner):
                run.z[r] = inner[w, r]
            work.start, work.end, work.coefficients = breaks[a], breaks[a + 1], 1
            work.piece[0] = work.past[0] = u
            call_change(begin, p, run, work, tab, _MODES, u)
        work.has_rates = 0
        work.inner_out = address_of(memory[first:last]) if work.inner > 0 else 0
        status = LOG_FULL
        while status == LOG_FULL:
            run.logged = 0
            status = advance(
                p, run, work, tab, breaks[a : b + 1], pieces[a:b], t_eval[first:last],
                states[first:last], modes[first:last], log, sens,
            )  # fmt: skip
        if status != DONE:
            for k in range(first, last):
                for i in range(N_STATE):
                    states[k, i] = inf
