"""Above some speed the string whirls and drags."""

from drill_env._jit import kernel
from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects._signal import sign


@kernel
def whirl_drag(p, q, m, s, out):
    """-sign(omega_l) coefficient max(|omega_l| - speed, 0)^2."""
    over = max(abs(s.omega_l) - q[1], 0.0)
    out.torque_l -= sign(s.omega_l) * q[0] * over * over


EFFECT = Effect(
    id="whirl_drag",
    component="lower",
    equation="lower",
    depends_on="omega_l",
    parameters=(
        amplitude("coefficient", "Nm s^2/rad^2", 0.0001, most=1.0),
        shape(
            "speed",
            "rad/s",
            (
                2.0,
                3.0,
                4.0,
                5.0,
                6.0,
                7.0,
                8.0,
                9.0,
                10.0,
                12.0,
            ),
            low=0.2,
            high=100.0,
        ),
    ),
    formula="-sign(omega_l) coefficient max(|omega_l| - speed, 0)^2",
    meaning="Above some speed the string whirls and drags.",
    kernel=whirl_drag,
    neighbours=("quadratic_drag",),
)
