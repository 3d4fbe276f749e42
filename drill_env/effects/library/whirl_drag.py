"""Near a critical speed the string whirls, and its orbit drags."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def whirl_drag(p, e, s, out):
    """-torque r^5/((1 - r^2)^2 + (2 damping r)^2), r = omega_l/speed."""
    r = s.omega_l / e.q[1]
    square = r * r
    apart, loss = 1.0 - square, 2.0 * e.q[2] * r
    out.torque_l -= e.q[0] * r * square * square / (apart * apart + loss * loss)


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(
        amplitude("torque", "Nm", 0.0005, most=HEAVIEST, signed=False),
        shape("speed", "rad/s", (3.0, 5.0, 6.5, 8.0, 10.0, 13.0), low=0.2, high=100.0),
        shape("damping", "1", (0.15, 0.4), low=0.02, high=2.0),
    ),
    kernel=whirl_drag,
    neighbours=("quadratic_drag",),
    source="Jeffcott rotor, drag with the square of the orbit; Jansen, J. Sound Vib. 147 (1991)",
)
