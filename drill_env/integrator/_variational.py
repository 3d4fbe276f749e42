"""Compiled first-order sensitivities, the exact derivative of the accepted steps.

Columns are derivatives of (twist, omega_u, omega_l, theta_l): four by the initial
state, two by the external torques, then one per parameter of `drill_env.parameters`.
"""

from drill_env._jit import inlined, kernel, unit
from drill_env.dynamics.kernels import fill_linear, fill_parameter_rates, lower_rate_slope
from drill_env.integrator._voltage_piece import voltage_at
from drill_env.integrator.records import FIRST_PARAMETER, LOAD_L, LOAD_U, N_STATE
from drill_env.integrator.signatures import FILL


@inlined
def column_rates(a, b, d, slope, force_u, force_l, y):
    """Rates of a column of the sensitivities by `jac`, the lower law's slope and what drives it."""
    x, v, w = y
    return v - w, a * x + b * v + force_u, d * x + slope * w + force_l


@inlined
def fill_forces(p, run, work, tab, h):
    """What drives every column of the sensitivities at the stages before the last."""
    mode, ys, shares = run.mode, work.ys, work.shares
    fill_linear(p, mode[0], mode[1], work.jac)
    for i in range(tab.stages):
        s1, s2 = shares[i, 0], shares[i, 1]
        work.slopes[i] = lower_rate_slope(p, mode[1], mode[2], s1, s2)
        work.force[i, 0, LOAD_U] = p.per_Ju if mode[0] != 0 else 0.0
        work.force[i, 1, LOAD_L] = p.per_Jl if mode[1] != 0 else 0.0
        if work.columns > FIRST_PARAMETER:
            fill_parameter_rates(
                p, mode[0], mode[1], mode[2], ys[i, 0], ys[i, 1], ys[i, 2],
                voltage_at(work, run.t + tab.c[i] * h), work.k[i, 1], work.k[i, 2], s1, s2,
                work.force[i, 0, FIRST_PARAMETER:], work.force[i, 1, FIRST_PARAMETER:],
            )  # fmt: skip


@kernel
def add_stages(work, tab, h, i):
    """Sensitivities at stage `i`, in `work.stage`."""
    for r in range(N_STATE):
        for c in range(work.columns):
            work.stage[r, c] = work.sens[r, c]
    for j in range(i):
        w = h * tab.a[i, j]
        if w != 0.0:
            for r in range(N_STATE):
                for c in range(work.columns):
                    work.stage[r, c] += w * work.ks[j, r, c]


@unit(FILL)
def step_sensitivity(p, run, work, tab, h):
    """Carry `work.sens` over the accepted step whose stages are in `work`.

    The same tableau run on the variational equations differentiates the step itself.
    """
    fill_forces(p, run, work, tab, h)
    jac, s, ks, force = work.jac, work.stage, work.ks, work.force
    for i in range(tab.stages):
        add_stages(work, tab, h, i)
        for c in range(work.columns):
            ks[i, 0, c] = s[1, c] - s[2, c]
            ks[i, 1, c] = jac[0] * s[0, c] + jac[1] * s[1, c] + force[i, 0, c]
            ks[i, 2, c] = jac[2] * s[0, c] + work.slopes[i] * s[2, c] + force[i, 1, c]
            ks[i, 3, c] = s[2, c]
    add_stages(work, tab, h, tab.stages)
    for r in range(N_STATE):
        for c in range(work.columns):
            work.sens[r, c] = work.stage[r, c]
