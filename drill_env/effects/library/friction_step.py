"""The brake's friction changes at one moment."""

from drill_env.effects._effect import Effect, amplitude, shape
from drill_env.effects.signal import branch, response


@response
def friction_step(p, e, s, out):
    """-step T_fl after time."""
    if branch(e, s, 0, s.t - e.q[1]) > 0:
        out.scale_l += e.q[0]


EFFECT = Effect(
    id="friction_step",
    component="lower",
    equation="lower",
    depends_on="time",
    parameters=(
        amplitude("step", "1", 0.05, most=3.0),
        shape(
            "time",
            "s",
            (
                3.0,
                6.0,
                9.0,
                12.0,
                15.0,
                18.0,
                21.0,
                24.0,
                27.0,
                30.0,
                33.0,
                36.0,
                39.0,
                42.0,
                45.0,
                48.0,
                51.0,
                54.0,
                57.0,
            ),
            low=0.0,
            high=100000.0,
            form=0.0,
        ),
    ),
    formula="-step T_fl after time",
    meaning="The brake's friction changes at one moment.",
    kernel=friction_step,
    autonomous=False,
    switches=1,
    rigs_own_if_early=True,
    neighbours=(
        "friction_drift",
        "torque_pulse",
    ),
)
