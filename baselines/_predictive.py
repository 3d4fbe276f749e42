"""Compiled box-constrained quadratic programs, one a rig and period."""

from drill_env._jit import entry


@entry
def solve_rigs(
    index, state, reference, limit, pull, hessian, gain, bound, sweeps, plan, work, volts
):
    """First voltage of the plan that minimises 0.5 u'Hu + x'G u within the limits.

    Where the unconstrained plan, `gain` x, keeps within the limits it is the answer; elsewhere
    coordinate descent follows, from the last plan moved on by a period.

    Args:
        index: which program each rig follows, shape (n,).
        state: estimated states, shape (n, s).
        reference: voltage of the reference (V), shape (n,).
        limit: V.
        pull: G, shape (programs, s, N).
        hessian: H, shape (programs, N, N).
        gain: -H^-1 G', shape (programs, N, s).
        bound: voltage change below which the descent stops, V.
        sweeps: of the descent, at most.
        plan: last plans, shape (n, N), overwritten.
        work: shape (N,).
        volts: to write, shape (n,).
    """
    states, steps = state.shape[1], plan.shape[1]
    for i in range(index.size):
        j = index[i]
        low, high = -limit - reference[i], limit - reference[i]
        free = True
        for k in range(steps):
            u = 0.0
            for a in range(states):
                u += gain[j, k, a] * state[i, a]
            work[k] = u
            free = free and low <= u <= high
        if free:
            for k in range(steps):
                plan[i, k] = work[k]
        else:
            for k in range(steps):
                plan[i, k] = min(max(plan[i, k + 1] if k + 1 < steps else 0.0, low), high)
                work[k] = 0.0
                for a in range(states):
                    work[k] += pull[j, a, k] * state[i, a]
            for _ in range(sweeps):
                moved = 0.0
                for k in range(steps):
                    slope = work[k]
                    for c in range(steps):
                        slope += hessian[j, k, c] * plan[i, c]
                    u = min(max(plan[i, k] - slope / hessian[j, k, k], low), high)
                    moved = max(moved, abs(u - plan[i, k]))
                    plan[i, k] = u
                if moved < bound:
                    break
        volts[i] = reference[i] + plan[i, 0]
