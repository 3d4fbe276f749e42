"""The string's torque depends on its past (Bouc-Wen)."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects._signal import response


@response
def string_hysteresis(p, q, m, s, out):
    """-+torque z, width dz/dt = dtwist/dt - (|dtwist/dt| z + dtwist/dt |z|)/2."""
    rate = s.omega_u - s.omega_l
    h = s.dt / 5.0 / q[1]
    total = 0.0
    for _ in range(5):
        before = m[0]
        m[0] += h * (rate - 0.5 * (abs(rate) * m[0] + rate * abs(m[0])))
        total += 0.5 * (before + m[0])
    torque = q[0] * total / 5.0

    out.torque_l += torque
    out.torque_u -= torque


EFFECT = Effect(
    id="string_hysteresis",
    component="string",
    equation="both",
    depends_on="twist",
    parameters=(
        amplitude("torque", "Nm", 0.002, most=HEAVIEST, signed=False),
        shape(
            "width",
            "rad",
            (
                0.05,
                0.1,
                0.2,
                0.4,
                0.8,
                1.6,
                3.0,
            ),
            low=0.005,
            high=50.0,
        ),
    ),
    formula="-+torque z, width dz/dt = dtwist/dt - (|dtwist/dt| z + dtwist/dt |z|)/2",
    meaning="The string's torque depends on its past (Bouc-Wen).",
    kernel=string_hysteresis,
    neighbours=(
        "string_creep",
        "presliding",
    ),
    source="Wen, J. Eng. Mech. 102 (1976)",
)
