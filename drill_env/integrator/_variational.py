"""Compiled first-order sensitivities, the exact derivative of the accepted steps.

Columns are derivatives of (twist, omega_u, omega_l, theta_l): four by the initial
state, two by the external torques, then one per parameter of `drill_env.parameters`.
"""

from drill_env._jit import kernel, number_at, store_number, unit
from drill_env.dynamics.kernels import fill_jacobian, fill_parameter_rates
from drill_env.friction.kernels import shares
from drill_env.integrator._voltage_piece import voltage_at
from drill_env.integrator.records import (
    FIRST_PARAMETER,
    LOAD_L,
    LOAD_U,
    MOST_COLUMNS,
    N_COLUMNS,
    N_STATE,
)
from drill_env.integrator.signatures import FILL
from drill_env.parameters.record import N_PARAMETERS


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


@kernel
def fill_stage_rates(p, run, work, i, u):
    """Rates of the sensitivities at stage `i`."""
    ys, mode, jac, s, ks = work.ys, run.mode, work.jac, work.stage, work.ks
    fill_jacobian(p, mode[0], mode[1], mode[2], ys[i, 2], jac)
    for c in range(work.columns):
        ks[i, 0, c] = s[1, c] - s[2, c]
        ks[i, 1, c] = jac[0] * s[0, c] + jac[1] * s[1, c]
        ks[i, 2, c] = jac[2] * s[0, c] + jac[3] * s[2, c]
        ks[i, 3, c] = s[2, c]
    if mode[0] != 0:
        ks[i, 1, LOAD_U] += p.per_Ju
    if mode[1] != 0:
        ks[i, 2, LOAD_L] += p.per_Jl
    if work.columns == FIRST_PARAMETER:
        return
    s1, s2 = shares(p, mode[1] * ys[i, 2])
    fill_parameter_rates(
        p, mode[0], mode[1], mode[2], ys[i, 0], ys[i, 1], ys[i, 2], u, work.k[i, 1], work.k[i, 2],
        s1, s2, work.rates[0], work.rates[1],
    )  # fmt: skip
    for c in range(N_PARAMETERS):
        ks[i, 1, FIRST_PARAMETER + c] += work.rates[0, c]
        ks[i, 2, FIRST_PARAMETER + c] += work.rates[1, c]


@unit(FILL)
def step_sensitivity(p, run, work, tab, h):
    """Carry `work.sens` over the accepted step whose stages are in `work`.

    The same tableau run on the variational equations differentiates the step itself.
    """
    for i in range(tab.stages):
        add_stages(work, tab, h, i)
        fill_stage_rates(p, run, work, i, voltage_at(work, run.t + tab.c[i] * h))
    add_stages(work, tab, h, tab.stages)
    for r in range(N_STATE):
        for c in range(work.columns):
            work.sens[r, c] = work.stage[r, c]


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
