"""Compiled first-order sensitivities, the exact derivative of the accepted steps.

Columns are derivatives of (twist, omega_u, omega_l, theta_l): four by the initial
state, two by the external torques, then one per parameter of `drill_env.parameters`.
"""

from drill_env._jit import kernel, number_at, store_number, unit
from drill_env.integrator._stage import fill_forces
from drill_env.integrator.records import MOST_COLUMNS, N_COLUMNS, N_STATE
from drill_env.integrator.signatures import FILL


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
