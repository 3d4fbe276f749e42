"""The rig: one frozen structure of parameters that all physics reads."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

import numpy as np

from drill_env._checks import real
from drill_env._errors import InputError
from drill_env._types import FrictionLaw
from drill_env.parameters.record import LAWS, NAMES, PARAMETERS


def _symbol(unit: str, source: str, meaning: str) -> dict[str, str]:
    return {"unit": unit, "source": source, "meaning": meaning}


@dataclass(frozen=True, slots=True)
class Rig:
    """Parameters of the experimental drill-string set-up, SI units.

    The defaults are the printed estimates of Mihajlovic et al. (2004), equations (6)
    and (8). Every field carries its unit, source and meaning in its metadata.

    The lower-disc friction laws share the keys of equation (7):

    - ``humped``: T_l = Tsl + T1 (1 - 2/(1+e^(beta1 w))) + T2 (1 - 2/(1+e^(beta2 w))) + bl w
    - ``stribeck``: T_l = Tsl + T1 (1 - e^(-beta1 w)) + bl w with T1 <= 0, so Tsl + T1 is
      the Coulomb level and 1/beta1 the Stribeck velocity; T2 and beta2 are not used
    - ``coulomb``: T_l = Tsl + bl w

    Args:
        clamp: replace T_l(w) by max(T_l(w), 0), so that equation (3) holds.
        inertias: 2 for the whole rig, 1 for the upper disc alone (stage 1).
        effects: extra physics of a rig file, see docs/effects.md; validation refuses it.

    Raises:
        InputError: a value is not finite, has the wrong sign or does not fit the law.
    """

    km: float = field(
        default=3.5693, metadata=_symbol("Nm/V", "eq. (6)", "motor constant, torque per volt")
    )
    Ju: float = field(
        default=0.4765, metadata=_symbol("kg m^2/rad", "eq. (6)", "upper moment of inertia")
    )
    Tsu: float = field(
        default=0.3212, metadata=_symbol("Nm", "eq. (6)", "upper static friction, mean")
    )
    dTsu: float = field(
        default=0.0095, metadata=_symbol("Nm", "eq. (6)", "upper static friction, asymmetry")
    )
    bu: float = field(
        default=1.9833, metadata=_symbol("Nm s/rad", "eq. (6)", "upper viscous friction, mean")
    )
    dbu: float = field(
        default=-0.0167,
        metadata=_symbol("Nm s/rad", "eq. (6)", "upper viscous friction, asymmetry"),
    )
    Jl: float = field(
        default=0.0326, metadata=_symbol("kg m^2/rad", "eq. (8)", "lower moment of inertia")
    )
    ktheta: float = field(
        default=0.078, metadata=_symbol("Nm/rad", "eq. (8)", "torsional stiffness of the string")
    )
    Tsl: float = field(default=0.0094, metadata=_symbol("Nm", "eq. (8)", "lower static friction"))
    T1: float = field(
        default=0.0826, metadata=_symbol("Nm", "eq. (8)", "height of the first friction term")
    )
    T2: float = field(
        default=-0.291, metadata=_symbol("Nm", "eq. (8)", "height of the second friction term")
    )
    beta1: float = field(
        default=6.3598, metadata=_symbol("s/rad", "eq. (8)", "steepness of the first term")
    )
    beta2: float = field(
        default=0.0768, metadata=_symbol("s/rad", "eq. (8)", "steepness of the second term")
    )
    bl: float = field(
        default=0.0042, metadata=_symbol("Nm s/rad", "eq. (8)", "lower viscous friction")
    )
    friction: FrictionLaw = "humped"
    clamp: bool = False
    inertias: Literal[1, 2] = 2
    effects: tuple[Mapping[str, Any], ...] = ()

    def __post_init__(self) -> None:
        _validate(self)

    @classmethod
    def paper(cls) -> Rig:
        """The printed parameters, equations (6) and (8)."""
        return cls()

    @classmethod
    def one_inertia(
        cls, *, km: float, Ju: float, Tsu: float, bu: float, dTsu: float = 0.0, dbu: float = 0.0
    ) -> Rig:
        """Stage 1: the upper disc alone, J dw/dt = km u - T_fu(w), equation (5).

        Any consistent units will do, so a linear axis fits too (kg, N, N s/m, m).

        Args:
            km: force or torque per unit of input.
            Ju: inertia or mass.
            Tsu: Coulomb level, mean of both directions.
            bu: viscous coefficient, mean of both directions.
            dTsu: asymmetry of the Coulomb level (also holds a constant offset).
            dbu: asymmetry of the viscous coefficient.
        """
        return cls(
            km=km, Ju=Ju, Tsu=Tsu, dTsu=dTsu, bu=bu, dbu=dbu, Jl=1.0, ktheta=0.0, Tsl=0.0,
            T1=0.0, T2=0.0, beta1=1.0, beta2=1.0, bl=0.0, friction="coulomb", inertias=1,
        )  # fmt: skip

    def replace(self, **changes: Any) -> Rig:
        """A copy with some fields changed, validated anew."""
        return dataclasses.replace(self, **changes)

    def record(self) -> np.ndarray:
        """The parameters as the kernels read them, shape (1,)."""
        values = [getattr(self, name) for name in NAMES]
        reciprocals = [1.0 / self.Ju, 1.0 / self.Jl]
        flags = [LAWS.index(self.friction), self.clamp, self.inertias == 1]
        loads, clamp = (0.0, 0.0), (np.inf, np.inf)
        return np.array([(*values, *loads, *reciprocals, *clamp, *flags)], dtype=PARAMETERS)

    @property
    def breakaway_voltage(self) -> float:
        """Voltage u_c1 (V) above which the rig turns, point A: (Tsu + dTsu + Tsl) / km."""
        return (self.Tsu + self.dTsu + self.Tsl) / self.km

    @property
    def natural_period(self) -> float:
        """Period 2 pi sqrt(Jl/ktheta) (s) of the lower disc on the string, inf for one inertia."""
        return 2.0 * math.pi * math.sqrt(self.Jl / self.ktheta) if self.ktheta > 0 else math.inf

    @property
    def viscous_rate(self) -> float:
        """Fastest rate (1/s) at which viscous friction alone slows a disc at any speed."""
        lower = 0.0 if self.inertias == 1 else self.bl / self.Jl
        return max((self.bu + abs(self.dbu)) / self.Ju, lower)


SYMBOLS: tuple[str, ...] = NAMES
"""The fourteen physical parameters, in the order of the sensitivities' columns."""

