"""The motor gives less torque, or more, where it brakes than where it drives."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects.signal import branch, response


@response
def drive_braking_loss(p, e, s, out):
    """-km loss u where u omega_u < 0."""
    # The integrator itself ends a step where the disc stops or turns back.
    if branch(e, s, 0, s.u) * s.side_u < 0.0:
        out.volts -= e.q[0] * s.u


EFFECT = Effect(
    component="actuator",
    equation="upper",
    depends_on="voltage",
    parameters=(amplitude("loss", "1", 0.05, most=0.9),),
    kernel=drive_braking_loss,
    switches=1,
    neighbours=("upper_load_friction", "gain_asymmetry"),
)
