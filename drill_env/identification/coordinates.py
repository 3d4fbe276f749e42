"""Coordinates in which the likelihood of the rig's parameters is nearly quadratic."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.parameters import SYMBOLS, Rig

POSITIVE = frozenset({"km", "Ju", "Tsu", "bu", "Jl", "ktheta", "Tsl", "beta1", "beta2"})
_LOWER = frozenset({"Jl", "Tsl", "T1", "T2", "bl"})
_STEP = 1e-6
_LOG_REACH = 0.5
# Share of the largest eigenvalue: some forty roundings of a double.
_ROUNDING = 1e-14


@dataclass(frozen=True, slots=True)
class Coordinates:
    """A smooth one-to-one map between the free parameters of a rig and a vector.

    Positive parameters are logarithms. The lower disc's torques are taken relative to the
    string's stiffness, which only the weak reaction on the upper disc tells. The slow term of
    the humped law is (slope at rest, cubic coefficient, log beta2): in T2, beta2 and bl its
    likelihood is a long bent valley.

    Args:
        base: rig that holds the fixed parameters.
        free: names of the free ones, in the order of `SYMBOLS`.
    """

    base: Rig
    free: tuple[str, ...]

    @property
    def has_bend(self) -> bool:
        """Whether the slow term has its own coordinates."""
        return self.base.friction == "humped" and {"T2", "beta2", "bl"} <= set(self.free)

    def vector(self, rig: Rig) -> FloatArray:
        """Coordinates of a rig, shape (len(free),)."""
        values = {name: getattr(rig, name) for name in self.free}
        if self.has_bend:
            t2, beta2 = rig.T2, rig.beta2
            values |= {"bl": rig.bl + 0.5 * t2 * beta2, "T2": t2 * beta2**3}
        if "ktheta" in self.free:
            values |= {n: values[n] / rig.ktheta for n in _LOWER & set(self.free)}
        for name in POSITIVE & set(values):
            if not values[name] > 0.0:
                raise InputError(
                    f"rig parameter {name} is {getattr(rig, name)} and is estimated by its "
                    "logarithm: start from a value greater than 0, or hold it: "
                    f"--fix {name}={getattr(rig, name):g}"
                )
        return np.array([math.log(v) if n in POSITIVE else v for n, v in values.items()])

    def rig(self, vector: FloatArray) -> Rig:
        """The rig at coordinates.

        Raises:
            InputError: the parameters there make no rig.
        """
        return self.base.replace(**self.values(vector))

    def values(self, vector: FloatArray) -> dict[str, float]:
        """Values of the free parameters at coordinates."""
        return dict(zip(self.free, self.many_values(vector[None])[0].tolist(), strict=True))

    def many_values(self, vectors: FloatArray) -> FloatArray:
        """Values of the free parameters at many coordinates, both of shape (n, free)."""
        values = {
            name: np.exp(vectors[:, i]) if name in POSITIVE else vectors[:, i]
            for i, name in enumerate(self.free)
        }
        if "ktheta" in values:
            values |= {n: values[n] * values["ktheta"] for n in _LOWER & set(self.free)}
        if self.has_bend:
            values["T2"] = values["T2"] / values["beta2"] ** 3
            values["bl"] = values["bl"] - 0.5 * values["T2"] * values["beta2"]
        return np.column_stack([values[name] for name in self.free])

    def reach(self, vector: FloatArray) -> FloatArray:
        """How far a coordinate may sensibly move at once, shape (free,)."""
        sizes = np.maximum(np.abs(vector), np.abs(self.vector(self.base)))
        # Asymmetries pass through zero; their symmetric part is their scale.
        scales = {"dTsu": 0.3 * self.base.Tsu, "dbu": 0.3 * self.base.bu}
        floors = [max(scales.get(name, 0.0), 1e-6) for name in self.free]
        logs = [name in POSITIVE for name in self.free]
        return np.where(logs, _LOG_REACH, np.maximum(sizes, floors))

    def jacobian(self, vector: FloatArray) -> FloatArray:
        """Derivatives of the free parameters by the coordinates, shape (free, free)."""
        # A coordinate of size 1e-4 (the cubic coefficient) needs a step of its own size.
        moves = np.diag(_STEP * self.reach(vector))
        above, below = self.many_values(vector + moves), self.many_values(vector - moves)
        return ((above - below) / (2.0 * np.diag(moves)[:, None])).T


def inverse(symmetric: FloatArray) -> FloatArray:
    """Inverse of an information or covariance matrix, 0 along what it does not tell at all."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(symmetric), 1e-300))
    values, vectors = np.linalg.eigh(symmetric * np.outer(scale, scale))
    # Rounding makes what is not told negative as often as positive, and no variance is.
    told = values > _ROUNDING * values[-1]
    kept = vectors[:, told]
    scaled = (kept / values[told]) @ kept.T
    return np.asarray(scaled * np.outer(scale, scale), dtype=np.float64)


def solved(symmetric: FloatArray, right: FloatArray) -> FloatArray:
    """Solve with an information matrix; along what it does not tell at all the answer is 0.

    Args:
        symmetric: shape (n, n).
        right: shape (n,) or (n, m).

    Returns:
        Shape of `right`; NaN where something is not finite.
    """
    try:
        return np.asarray(np.linalg.solve(symmetric, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        if np.isfinite(symmetric).all():
            return np.asarray(inverse(symmetric) @ right, dtype=np.float64)
        return np.full(right.shape, np.nan)


def free_names(
    free: Sequence[str] | None, rig: Rig, fixed: Mapping[str, float], *, scaled: bool = False
) -> tuple[str, ...]:
    """Names of the parameters to estimate, in the order of `SYMBOLS`.

    Args:
        free: their names; None for all that the rig's law has.
        rig: its law and number of inertias.
        fixed: parameters that are given.
        scaled: whether the recordings tell the scale of torque.

    Raises:
        InputError: an unknown name, nothing free, or no given parameter for the scale of torque.
    """
    for name in (*(free or ()), *fixed):
        if name not in SYMBOLS:
            raise InputError(f"parameter {name!r} is not one of {', '.join(SYMBOLS)}")
    known = active_names(rig)
    wanted = known if free is None else set(free)
    idle = sorted(wanted - known)
    if idle:
        raise InputError(f"{', '.join(idle)}: no part of this rig, leave it out of the free ones")
    names = tuple(n for n in SYMBOLS if n in wanted and n not in fixed)
    if not names:
        raise InputError("no parameter is free: name fewer fixed ones")
    torques = known - {"beta1", "beta2"}
    if torques <= set(names) and not scaled:
        raise InputError(
            "volts and angles do not show the scale of torque: give one parameter, such as "
            "Ju or km (--fix Ju=VALUE); the ratios to it are what the recordings tell"
        )
    return names


def active_names(rig: Rig) -> set[str]:
    """The parameters that the rig's law and number of inertias use."""
    upper = {"km", "Ju", "Tsu", "dTsu", "bu", "dbu"}
    if rig.inertias == 1:
        return upper
    lower = {"Jl", "ktheta", "Tsl", "bl"}
    if rig.friction != "coulomb":
        lower |= {"T1", "beta1"}
    if rig.friction == "humped":
        lower |= {"T2", "beta2"}
    return upper | lower
