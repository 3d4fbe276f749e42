"""Compiled passes over the filter's record: errors carried forward, the likelihood backward."""

from math import exp

from drill_env._jit import kernel
from drill_env.identification._filter_state import D_L, D_U, N_FILTER
from drill_env.integrator._records import N_STATE


@kernel
def carry(path, t, rate, restarts, loads, errors, state, moved, out):
    """Whitened slopes of the innovations by the sizes of many known torques and sensor errors.

    Args:
        path: records of `path_type`, shape (n,).
        t: times in s, shape (n,).
        rate: reciprocals of the latent torques' correlation times, 1/s, shape (2,).
        restarts: rows at which the filter starts anew, ascending, the first 0; shape (r,).
        loads: torques on both discs over the interval after each row, Nm, shape (n, 2, m).
        errors: errors of the readings, rad or rad/s, shape (n, readings, m), or no rows.
        state: working array, shape (6, m).
        moved: working array, shape (6, m).
        out: filled with the slopes of the predicted readings over the innovations' standard
            deviations, shape (n, readings, m).
    """
    count = loads.shape[2]
    window = 0
    for k in range(t.size):
        row = path[k]
        if window < restarts.size and restarts[window] == k:
            window += 1
            for i in range(N_FILTER):
                for c in range(count):
                    state[i, c] = 0.0
        else:
            dt = t[k] - t[k - 1]
            step(row, exp(-rate[0] * dt), exp(-rate[1] * dt), loads[k - 1], state, moved)
        for e in range(out.shape[1]):
            if row.weight[e] == 0.0:
                for c in range(count):
                    out[k, e, c] = 0.0
                continue
            if e < 2:
                a = 1.0 if e == 0 else 0.0
                for c in range(count):
                    moved[0, c] = a * state[0, c] + state[3, c]
            else:
                for c in range(count):
                    moved[0, c] = state[e - 1, c]
            if errors.shape[0] > 0:
                for c in range(count):
                    moved[0, c] += errors[k, e, c]
            for c in range(count):
                out[k, e, c] = moved[0, c] * row.weight[e]
            for i in range(N_FILTER):
                gain = row.gain[e, i]
                for c in range(count):
                    state[i, c] -= gain * moved[0, c]
        for disc in range(2):
            if row.stuck[disc]:
                for c in range(count):
                    state[1 + disc, c] = 0.0


@kernel
def step(row, decay_u, decay_l, loads, state, moved):
    """Errors of the filtered state over one interval under held torques."""
    count = loads.shape[1]
    for i in range(N_STATE):
        for c in range(count):
            moved[i, c] = row.F[i, D_U] * loads[0, c] + row.F[i, D_L] * loads[1, c]
        for j in range(N_FILTER):
            f = row.F[i, j]
            if f != 0.0:
                for c in range(count):
                    moved[i, c] += f * state[j, c]
    for i in range(N_STATE):
        for c in range(count):
            state[i, c] = moved[i, c]
    for c in range(count):
        state[D_U, c] *= decay_u
        state[D_L, c] *= decay_l


@kernel
def smooth(path, t, rate, restarts, filtered, r, moved, states, pull, misread):
    """Smooth the states (Bryson and Frazier) and find where the likelihood pulls.

    Args:
        path: records of `path_type`, shape (n,).
        t: times in s, shape (n,).
        rate: reciprocals of the latent torques' correlation times, 1/s, shape (2,).
        restarts: rows at which the filter starts anew, ascending, the first 0; shape (r,).
        filtered: states after each row's samples, shape (n, 6).
        r: working array, shape (6,).
        moved: working array, shape (6,).
        states: filled with the smoothed states, shape (n, 6).
        pull: filled with the likelihood's slope by a torque on each disc over the interval after
            each row, 1/Nm, shape (n, 2).
        misread: filled with its slope by an error of each reading, 1/rad or s/rad, shape
            (n, readings).
    """
    window = restarts.size - 1
    for i in range(N_FILTER):
        r[i] = 0.0
    for k in range(t.size - 1, -1, -1):
        row = path[k]
        for disc in range(2):
            if row.stuck[disc]:
                r[1 + disc] = 0.0
        for i in range(N_FILTER):
            states[k, i] = filtered[k, i]
            for j in range(N_FILTER):
                states[k, i] += row.P[i, j] * r[j]
        for e in range(misread.shape[1] - 1, -1, -1):
            score = row.white[e] * row.weight[e]
            for i in range(N_FILTER):
                score -= row.gain[e, i] * r[i]
            misread[k, e] = score
            if e < 2:
                r[3] += score
                if e == 0:
                    r[0] += score
            else:
                r[e - 1] += score
        if window >= 0 and restarts[window] == k:
            window -= 1
            for i in range(N_FILTER):
                r[i] = 0.0
            continue
        pull[k - 1, 0] = pull[k - 1, 1] = 0.0
        for j in range(N_FILTER):
            moved[j] = 0.0
            for i in range(N_STATE):
                moved[j] += row.F[i, j] * r[i]
        pull[k - 1, 0], pull[k - 1, 1] = moved[D_U], moved[D_L]
        dt = t[k] - t[k - 1]
        moved[D_U] += exp(-rate[0] * dt) * r[D_U]
        moved[D_L] += exp(-rate[1] * dt) * r[D_L]
        for i in range(N_FILTER):
            r[i] = moved[i]
