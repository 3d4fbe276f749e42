"""The record of parameters that the compiled kernels read."""

from typing import Any

import numpy as np

NAMES = (
    "km",
    "Ju",
    "Tsu",
    "dTsu",
    "bu",
    "dbu",
    "Jl",
    "ktheta",
    "Tsl",
    "T1",
    "T2",
    "beta1",
    "beta2",
    "bl",
)
"""Order of the parameters in the columns of the sensitivities."""

KM, JU, TSU, DTSU, BU, DBU, JL, KTHETA, TSL, T1, T2, BETA1, BETA2, BL = range(len(NAMES))
N_PARAMETERS = len(NAMES)

LAWS = ("humped", "stribeck", "coulomb")
HUMPED, STRIBECK, COULOMB = range(len(LAWS))

# The reciprocals are stored because a division costs a quarter of the friction law.
_OTHERS = ("load_u", "load_l", "per_Ju", "per_Jl", "clamp_low", "clamp_high")
_FIELDS: list[tuple[str, Any]] = [(name, "f8") for name in (*NAMES, *_OTHERS)]
PARAMETERS = np.dtype([*_FIELDS, ("law", "i8"), ("clamp", "i8"), ("locked", "i8")], align=True)
