"""Compiled filling of the samples that lie within a step or a rest."""

from drill_env._intrinsics import number_at, store_number, store_whole
from drill_env._jit import inlined, kernel
from drill_env.integrator._step import dense_at, next_sample
from drill_env.integrator.records import MOST_COLUMNS, N_COLUMNS, N_STATE


@kernel
def rest_to_end(run, work):
    """Both discs stuck under a constant voltage: nothing moves until the piece ends."""
    while next_sample(run, work) <= work.end:
        for i in range(N_STATE):
            store_number(work.out, run.sample * N_STATE + i, run.y[i])
        if work.inner_out != 0:
            for r in range(work.inner):
                store_number(work.inner_out, run.sample * work.inner + r, run.z[r])
        end_sample(run, work)
    run.t = work.end
    run.chatter = 0


@inlined
def end_sample(run, work):
    """What is the same over a whole step at the present sample."""
    store_whole(work.modes, 2 * run.sample, run.mode[0])
    store_whole(work.modes, 2 * run.sample + 1, run.mode[1])
    if work.sensitivity:
        copy_sensitivity(work, run.sample)
    run.sample += 1


@kernel
def copy_sensitivity(work, row):
    """Keep the present sensitivities as those of sample `row`."""
    if work.variation != 0:
        for r in range(N_STATE):
            for c in range(work.width):
                value = number_at(work.variation_at, r * MOST_COLUMNS + c)
                store_number(work.sens_out, (row * N_STATE + r) * work.width + c, value)
        return
    for r in range(N_STATE):
        for c in range(work.columns):
            store_number(work.sens_out, (row * N_STATE + r) * N_COLUMNS + c, work.sens[r, c])


@inlined
def sample_at(work, tab, i, s):
    """As `dense_at`, written out for the pair of the environments, most of whose reads are here."""
    if tab.degree != 4:
        return dense_at(work, tab, i, s)
    d = work.dense
    value = ((d[i, 3] * s + d[i, 2]) * s + d[i, 1]) * s + d[i, 0]
    return work.ys[0, i] + value * s


@inlined
def write_samples(run, work, tab, h, t_new):
    """Fill the samples in (t, t_new]."""
    while next_sample(run, work) <= t_new:
        now, row = next_sample(run, work), run.sample
        s = (now - run.t) / h
        for i in range(N_STATE):
            value = work.ys[tab.stages, i] if now == t_new else sample_at(work, tab, i, s)
            store_number(work.out, row * N_STATE + i, value)
        if work.inner_out != 0:
            for r in range(work.inner):
                i = N_STATE + r
                value = work.ys[tab.stages, i] if now == t_new else sample_at(work, tab, i, s)
                store_number(work.inner_out, row * work.inner + r, value)
        end_sample(run, work)
