"""Something struck the lower disc at one moment."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import branch, response


@response
def torque_pulse(p, e, s, out):
    """torque from time to time + duration."""
    begun, ended = branch(e, s, 0, s.t - e.q[1]), branch(e, s, 1, s.t - e.q[1] - e.q[2])
    if begun > 0 and ended < 0:
        out.torque_l += e.q[0]


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="time",
    parameters=(
        amplitude("torque", "Nm", 0.005, most=HEAVIEST),
        shape("time", "s", tuple(2.0 * k for k in range(1, 30)), low=0.0, high=100000.0, form=0.0),
        shape("duration", "s", (0.2, 0.5, 1.5), low=0.01, high=100.0),
    ),
    kernel=torque_pulse,
    autonomous=False,
    switches=2,
    neighbours=("friction_step",),
)
