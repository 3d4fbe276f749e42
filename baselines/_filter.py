"""Compiled extended Kalman filter of the adaptive controllers.

State of one filter: twist, omega_u, omega_l, five past omega_u one control period apart, then
what is unknown of the plant (logarithms of factors, an offset in Nm, the delay in s). The
encoder's filter counts as pure delay, which it is well below its cutoff.
"""

from math import exp

from drill_env._jit import entry, kernel
from drill_env.friction.kernels import lower_sliding, lower_slope, upper_sliding

TWIST, OMEGA_U, OMEGA_L = 0, 1, 2
PAST = 3
N_PAST = 5
FREE = PAST + N_PAST
BU, OFFSET, FRICTION, KTHETA, JL, HUMP, DELAY = range(FREE, FREE + 7)
N_FREE = 7
N = FREE + N_FREE
N_TOP = 3 + N_FREE

SUBSTEPS = 5
_FRICTIONLESS_SPEED = 0.05


@entry
def set_plant(p, nominal, x):
    """Write the plant that the filter's state stands for into the record `p`."""
    scale = exp(x[FRICTION])
    p.bu = nominal.bu * exp(x[BU])
    p.Tsu = nominal.Tsu
    p.dTsu = nominal.dTsu + x[OFFSET]
    p.Tsl, p.bl = nominal.Tsl * scale, nominal.bl * scale
    p.T1, p.T2 = nominal.T1 * scale, nominal.T2 * scale * exp(x[HUMP])
    p.ktheta, p.Jl = nominal.ktheta * exp(x[KTHETA]), nominal.Jl * exp(x[JL])
    p.per_Jl = 1.0 / p.Jl


@kernel
def start_filter(p, nominal, x, cov, seen, spread, prior):
    """Begin anew from one speed: a plant as drawn from the prior, somewhere on a limit cycle."""
    for r in range(N):
        for c in range(N):
            cov[r, c] = 0.0
        x[r] = seen if 0 < r < FREE else 0.0
    for k in range(N_FREE):
        x[FREE + k] = prior[k, 0]
        cov[FREE + k, FREE + k] = prior[k, 1] ** 2
    set_plant(p, nominal, x)
    size = abs(seen)
    if size > _FRICTIONLESS_SPEED:
        x[TWIST] = (1.0 if seen > 0.0 else -1.0) * lower_sliding(p, size) / p.ktheta
    for r in range(FREE):
        cov[r, r] = 0.05**2
    cov[TWIST, TWIST] = (0.7 * spread * size + 0.05) ** 2
    cov[OMEGA_L, OMEGA_L] = (spread * size + 0.05) ** 2


@kernel
def is_sound(x, cov):
    """Whether a filter is still a filter: finite, with positive variances."""
    for r in range(N):
        if not (abs(x[r]) < 1e3 and 0.0 <= cov[r, r] < 1e4):
            return False
    return True


@kernel
def spread_step(p, top, h, damp, at, sign_u, sign_l):
    """One substep of the sensitivities; a disc that ends at rest (sign 0) forgets them.

    Columns: twist, speeds, then BU, OFFSET, FRICTION, KTHETA, JL, HUMP and DELAY.
    """
    twist, upper, speed, friction, slope = at
    torque = p.ktheta * twist
    hump = p.T2 * (2.0 / (1.0 + exp(-p.beta2 * speed)) - 1.0)
    for c in range(N_TOP):
        t, u, v = top[0, c], top[1, c], top[2, c]
        du = -(p.bu + sign_u * p.dbu) * u - p.ktheta * t
        dl = p.ktheta * t - slope * v
        if c == 3:
            du -= p.bu * upper
        elif c == 4:
            du -= 1.0
        elif c == 5:
            dl -= sign_l * friction
        elif c == 6:
            du -= torque
            dl += torque
        elif c == 7:
            dl -= torque - sign_l * friction
        elif c == 8:
            dl -= sign_l * hump
        top[0, c] = t + h * (u - v)
        top[1, c] = u + h * p.per_Ju * du if sign_u != 0.0 else 0.0
        top[2, c] = v + h * damp * p.per_Jl * dl if sign_l != 0.0 else 0.0


