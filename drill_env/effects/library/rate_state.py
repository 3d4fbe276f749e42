"""The brake remembers how long it has been in contact (rate and state)."""

from numpy import log

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import response

# Share of `speed` at which steady contact stops growing older.
_AT_REST = 0.05


@response
def rate_state(p, e, s, out):
    """-sign(omega_l) torque ln((1 + sharp psi)/(1 + sharp psi_s)), dpsi/dt = 1 - psi/psi_s."""
    # The steady part is a function of speed alone, which the brake's law has already.
    # A step that passes rest looks beyond it, where the speed along the contact is negative.
    speed = s.speed_l if s.speed_l.real >= 0.0 else -s.speed_l
    rest = e.q[1] / (speed + _AT_REST * e.q[2])
    if s.first:
        e.z[0] = rest
    sharp = e.q[2] / e.q[1]
    out.size_l += e.q[0] * log((1.0 + sharp * e.z[0]) / (1.0 + sharp * rest))
    e.rate[0] = 1.0 - e.z[0] / rest


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(
        amplitude("torque", "Nm", 0.001, most=HEAVIEST, signed=False),
        shape("distance", "rad", (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0), low=0.001, high=50.0),
        shape("speed", "rad/s", (0.1, 0.7), low=0.001, high=50.0),
    ),
    formula="-sign(omega_l) torque ln((1 + sharp psi)/(1 + sharp psi_s)), dpsi/dt = 1 - psi/psi_s, "
    "sharp = speed/distance, psi_s = distance/(|omega_l| + speed/20)",
    kernel=rate_state,
    states=1,
    neighbours=("friction_lag", "dwell_stiction"),
    source="Dieterich, J. Geophys. Res. 84 (1979); Ruina (1983)",
    at_rest=True,
)
