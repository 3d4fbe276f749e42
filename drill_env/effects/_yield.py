"""Elastic yielding before sliding, after Dahl."""

from drill_env._jit import kernel
from drill_env.effects.signal import branch

# What is left of yielding below this is none: under the tolerance of any step that a rig's motion
# needs, while steps that followed it on would stay as short as the yielding once was.
_NONE_LEFT = 1e-10


@kernel
def give_way(e, s, rest, omega, side, distance):
    """Rate of what has yielded, `e.z[0]`, a share from -1 to 1: omega (1 - side z)/distance."""
    if rest:
        e.rate[0] = 0.0 * omega
        return
    left = 1.0 - side * e.z[0]
    if branch(e, s, 0, _NONE_LEFT - left) > 0:
        e.rate[0] = 0.0 * omega
        # The switch that closes may be another effect's, where the disc has just turned back.
        if s.settle and left.real < 10.0 * _NONE_LEFT:
            e.z[0] = side
    else:
        e.rate[0] = omega * left / distance
