"""What of a free shape the rig's own parameters can do, which is left to these."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np

from drill_env._types import FloatArray
from drill_env.friction import lower_curve
from drill_env.parameters import Rig
from drill_env.parameters.rig import LOWER_LAW

Function = Callable[[FloatArray], FloatArray]

# Of a parameter, for a difference; and what of a direction is left by that.
_STEP, _ROUNDING = 1e-5, 1e-8

# What is free for a rig's own function to be no shape, for a constant and beside that.
_CONSTANT: dict[str, tuple[str, ...]] = {
    "upper_torque": ("dTsu",), "upper_drive": ("km", "Ju"), "drive": ("km", "Ju"),
    "lower_friction": ("Tsl",), "upper_friction": ("Tsu",), "upper_damping": ("bu",),
    "string_stiffness": ("ktheta",),
}  # fmt: skip
_MORE: dict[tuple[str, str], tuple[tuple[tuple[str, ...], Function], ...]] = {
    ("upper_torque", "voltage"): ((("km", "Ju"), np.array),),
    ("upper_torque", "omega_u"): ((("Tsu",), np.sign), (("bu",), np.array), (("dbu",), np.abs)),
    ("upper_torque", "twist"): ((("ktheta",), np.array),),
    ("string_torque", "twist"): (((), np.ones_like), (("ktheta",), np.array)),
    ("string_torque", "omega_u - omega_l"): (((), np.ones_like),),
}  # fmt: skip


def without_own(
    what: str, name: str, knots: FloatArray, products: FloatArray, rig: Rig, free: Collection[str]
) -> FloatArray | None:
    """Projects values at knots on what no free parameter of the rig can do, shape (knots, knots).

    A shape is no function of those, as a smooth of an additive model sums to nothing over the data
    beside its constant (Wood, Generalized Additive Models, 2017). Along the smoothed motion, which
    knows the future, it would predict better than the rig's own, which it would cancel.

    Args:
        what: the shape is, as "upper_torque".
        name: of its coordinate.
        knots: values of that.
        products: of the functions of the knots, summed over all rows, shape (knots, knots).
        rig: whose friction law the lower disc has.
        free: names of the rig's parameters that are fitted.

    Returns:
        None where they can do nothing of it.
    """
    constant = ((_CONSTANT[what], np.ones_like),) if what in _CONSTANT else ()
    own = (*constant, *_MORE.get((what, name), ()))
    # The twist at which the encoders agree is always free.
    there = [of(knots) for names, of in own if not names or any(n in free for n in names)]
    if (what, name) == ("lower_torque", "omega_l"):
        there += [_by_the_law(rig, n, knots) for n in LOWER_LAW if n in free]
    if not there:
        return None
    functions = np.column_stack([one / np.abs(one).max() for one in there if one.any()])
    weighed = functions.T @ products
    inverse = np.linalg.pinv(weighed @ functions, rcond=_ROUNDING, hermitian=True)
    return np.eye(len(knots)) - functions @ inverse @ weighed


def _by_the_law(rig: Rig, name: str, omega: FloatArray) -> FloatArray:
    """Derivative of the lower friction torque by a parameter of its law, at some speeds."""
    value = getattr(rig, name)
    step = _STEP * max(abs(value), _STEP)
    moved = lower_curve(rig.replace(**{name: value + step}), omega)
    return np.sign(omega) * (moved - lower_curve(rig, omega)) / step
