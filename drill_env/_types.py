"""Shared type aliases."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]
ComplexArray: TypeAlias = NDArray[np.complex128]
BoolArray: TypeAlias = NDArray[np.bool_]

PathLike: TypeAlias = str | Path

FrictionLaw: TypeAlias = Literal["humped", "stribeck", "coulomb"]
"""Lower-disc friction laws, see `drill_env.friction`."""

Method: TypeAlias = Literal["dop853", "dopri5"]
"""Explicit Runge-Kutta pairs between events: order 8(5,3) or order 5(4)."""

VoltageFunction: TypeAlias = Callable[[float], float]
"""Voltage in V as a function of time in s."""
