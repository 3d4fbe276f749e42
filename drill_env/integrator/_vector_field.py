"""Compiled vector field of a rig with effects whose discs both turn forward."""

from drill_env._jit import entry
from drill_env.integrator.records import SPARE
from drill_env.integrator.signatures import call_rates


@entry
def rates_along(p, run, work, code, volts, states, rates):
    """Rates in given states, both discs turning forward under constant voltages.

    Args:
        p: record of `PARAMETERS`.
        run: record of `RUN`.
        work: record of `WORK`, told of the effects.
        code: address of `rates_with_effects`.
        volts: V, shape (n,).
        states: twist, omega_u, omega_l, then the inner states, shape (n, 3 + inner).
        rates: filled with their rates, shape (n, 3 + inner).
    """
    run.mode[0] = run.mode[1] = 1
    run.mode[2] = 0
    work.coefficients = work.late = 1
    work.start, work.end = 0.0, 1.0
    work.signal.choose = 1
    for k in range(volts.size):
        work.piece[0] = work.past[0] = volts[k]
        for i in range(3):
            work.ys[SPARE, i] = states[k, i]
        work.ys[SPARE, 3] = 0.0
        for r in range(work.inner):
            work.zs[SPARE, r] = states[k, 3 + r]
        call_rates(code, p, run, work, SPARE, 0.0, volts[k])
        for i in range(3):
            rates[k, i] = work.k[SPARE, i]
        for r in range(work.inner):
            rates[k, 3 + r] = work.kz[SPARE, r]
