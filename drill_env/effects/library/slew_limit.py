"""The amplifier changes its voltage no faster than a limit."""

from drill_env.effects._effect import Effect, shape
from drill_env.effects.signal import at_start, response

# So near, in V, it has arrived: a voltage that begins at 0 begins there but for rounding.
_REACHED = 1e-9
# Where no event is located it has arrived when so many seconds would do.
_SOON = 5e-3


@response
def slew_limit(p, e, s, out):
    """km (v - u), |dv/dt| <= rate, v follows u."""
    if s.first:
        e.z[0] = at_start(s)
    gap = s.u - e.z[0]
    if s.choose and s.first:
        e.side[0] = 0 if abs(gap) <= _REACHED else (1 if gap.real > 0.0 else -1)
    if s.choose and (e.side[0] * gap).real <= 0.0:
        e.side[0] = 1 if gap.real > 0.0 else -1
        if abs(gap) <= e.q[0].real * _SOON:
            e.side[0] = 0
            e.z[0] = s.u
            gap = 0.0 * gap
    if e.side[0] != 0:
        e.gap[0], e.next[0] = e.side[0] * gap, 0
        e.rate[0] = e.side[0] * e.q[0]
        out.volts -= gap
    else:
        e.rate[0] = s.u_rate
        if s.settle and abs(gap) <= _REACHED:
            e.z[0], gap = s.u, 0.0 * gap
        # It follows until the voltage jumps or runs away.
        jumped, rising = abs(gap) > _REACHED, s.u_rate.real > 0.0
        e.gap[0] = -1.0 if jumped else e.q[0] - abs(s.u_rate)
        e.next[0] = 1 if (gap.real > 0.0 if jumped else rising) else -1


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(
        shape(
            "rate",
            "V/s",
            (2.0, 4.0, 7.0, 10.0, 15.0, 20.0, 30.0, 45.0, 70.0, 100.0, 150.0, 250.0, 400.0),
            low=0.1,
            high=100000.0,
        ),
    ),
    kernel=slew_limit,
    passing=True,
    states=1,
    switches=1,
    neighbours=("actuator_lag", "input_delay"),
)
