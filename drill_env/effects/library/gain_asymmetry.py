"""The drive is stronger in one direction."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects.signal import response, size_of


@response
def gain_asymmetry(p, e, s, out):
    """km asymmetry |u|."""
    out.volts += e.q[0] * size_of(e, s, 0, s.u)


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(amplitude("asymmetry", "1", 0.02, most=0.9),),
    kernel=gain_asymmetry,
    switches=1,
    neighbours=("upper_quadratic_drag",),
)
