"""The brake wears with the way it has gone."""

from drill_env._jit import kernel
from drill_env.effects._effect import Effect, amplitude
from drill_env.effects._signal import against


@kernel
def wear(p, q, m, s, out):
    """wear s T_fl, ds/dt = |omega_l|."""
    m[0] += abs(s.omega_l) * s.dt
    out.torque_l += against(s.omega_l, s.net_l, -q[0] * m[0] * s.friction_l)


EFFECT = Effect(
    id="wear",
    component="lower",
    equation="lower",
    depends_on="distance",
    parameters=(amplitude("wear", "1/rad", 0.0005, most=1.0),),
    formula="wear s T_fl, ds/dt = |omega_l|",
    meaning="The brake wears with the way it has gone.",
    kernel=wear,
    neighbours=(
        "friction_drift",
        "friction_heating",
    ),
)
