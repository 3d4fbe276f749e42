"""Compiled first-order sensitivities, the exact derivative of the accepted steps.

Columns are derivatives of (twist, omega_u, omega_l, theta_l): four by the initial
state, then one per parameter of `drill_env.parameters`.
"""

from drill_env._jit import kernel
from drill_env.dynamics._kernels import fill_jacobian, fill_parameter_rates
from drill_env.integrator._step import voltage_at
from drill_env.parameters._vector import N_PARAMETERS

N_STATE = 4
N_COLUMNS = N_STATE + N_PARAMETERS


@kernel
def step_sensitivity(p, mode, sens, piece, length, elapsed, h, tableau, ys, ks, work, jac, rates):
    """Carry `sens` (4, 18) over an accepted step whose stage states are `ys`.

    The same tableau run on the variational equations differentiates the step itself.
    """
    n = tableau.stages
    for i in range(n + 1):
        for r in range(N_STATE):
            for c in range(N_COLUMNS):
                work[r, c] = sens[r, c]
        for j in range(i):
            w = h * tableau.a[i, j]
            if w != 0.0:
                for r in range(N_STATE):
                    for c in range(N_COLUMNS):
                        work[r, c] += w * ks[j, r, c]
        if i == n:
            break
        fill_jacobian(p, mode[0], mode[1], mode[2], ys[i, 2], jac)
        u = voltage_at(piece, length, elapsed + tableau.c[i] * h)
        fill_parameter_rates(
            p, mode[0], mode[1], mode[2], ys[i, 0], ys[i, 1], ys[i, 2], u, rates[0], rates[1]
        )
        for c in range(N_COLUMNS):
            ks[i, 0, c] = work[1, c] - work[2, c]
            ks[i, 1, c] = jac[0] * work[0, c] + jac[1] * work[1, c]
            ks[i, 2, c] = jac[2] * work[0, c] + jac[3] * work[2, c]
            ks[i, 3, c] = work[2, c]
        for c in range(N_PARAMETERS):
            ks[i, 1, N_STATE + c] += rates[0, c]
            ks[i, 2, N_STATE + c] += rates[1, c]
    for r in range(N_STATE):
        for c in range(N_COLUMNS):
            sens[r, c] = work[r, c]


@kernel
def salt(sens, row, rate_before, rate_after):
    """Saltation at a zero crossing of one velocity.

    Only that velocity's rate jumps, so the saltation matrix scales its row by
    after/before; a stick sets it to zero. Break-aways and clamp switches leave the
    rates continuous: nothing to do there.
    """
    factor = rate_after / rate_before
    for c in range(N_COLUMNS):
        sens[row, c] *= factor
