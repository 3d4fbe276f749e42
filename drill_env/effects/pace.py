"""How fast inner states relax or ring, and how long a step may be for it."""

from math import sqrt

from drill_env._jit import entry, kernel
from drill_env.effects._along_ports import ask, set_motion

REACH = 4.8
"""Step times rate z up to which a step's dense output errs by less than what it begins with.

Of DOP853 on dy/dt = z y over the step, from 1, by 0.7. It errs by 10 at 6, where the step itself is
stable, and by 1e5 at 12, which the error estimate may let pass where all is smooth.
"""

MOVE = 1e-6
"""Share of an inner state by which it is moved to see what its rate does."""


@kernel
def fastest_rate(p, e, s, out, slopes):
    """Largest rate (1/s) at which the inner states relax or ring in the signal at hand.

    On the branches that they are on: across a jump from one to the other a slope is no rate.
    """
    ask(p, e, s, out)
    choose, s.choose = s.choose, 0
    for i in range(e.states):
        slopes[4, i] = e.rate[i]
    for j in range(e.states):
        kept = e.z[j]
        step = MOVE * (1.0 + abs(kept))
        e.z[j] = kept + step
        ask(p, e, s, out)
        e.z[j] = kept
        for i in range(e.states):
            slopes[i, j] = (e.rate[i] - slopes[4, i]) / step
    s.choose = choose
    fastest = 0.0
    for i in range(e.states):
        for j in range(e.states):
            # Of a pair that rings both slopes across together are the square of its frequency.
            fastest = max(fastest, sqrt(abs(slopes[i, j] * slopes[j, i])))
    return fastest


@entry
def slopes_when(p, e, s, out, speed, far, slopes):
    """The Jacobian of the rates where the discs turn at `speed` and half of it (rad/s), or rest.

    The inner states are moved by `far`; `slopes`, shape (5, MOST_STATES), begins with the Jacobian.
    """
    set_motion(p, s, speed, speed, 0.5 * speed, 0.0, 0.0)
    s.choose = s.first = 1
    ask(p, e, s, out)
    s.first = 0
    for j in range(e.states):
        e.z[j] += far
    fastest_rate(p, e, s, out, slopes)
