"""What of a free shape the rig's own parameters can do, which is left to these."""

from __future__ import annotations

from collections.abc import Callable, Collection

import numpy as np

from drill_env._types import FloatArray

Function = Callable[[FloatArray], FloatArray]

# Share of the largest direction from which another is none.
_ROUNDING = 1e-8

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
    what: str, name: str, knots: FloatArray, products: FloatArray, free: Collection[str]
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
        free: names of the rig's parameters that are fitted.

    Returns:
        None where they can do nothing of it.
    """
    constant = ((_CONSTANT[what], np.ones_like),) if what in _CONSTANT else ()
    own = (*constant, *_MORE.get((what, name), ()))
    # The twist at which the encoders agree is always free.
    there = [of(knots) for names, of in own if not names or any(n in free for n in names)]
    if not there:
        return None
    functions = np.column_stack([one / np.abs(one).max() for one in there if one.any()])
    weighed = functions.T @ products
    inverse = np.linalg.pinv(weighed @ functions, rcond=_ROUNDING, hermitian=True)
    return np.eye(len(knots)) - functions @ inverse @ weighed
