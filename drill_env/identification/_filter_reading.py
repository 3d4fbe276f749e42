"""Compiled rows of the measurement: which states a reading is made of."""

from drill_env._jit import inlined


@inlined
def reading_row(reading, relative):
    """Factors of the twist and of another state, and that state's place.

    Args:
        reading: 0 and 1 for theta_u and theta_l, 2 and 3 for omega_u and omega_l.
        relative: whether theta_l was made of theta_u and a twist that was measured. The filter
            then reads theta_l - theta_u, in which the upper sensor's noise is not.
    """
    if reading == 0:
        return 1.0, 1.0, 3
    if reading == 1:
        return (-1.0, 0.0, 3) if relative else (0.0, 1.0, 3)
    return 0.0, 1.0, reading - 1
