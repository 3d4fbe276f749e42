"""Compiled prediction of the filter: state, covariance and slopes over one sample interval."""

from math import exp

from drill_env._jit import kernel
from drill_env.identification._filter_effects import act, bend_transition
from drill_env.identification._filter_state import D_L, D_U, N_FILTER, N_SLOPES
from drill_env.integrator.advance import DONE, advance
from drill_env.integrator.records import FIRST_PARAMETER, LOAD_L, LOAD_U, N_STATE
from drill_env.parameters.record import N_PARAMETERS


@kernel
def load_state(f, p, run):
    """Hand the filtered state and torques to the integrator."""
    p.load_u = f.load[0] + f.y[D_U] + f.acted[0]
    p.load_l = f.load[1] + f.y[D_L] + f.acted[1]
    for i in range(N_STATE):
        run.y[i] = f.y[i]


@kernel
def spread_covariance(f, dt):
    """P <- F P F' + Q and S <- F S + G, with the transition over `dt` s in `f.F`."""
    # Rows times a number, no sums of products: several columns go at once.
    for i in range(N_STATE):
        for j in range(N_FILTER):
            f.FP[i, j] = f.F[i, 0] * f.P[0, j]
        for m in range(1, N_FILTER):
            share = f.F[i, m]
            for j in range(N_FILTER):
                f.FP[i, j] += share * f.P[m, j]
        if f.slopes > 0:
            for m in range(N_FILTER):
                share = f.F[i, m]
                for c in range(N_SLOPES):
                    f.FS[i, c] += share * f.S[m, c]
    decay_u, decay_l = exp(-f.rate[0] * dt), exp(-f.rate[1] * dt)
    for j in range(N_FILTER):
        f.FP[D_U, j] = decay_u * f.P[D_U, j]
        f.FP[D_L, j] = decay_l * f.P[D_L, j]
    for j in range(N_STATE):
        for i in range(j, N_FILTER):
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
    if effects.entries.size > 0:
        bend_transition(f)
    spread_covariance(f, dt)
    return DONE
