"""Bodies that a disc drags along by friction: an untuned damper, a fluid that is entrained."""

from functools import partial

from drill_env._jit import kernel
from drill_env.effects._effect import amplitude, effect, shape
from drill_env.effects.library.upper_torques import same_body

_SOURCE = "Den Hartog, Mechanical Vibrations, 4th ed. 1956 (untuned viscous damper)"
_NUMBERS = (
    amplitude("share", "1", 0.05, most=5.0, signed=False),
    shape(
        "time_constant", "s", (0.01, 0.02, 0.04, 0.08, 0.15, 0.3, 0.6, 1.2, 2.5, 5.0),
        low=0.001, high=100.0,
    ),
)  # fmt: skip


@kernel
def dragged(e, s, omega, inertia):
    """Torque (Nm) of the body on a disc of `inertia` that turns at `omega`; e.z[0] is its speed."""
    if s.first:
        e.z[0] = omega
    e.rate[0] = (omega - e.z[0]) / e.q[1]
    return -e.q[0] * inertia * e.rate[0]


@effect(
    "upper",
    "omega_u",
    "The upper disc drags a body along by viscous friction, such as a damper's mass.",
    *_NUMBERS,
    formula="-share Ju dw/dt, time_constant dw/dt = omega_u - w",
    states=1,
    rigs_own_if_slow=True,
    neighbours=("upper_resonator", "upper_viscous", "upper_friction_lag"),
    heavier=partial(same_body, share=0),
    source=_SOURCE,
)
def upper_viscous_damper(p, e, s, out):
    """-share Ju dw/dt, time_constant dw/dt = omega_u - w."""
    out.torque_u += dragged(e, s, s.omega_u, p.Ju)


@effect(
    "lower",
    "omega_l",
    "The lower disc drags a body along by viscous friction, such as a fluid around it.",
    *_NUMBERS,
    formula="-share Jl dw/dt, time_constant dw/dt = omega_l - w",
    states=1,
    rigs_own_if_slow=True,
    neighbours=("lower_resonator", "friction_lag", "quadratic_drag"),
    heavier=partial(same_body, share=0),
    source=_SOURCE,
)
def lower_viscous_damper(p, e, s, out):
    """-share Jl dw/dt, time_constant dw/dt = omega_l - w."""
    out.torque_l += dragged(e, s, s.omega_l, p.Jl)
