"""Something struck the lower disc at one moment."""

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import branch, response


@response
def torque_pulse(p, e, s, out):
    """torque from time to time + duration."""
    begun, ended = branch(e, s, 0, s.t - e.q[1]), branch(e, s, 1, s.t - e.q[1] - e.q[2])
    if begun > 0 and ended < 0:
        out.torque_l += e.q[0]


EFFECT = Effect(
    id="torque_pulse",
    component="lower",
    equation="lower",
    depends_on="time",
    parameters=(
        amplitude("torque", "Nm", 0.005, most=HEAVIEST),
        shape(
            "time",
            "s",
            (
                2.0,
                4.0,
                6.0,
                8.0,
                10.0,
                12.0,
                14.0,
                16.0,
                18.0,
                20.0,
                22.0,
                24.0,
                26.0,
                28.0,
                30.0,
                32.0,
                34.0,
                36.0,
                38.0,
                40.0,
                42.0,
                44.0,
                46.0,
                48.0,
                50.0,
                52.0,
                54.0,
                56.0,
                58.0,
            ),
            low=0.0,
            high=100000.0,
            form=0.0,
        ),
        shape(
            "duration",
            "s",
            (
                0.2,
                0.5,
                1.5,
            ),
            low=0.01,
            high=100.0,
        ),
    ),
    formula="torque from time to time + duration",
    meaning="Something struck the lower disc at one moment.",
    kernel=torque_pulse,
    autonomous=False,
    switches=2,
    neighbours=("friction_step",),
)
