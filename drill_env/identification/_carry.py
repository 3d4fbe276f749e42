"""Compiled passes over the filter's record: errors carried forward, the likelihood backward."""

from math import exp

from drill_env._jit import entry, inlined
from drill_env.identification._filter_reading import reading_row
from drill_env.identification._filter_state import D_L, D_U, N_FILTER
from drill_env.integrator.records import N_STATE


@entry
def carry(path, t, rate, restarts, relative, loads, errors, state, out):
    """Whitened slopes of the innovations by the sizes of many known torques and sensor errors.

    Args:
        path: records of `path_type`, shape (n,).
        t: times in s, shape (n,).
        rate: reciprocals of the latent torques' correlation times, 1/s, shape (2,).
        restarts: rows at which the filter starts anew, ascending, the first 0; shape (r,).
        relative: see `reading_row`.
        loads: torques on both discs over the interval after each row, Nm, shape (n, 2, m).
        errors: errors of the readings, rad or rad/s, shape (n, readings, m), or no rows.
        state: working array, shape (6, m).
        out: zeros; filled with the slopes of the predicted readings over the innovations'
            standard deviations, shape (n, readings, m).
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
            step(row, exp(-rate[0] * dt), exp(-rate[1] * dt), loads[k - 1], state)
        for e in range(out.shape[1]):
            if row.weight[e] == 0.0:
                continue
            if errors.shape[0] > 0:
                for c in range(count):
                    out[k, e, c] = errors[k, e, c]
                if e == 1 and relative:
                    for c in range(count):
                        out[k, 1, c] -= errors[k, 0, c]
            read(row, e, relative, state, out[k, e])
        for disc in range(2):
            if row.stuck[disc]:
                for c in range(count):
                    state[1 + disc, c] = 0.0


@inlined
def step(row, decay_u, decay_l, loads, state):
    """Errors of the filtered state over one interval under held torques."""
    a0, a1, a2 = row.F[0, 0], row.F[0, 1], row.F[0, 2]
    a3, a4, a5 = row.F[0, 3], row.F[0, D_U], row.F[0, D_L]
    b0, b1, b2 = row.F[1, 0], row.F[1, 1], row.F[1, 2]
    b3, b4, b5 = row.F[1, 3], row.F[1, D_U], row.F[1, D_L]
    c0, c1, c2 = row.F[2, 0], row.F[2, 1], row.F[2, 2]
    c3, c4, c5 = row.F[2, 3], row.F[2, D_U], row.F[2, D_L]
    d0, d1, d2 = row.F[3, 0], row.F[3, 1], row.F[3, 2]
    d3, d4, d5 = row.F[3, 3], row.F[3, D_U], row.F[3, D_L]
    # One loop over the columns, with all transitions in registers.
    for c in range(state.shape[1]):
        x, v, w, y = state[0, c], state[1, c], state[2, c], state[3, c]
        du, dl = state[D_U, c] + loads[0, c], state[D_L, c] + loads[1, c]
        state[0, c] = a0 * x + a1 * v + a2 * w + a3 * y + a4 * du + a5 * dl
        state[1, c] = b0 * x + b1 * v + b2 * w + b3 * y + b4 * du + b5 * dl
        state[2, c] = c0 * x + c1 * v + c2 * w + c3 * y + c4 * du + c5 * dl
        state[3, c] = d0 * x + d1 * v + d2 * w + d3 * y + d4 * du + d5 * dl
        state[D_U, c] *= decay_u
        state[D_L, c] *= decay_l


@inlined
def read(row, reading, relative, state, out):
    """Errors of the filtered state after one reading, whose own errors are in `out`."""
    a, b, place = reading_row(reading, relative)
    weight, gain = row.weight[reading], row.gain[reading]
    g0, g1, g2, g3, g4, g5 = gain[0], gain[1], gain[2], gain[3], gain[4], gain[5]
    for c in range(state.shape[1]):
        wrong = a * state[0, c] + b * state[place, c] + out[c]
        out[c] = wrong * weight
        state[0, c] -= g0 * wrong
        state[1, c] -= g1 * wrong
        state[2, c] -= g2 * wrong
        state[3, c] -= g3 * wrong
        state[D_U, c] -= g4 * wrong
        state[D_L, c] -= g5 * wrong


@entry
def smooth(path, t, rate, restarts, relative, filtered, r, moved, states, pull, misread):
    """Smooth the states (Bryson and Frazier) and find where the likelihood pulls.

    Args:
        path: records of `path_type`, shape (n,).
        t: times in s, shape (n,).
        rate: reciprocals of the latent torques' correlation times, 1/s, shape (2,).
        restarts: rows at which the filter starts anew, ascending, the first 0; shape (r,).
        relative: see `reading_row`.
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
            a, b, place = reading_row(e, relative)
            r[0] += a * score
            r[place] += b * score
        if relative:
            misread[k, 0] -= misread[k, 1]
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