UPPER = ("km", "Ju", "Tsu", "dTsu", "bu", "dbu")
"""Those of the drive and the upper disc, equation (5)."""

LOWER_LAW = ("Tsl", "T1", "T2", "beta1", "beta2", "bl")
"""Those of the lower disc's friction law, equation (7)."""


def _validate(rig: Rig) -> None:
    for name in SYMBOLS:
        object.__setattr__(rig, name, real(getattr(rig, name), f"rig parameter {name}"))
    for name in ("km", "Ju", "Jl"):
        _require(getattr(rig, name) > 0, name, getattr(rig, name), "greater than 0")
    if rig.inertias not in (1, 2):
        raise InputError(f"inertias is {rig.inertias!r}: give 1 (upper disc alone) or 2")
    if rig.inertias == 2:
        _require(rig.ktheta > 0, "ktheta", rig.ktheta, "greater than 0")
    elif rig.ktheta != 0:
        raise InputError("inertias is 1 with a string: make such a rig with Rig.one_inertia")
    for name in ("Tsu", "Tsl", "beta1", "beta2"):
        _require(getattr(rig, name) >= 0, name, getattr(rig, name), "0 or greater")
    _require(abs(rig.dTsu) <= rig.Tsu, "dTsu", rig.dTsu, f"within +-Tsu = {rig.Tsu}")
    _require(abs(rig.dbu) <= abs(rig.bu), "dbu", rig.dbu, f"within +-bu = {rig.bu}")
    if rig.friction not in get_args(FrictionLaw):
        names = ", ".join(get_args(FrictionLaw))
        raise InputError(f"friction is {rig.friction!r}: give one of {names}")
    if not isinstance(rig.effects, (tuple, list)):
        raise InputError(f"effects is {rig.effects!r}: give a list of tables, each with its id")
    object.__setattr__(rig, "effects", tuple(rig.effects))
    if rig.friction == "stribeck":
        _require(
            -rig.Tsl <= rig.T1 <= 0, "T1", rig.T1,
            f"between -Tsl = {-rig.Tsl} and 0 with friction = 'stribeck' (Tsl + T1 is the "
            "Coulomb level)",
        )  # fmt: skip


def _require(ok: bool, name: str, value: float, wanted: str) -> None:
    if not ok:
        raise InputError(f"rig parameter {name} is {value}: it must be {wanted}")
