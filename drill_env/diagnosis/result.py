"""What a diagnosis says, as plain values of the documented schema."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeAlias

SCHEMA = 1

Verdict: TypeAlias = Literal["consistent", "parameters", "missing_physics", "unexplained"]


_DIGITS, _MOST_DIGITS = 4, 10


@dataclass(frozen=True, slots=True)
class Number:
    """A value with its 95 % interval and unit."""

    value: float
    low: float
    high: float
    unit: str


def digits_of(value: float, low: float, high: float) -> int:
    """Significant digits of a value and its interval that show two of the interval's width."""
    width, largest = high - low, max(abs(value), abs(low), abs(high))
    if not (0.0 < width < math.inf) or not math.isfinite(largest):
        return _DIGITS
    return min(max(math.ceil(math.log10(largest / width)) + 2, _DIGITS), _MOST_DIGITS)


@dataclass(frozen=True, slots=True)
class Located:
    """Where the mismatch sits.

    Attributes:
        component: actuator, upper, string, lower or sensor.
        equation: disc whose equation of motion it enters: upper, lower or both.
        depends_on: coordinate that it is a function of.
        recording: in which the intervals are.
        intervals_s: times at which it is at more than half of its greatest size.
        region: range of the coordinate there.
        angle_order: cycles a turn, if it is periodic in an angle.
        frequency_hz: if it is periodic in time.
        excess_torque_rms_Nm: root mean square torque on each disc.
        excess_angle_rms_rad: root mean square error of each reading.
    """

    component: str
    equation: str
    depends_on: str
    recording: str
    intervals_s: list[list[float]]
    region: dict[str, list[float]]
    angle_order: float | None
    frequency_hz: float | None
    excess_torque_rms_Nm: dict[str, float]
    excess_angle_rms_rad: dict[str, float]


@dataclass(frozen=True, slots=True)
class NamedEffect:
    """An effect that is believed in.

    Attributes:
        id: in the library.
        component: where it sits.
        probability: that it is this one.
        parameters: its numbers.
        formula: in their names.
        meaning: one plain sentence.
        alias_class: effects that no recording tells from it.
        rest: where its law differs from the library's, ids and numbers of the effects over the
            same coordinate that describe the difference: all of them together are one law.
    """

    id: str
    component: str
    probability: float
    parameters: dict[str, Number]
    formula: str
    meaning: str
    alias_class: list[str]
    rest: dict[str, dict[str, Number]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Alternative:
    """A candidate that explains less."""

    id: str
    probability: float
    delta_bic: float


@dataclass(frozen=True, slots=True)
class FoundShape:
    """A function of one coordinate in place of a name.

    Attributes:
        coordinate: what it is a function of.
        sort: "torque" (Nm), "friction" (share of the brake's torque, or Nm at the upper disc),
            "drive" (share of km u), "damping" (Nm s/rad), "stiffness" (share of ktheta) or
            "error" (rad).
        formula: shortest description that was found.
        r2: share of the shape's variance that the formula explains.
        knots: values of the coordinate.
        values: of the function there.
    """

    coordinate: str
    sort: str
    formula: str
    r2: float
    knots: list[float]
    values: list[float]


@dataclass(frozen=True, slots=True)
class Grade:
    """How finely the first finding can be told, each grade with its probability.

    Attributes:
        component: where it sits.
        component_probability: among all that predicts unseen recordings better than the rig.
        depends_on: the coordinate that it is a function of.
        depends_on_probability: of component and coordinate.
        family: what the effect says apart from its formula, as "friction that falls with speed";
            empty where no law is reported.
        family_probability: of component, coordinate and family.
        law: id of the effect; empty where a free shape predicts clearly better.
        law_probability: of that effect.
        share: of what the best free shape explains that the effect explains; below 1 its law
            differs from the library's.
        nearest: where no law is told, effects of this place with the share of what the free shape
            explains, the largest first: the missing physics may be such with another law.
    """

    component: str
    component_probability: float
    depends_on: str
    depends_on_probability: float
    family: str
    family_probability: float
    law: str
    law_probability: float
    share: float
    nearest: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Prediction:
    """How one candidate does, beside the model without it.

    Attributes:
        id: of the candidate.
        gain: log density of all unseen windows less that of the model without it, nats; of a whole
            rig the evidence of all recordings.
        standard_error: of the gain, or of its held-out part.
        z: standard deviations that it is off chance, by that error or by the signs of its parts; 0
            where there is no scatter.
        by_lead: the gain at each lead; of a whole rig that of fitted and of held-out recordings.
        numbers: how many it has.
        weight: its probability among those that are listed, 0 if it is not.
        kept: whether it was taken.
    """

    id: str
    gain: float
    standard_error: float
    z: float
    by_lead: list[float]
    numbers: int
    weight: float
    kept: bool


@dataclass(frozen=True, slots=True)
class Change:
    """A parameter before and after."""

    before: float
    after: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class NextExperiment:
    """The recording that would settle what is confused.

    Attributes:
        signal: in words.
        command: that writes the voltage.
        separates: the two candidates.
        expected_log_odds: expected log of the odds for the true one of them.
    """

    signal: str
    command: str
    separates: list[str]
    expected_log_odds: float


@dataclass(frozen=True, slots=True)
class DiagnosisResult:
    """Everything in `diagnosis.json`; see the documentation of the schema."""

    verdict: Verdict
    located: Located | None
    effects: list[NamedEffect]
    alternatives: list[Alternative]
    shape: FoundShape | None
    parameters_changed: dict[str, Change]
    fit: dict[str, Any]
    noise: dict[str, float]
    faults: list[str]
    sentences: list[str]
    next_experiment: NextExperiment | None
    recordings: dict[str, list[str]] = field(default_factory=dict)
    grades: Grade | None = None
    predictions: list[list[Prediction]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    complete: bool = True

    def as_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {"schema": SCHEMA, **asdict(self)}
