"""A reading of the past, from the samples a sensor has remembered."""

from drill_env._jit import kernel

HISTORY = 300


@kernel
def delayed(m, s, theta, omega, delay):
    """Angle (rad) some time ago: cubic between remembered samples, at rest before the first.

    m[0:300] are angles, m[300:600] velocities, m[600] counts the samples.
    """
    count = int(m[600])
    m[count % HISTORY] = theta
    m[HISTORY + count % HISTORY] = omega
    m[600] = count + 1.0
    if s.dt <= 0.0 or delay <= 0.0:
        return theta
    back = delay / s.dt
    whole = int(back)
    near, far = count - whole, count - whole - 1
    if whole + 1 >= HISTORY or far < 0:
        first = m[0] if count < HISTORY else m[(count + 1) % HISTORY]
        return m[near % HISTORY] if near == 0 and back == whole else first
    share = back - whole
    a, b = far % HISTORY, near % HISTORY
    x = 1.0 - share
    slope_a, slope_b = m[HISTORY + a] * s.dt, m[HISTORY + b] * s.dt
    gap = m[b] - m[a]
    return m[a] + x * (
        slope_a + x * (3.0 * gap - 2.0 * slope_a - slope_b + x * (slope_a + slope_b - 2.0 * gap))
    )
