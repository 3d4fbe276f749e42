"""The motor gets weaker, or stronger, after the start and settles."""

from numpy import exp

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def motor_fade(p, e, s, out):
    """-km loss (1 - e^(-t/time_constant)) u."""
    out.volts -= e.q[0] * (1.0 - exp(-s.t / e.q[1])) * s.u


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="time",
    parameters=(
        amplitude("loss", "1", 0.05, most=0.9),
        shape("time_constant", "s", (3.0, 6.0, 12.0, 25.0, 50.0, 100.0), low=0.5, high=1000.0),
    ),
    kernel=motor_fade,
    autonomous=False,
    neighbours=("motor_heating", "friction_warmup"),
    rigs_own_if_early=True,
)
