"""The upper disc's Coulomb friction follows a reversal late."""

from drill_env._jit import kernel
from drill_env.effects._effect import HEAVIEST, Effect, amplitude, shape
from drill_env.effects.signal import RESTING, clipped, response

# Of the lagging torque, which holds a disc at rest where all else holds it by less: the share of
# nothing is not told.
_LEAST = 0.01


@kernel
def held_share(p, e, s, out, torque):
    """What stands for the sign at rest: the share that is taken of all friction but the late one.

    It is 1 where the disc leaves: as the pull rises slowly the disc creeps and does not chatter.
    """
    motor = out.drive * p.km * (s.u + out.volts) + out.torque_u + s.other_u
    pull = motor - s.pull - out.string - p.dTsu * (1.0 + out.scale_u) - torque * e.z[0]
    level = p.Tsu * (1.0 + out.scale_u) + out.size_u - torque
    if level.real < _LEAST * torque.real:
        out.size_u += _LEAST * torque - level
        level = _LEAST * torque
    held = clipped(e, s, 0, pull, -level, level)
    return held / level if level.real > 0.0 else 0.0 * held


@response
def upper_friction_lag(p, e, s, out):
    """(sign(omega_u) - z) torque, time_constant dz/dt = sign(omega_u) - z."""
    torque = e.q[0]
    side = held_share(p, e, s, out, torque) if s.rest_u else 1.0 * s.side_u
    if s.first:
        # At rest nothing has built up.
        e.z[0] = 0.0 if abs(s.omega_u) < RESTING else s.side_u
    out.size_u -= torque
    out.torque_u -= torque * e.z[0]
    e.rate[0] = (side - e.z[0]) / e.q[1]


EFFECT = Effect(
    component="upper",
    equation="upper",
    depends_on="omega_u",
    parameters=(
        amplitude("torque", "Nm", 0.1, most=HEAVIEST, signed=False),
        shape(
            "time_constant", "s", (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1), low=1e-4, high=5.0
        ),
    ),
    kernel=upper_friction_lag,
    states=1,
    last=True,
    switches=2,
    neighbours=("upper_presliding", "gear_compliance", "actuator_lag"),
    axis_only=True,
    source="Hess and Soom, J. Tribology 112 (1990)",
    at_rest=True,
)
