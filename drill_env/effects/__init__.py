"""Physics beyond the paper's rig: each effect one declaration, registered by being there.

An effect from outside is registered by `register`, or by an installed package that names it, or a
module with several, in its entry points of the group ``drill_env.effects``.
"""

from drill_env.effects._effect import Effect, EffectParameter, amplitude, effect, phase, shape
from drill_env.effects._registry import LIBRARY, load_installed, load_library, register
from drill_env.effects.signal import at_start, branch, clipped, size_of

load_library()
load_installed()

__all__ = [
    "LIBRARY", "Effect", "EffectParameter", "amplitude", "at_start", "branch", "clipped", "effect",
    "phase", "register", "shape", "size_of",
]  # fmt: skip
