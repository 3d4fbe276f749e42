"""The brake remembers how long it has been in contact (rate and state)."""

from math import exp, log

from drill_env._jit import kernel
from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects._signal import against


@kernel
def rate_state(p, q, m, s, out):
    """-sign(omega_l) torque ln(psi z), dpsi/dt = 1 - psi z, z = (|omega_l| + 0.01)/distance."""
    speed = abs(s.omega_l) + 0.01
    rest = q[1] / speed
    if s.first:
        m[0] = rest
    m[0] = rest + (m[0] - rest) * exp(-s.dt / rest)
    extra = q[0] * log(m[0] / rest)
    out.torque_l += against(s.omega_l, s.net_l, extra)


EFFECT = Effect(
    id="rate_state",
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(
        amplitude("torque", "Nm", 0.001, most=1.0),
        shape(
            "distance",
            "rad",
            (
                0.02,
                0.05,
                0.1,
                0.2,
                0.5,
                1.0,
                2.0,
            ),
            low=0.001,
            high=50.0,
        ),
    ),
    formula="-sign(omega_l) torque ln(psi z), dpsi/dt = 1 - psi z, z = (|omega_l| + 0.01)/distance",
    meaning="The brake remembers how long it has been in contact (rate and state).",
    kernel=rate_state,
    neighbours=(
        "friction_lag",
        "dwell_stiction",
    ),
    source="Dieterich, J. Geophys. Res. 84 (1979); Ruina (1983)",
)
