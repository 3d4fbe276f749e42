"""The brake's friction falls, or grows, after the start and settles."""

from numpy import exp

from drill_env.effects._effect import Effect, EffectParameter, shape
from drill_env.effects.signal import response


@response
def friction_settling(p, e, s, out):
    """change (1 - e^(-t/time_constant)) T_fl."""
    out.scale_l -= e.q[0] * (1.0 - exp(-s.t / e.q[1]))


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="time",
    parameters=(
        # Friction may grow to several times its size, but not fall below nothing.
        EffectParameter("change", "1", "amplitude", (0.05,), -3.0, 0.95),
        shape("time_constant", "s", (3.0, 6.0, 12.0, 25.0, 50.0, 100.0), low=0.5, high=1000.0),
    ),
    kernel=friction_settling,
    autonomous=False,
    neighbours=("friction_drift", "friction_heating", "wear"),
    rigs_own_if_early=True,
)
