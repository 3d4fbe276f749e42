"""The brake sticks harder the longer it rests."""

from numpy import exp

from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import response


@response
def dwell_stiction(p, e, s, out):
    """holds torque (1 - e^(-dwell/time_constant)) more, until it slips."""
    if s.rest_l:
        out.size_l += e.q[0] * (1.0 - exp(-s.dwell_l / e.q[1]))


EFFECT = Effect(
    component="lower",
    equation="lower",
    depends_on="dwell time",
    parameters=(
        amplitude("torque", "Nm", 0.003, most=HEAVIEST, signed=False),
        shape("time_constant", "s", (0.2, 0.7, 2.5, 9.0), low=0.005, high=1000.0),
    ),
    kernel=dwell_stiction,
    neighbours=("lower_stribeck", "rate_state"),
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, Automatica 30 (1994)",
    at_rest=True,
    only_at_rest=True,
)