@entry
def predict_state(p, x, volts, period, top):
    """Carry twist and speeds over one period; `top` becomes d(new)/d(old, plant), (3, 3 + free).

    Coulomb friction is a projection: a disc that would change its direction in a substep stops.
    """
    h = period / SUBSTEPS
    for r in range(3):
        for c in range(N_TOP):
            top[r, c] = 1.0 if r == c else 0.0
    twist, upper, lower = x[0], x[1], x[2]
    for _ in range(SUBSTEPS):
        drive = p.km * volts - p.ktheta * twist
        sign_u = 1.0 if upper > 0.0 or (upper == 0.0 and drive - p.dTsu > 0.0) else -1.0
        if upper == 0.0 and abs(drive - p.dTsu) <= p.Tsu:
            new_u = 0.0
        else:
            new_u = upper + h * (drive - upper_sliding(p, sign_u, upper)) * p.per_Ju
            if new_u * sign_u < 0.0:
                new_u = 0.0
        torque = p.ktheta * twist
        sign_l = 1.0 if lower > 0.0 or (lower == 0.0 and torque > 0.0) else -1.0
        speed = sign_l * lower
        friction, slope = lower_sliding(p, speed), lower_slope(p, speed)
        # Linearly implicit, as friction near rest is stiff.
        damp = 1.0 / (1.0 + h * max(slope, 0.0) * p.per_Jl)
        if lower == 0.0 and abs(torque) <= p.Tsl:
            new_l = 0.0
        else:
            new_l = lower + h * (torque - sign_l * friction) * p.per_Jl * damp
            if new_l * sign_l < 0.0:
                new_l = 0.0
        turned = 0.0 if new_u == 0.0 else sign_u
        slid = 0.0 if new_l == 0.0 else sign_l
        spread_step(p, top, h, damp, (twist, upper, speed, friction, slope), turned, slid)
        twist += h * (upper - lower)
        upper, lower = new_u, new_l
    for k in range(PAST + N_PAST - 1, PAST, -1):
        x[k] = x[k - 1]
    x[PAST] = x[OMEGA_U]
    x[0], x[1], x[2] = twist, upper, lower


@entry
def predict_covariance(cov, top, process, rows):
    """P <- F P F' + Q, F being `top` over twist and speeds, a shift over the past omega_u."""
    for r in range(3):
        for c in range(N):
            total = 0.0
            for k in range(3):
                total += top[r, k] * cov[k, c]
            for k in range(N_FREE):
                total += top[r, 3 + k] * cov[FREE + k, c]
            rows[r, c] = total
    for r in range(3):
        for c in range(3):
            total = 0.0
            for k in range(3):
                total += rows[r, k] * top[c, k]
            for k in range(N_FREE):
                total += rows[r, FREE + k] * top[c, 3 + k]
            rows[3 + r, c] = total
    for r in range(PAST + N_PAST - 1, PAST, -1):
        for c in range(PAST + N_PAST - 1, PAST, -1):
            cov[r, c] = cov[r - 1, c - 1]
    for c in range(PAST + N_PAST - 1, PAST, -1):
        cov[PAST, c] = cov[c, PAST] = cov[OMEGA_U, c - 1]
    for r in range(PAST + N_PAST - 1, PAST, -1):
        for c in range(FREE, N):
            cov[r, c] = cov[c, r] = cov[r - 1, c]
    for c in range(FREE, N):
        cov[PAST, c] = cov[c, PAST] = cov[OMEGA_U, c]
    cov[PAST, PAST] = cov[OMEGA_U, OMEGA_U]
    for r in range(3):
        for c in range(3):
            cov[r, c] = rows[3 + r, c]
        cov[r, PAST] = cov[PAST, r] = rows[r, OMEGA_U]
        for c in range(PAST + 1, PAST + N_PAST):
            cov[r, c] = cov[c, r] = rows[r, c - 1]
        for c in range(FREE, N):
            cov[r, c] = cov[c, r] = rows[r, c]
    for k in range(N):
        cov[k, k] += process[k]


@entry
def correct(x, cov, seen, noise, period, lag, gain):
    """Measurement update with omega_u of `lag` + delay ago; returns innovation^2 / variance."""
    steps = (lag + x[DELAY]) / period
    steps = min(max(steps, 0.0), N_PAST - 1e-9)
    m = int(steps)
    w = steps - m
    near = OMEGA_U if m == 0 else PAST + m - 1
    far = PAST + m
    slope = (x[far] - x[near]) / period
    s = noise
    for r in range(N):
        gain[r] = (1.0 - w) * cov[r, near] + w * cov[r, far] + slope * cov[r, DELAY]
    s += (1.0 - w) * gain[near] + w * gain[far] + slope * gain[DELAY]
    miss = seen - (1.0 - w) * x[near] - w * x[far]
    per_s = 1.0 / s
    for r in range(N):
        x[r] += gain[r] * per_s * miss
        for c in range(r + 1):
            cov[r, c] -= gain[r] * gain[c] * per_s
            cov[c, r] = cov[r, c]
    return miss * miss * per_s
