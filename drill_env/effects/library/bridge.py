"""The bridge between the supply and the motor, where it is switched off."""

from drill_env.effects._effect import amplitude, effect


@effect(
    "actuator",
    "voltage",
    "The bridge is off at u = 0, so that the motor coasts: no current, and none of its braking.",
    amplitude("back_emf", "V s/rad", 0.2, most=1e4, signed=False),
    neighbours=("drive_braking_loss", "amplifier_deadzone"),
)
def coasting(p, e, s, out):
    """km back_emf omega_u where u = 0: the part of bu omega_u that the current makes."""
    if s.u.real == 0.0:
        out.volts += e.q[0] * s.omega_u
