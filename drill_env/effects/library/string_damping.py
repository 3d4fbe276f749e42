"""The string has damping of its own."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude
from drill_env.effects.signal import response


@response
def string_damping(p, e, s, out):
    """-+damping (omega_u - omega_l)."""
    out.string += e.q[0] * (s.omega_u - s.omega_l)


EFFECT = Effect(
    component="string",
    equation="both",
    depends_on="omega_u - omega_l",
    parameters=(amplitude("damping", "Nm s/rad", 0.0005, most=HEAVIEST, signed=False),),
    kernel=string_damping,
    neighbours=("encoder_delay_lower", "quadratic_drag"),
)
