"""The string's torque depends on its past (Bouc-Wen)."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import response, size_of


@response
def string_hysteresis(p, e, s, out):
    """-+torque z, width dz/dt = dtwist/dt - (|dtwist/dt| z + dtwist/dt |z|)/2."""
    if s.first:
        e.z[0] = 0.0
    rate, z = s.omega_u - s.omega_l, e.z[0]
    out.string += e.q[0] * z
    lost = size_of(e, s, 0, rate) * z + rate * size_of(e, s, 1, z)
    e.rate[0] = (rate - 0.5 * lost) / e.q[1]


EFFECT = Effect(
    component="string",
    equation="both",
    depends_on="twist",
    parameters=(
        amplitude("torque", "Nm", 0.002, most=HEAVIEST, signed=False),
        shape("width", "rad", (0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.0), low=0.005, high=50.0),
    ),
    kernel=string_hysteresis,
    autonomous=False,
    states=1,
    switches=2,
    neighbours=("string_creep", "presliding"),
    source="Wen, J. Eng. Mech. 102 (1976)",
)
