"""The brake's friction drifts (it dries)."""

from drill_env.effects._effect import Effect, amplitude
from drill_env.effects.signal import response


@response
def friction_drift(p, e, s, out):
    """-drift t/(60 s) T_fl."""
    out.scale_l += e.q[0] * s.t / 60.0


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="time",
    parameters=(amplitude("drift", "1/min", 0.05, most=3.0),),
    kernel=friction_drift,
    autonomous=False,
    neighbours=("wear", "friction_heating", "friction_settling"),
)
