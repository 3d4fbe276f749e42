"""Compiled observer whose friction is set-valued, as in the rig itself."""

from drill_env._jit import entry

from ._filter import PAST, predict_state


@entry
def observe_rigs(fresh, twist, speed, last, x, p, period, gain, top):
    """Predict by a period with true stick, then correct by twist and the last period's omega_u.

    Args:
        fresh: whether the observers start from the measurements instead.
        twist: measured, rad, shape (n,).
        speed: measured omega_u (rad/s), late by a period, shape (n,).
        last: voltage of the last period (V), shape (n,).
        x: observer states, shape (n, PAST + N_PAST), advanced in place.
        p: record of the nominal rig.
        period: s.
        gain: of the correction, shape (3, 2).
        top: shape (3, N_TOP), overwritten.
    """
    for i in range(twist.size):
        xi = x[i]
        if fresh:
            xi[0] = twist[i]
            for k in range(1, xi.size):
                xi[k] = speed[i]
            continue
        predict_state(p, xi, last[i], period, top)
        miss, slip = twist[i] - xi[0], speed[i] - xi[PAST]
        for k in range(3):
            xi[k] += gain[k, 0] * miss + gain[k, 1] * slip
