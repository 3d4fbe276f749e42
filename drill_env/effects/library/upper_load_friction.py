"""The axis rubs harder under the torque of its drive."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects.signal import response, size_of


@response
def upper_load_friction(p, e, s, out):
    """-sign(omega_u) coefficient |km u|."""
    out.size_u += e.q[0] * p.km * size_of(e, s, 0, s.u)


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="voltage",
    parameters=(amplitude("coefficient", "1", 0.05, most=5.0, signed=False),),
    kernel=upper_load_friction,
    switches=1,
    # With another motor constant it is a motor that gives more torque where it brakes.
    aliases=("drive_braking_loss",),
    axis_only=True,
)
