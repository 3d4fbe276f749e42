"""The brake's friction changes at one moment."""

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects.signal import branch, response


@response
def friction_step(p, e, s, out):
    """-step T_fl after time."""
    if branch(e, s, 0, s.t - e.q[1]) > 0:
        out.scale_l += e.q[0]


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="time",
    parameters=(
        amplitude("step", "1", 0.05, most=3.0),
        shape("time", "s", tuple(3.0 * k for k in range(1, 20)), low=0.0, high=100000.0, form=0.0),
    ),
    kernel=friction_step,
    autonomous=False,
    switches=1,
    rigs_own_if_early=True,
    neighbours=("friction_drift", "torque_pulse"),
)
