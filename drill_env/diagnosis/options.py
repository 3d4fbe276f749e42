"""Settings of a diagnosis."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from drill_env._errors import InputError
from drill_env.effects import LIBRARY


@dataclass(frozen=True, slots=True)
class DiagnosisOptions:
    """How a diagnosis is made.

    Attributes:
        leave_out: ids of effects that the library shall not have.
        most: effects that are looked for, one after another; 0 fits the rig alone.
        given_rig: whether the rig was measured before, so that changed parameters are a finding.
        fixed: parameters that are held besides Ju.
        doubt: relative standard deviation of the given rig's parameters. It holds the rig sensible
            where physics is missing; widen it for a rig that is only roughly known.
        seed: of what is drawn.
        seconds: by the clock and of CPU after which no more is looked for and what is known is
            judged. A diagnosis of four recordings of a minute takes 15 to 100.
    """

    leave_out: tuple[str, ...] = ()
    most: int = 2
    given_rig: bool = False
    fixed: dict[str, float] = field(default_factory=dict)
    doubt: float = 0.05
    seed: int = 0
    seconds: float = 120.0

    def __post_init__(self) -> None:
        for name in self.leave_out:
            if name not in LIBRARY and name not in OUTSIDE:
                raise InputError(
                    f"leave out {name!r}: no such effect; known: "
                    f"{', '.join(sorted([*LIBRARY, *OUTSIDE]))}"
                )
        if not 0 < self.doubt < math.inf:
            raise InputError(f"doubt is {self.doubt}: give a share greater than 0, such as 0.05")
        if not self.seconds > 0:
            raise InputError(f"seconds is {self.seconds}: give more than 0, or inf for no limit")
        if self.seed < 0:
            raise InputError(f"seed is {self.seed}: give 0 or more")
        if self.most < 0:
            raise InputError(f"most is {self.most}: give 0 or more")


OUTSIDE = ("friction_shape", "clock_jitter", "missing_samples", "lost_encoder_bits")
"""Effects that are found without a torque or a reading error of their own."""
