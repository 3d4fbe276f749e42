"""Sizes of what moves the discs: units that differ, and what a wrong unit could be."""

from __future__ import annotations

import math

from drill_env.identification.equation_error import LowerFit, Smoothed, UpperFit, is_varied
from drill_env.parameters import Rig

_TURN = 2.0 * math.pi
_ANGLE = {
    "in degrees": (180.0 / math.pi, "deg"),
    "in turns": (1.0 / _TURN, "turn"),
    "in mrad": (1000.0, "mrad"),
    "in counts of an encoder": (8192.0 / _TURN, "counts/N"),
    "decoded four-fold while the counts per turn are those of the lines": (4.0, ""),
    "of an encoder with a fourth of the stated counts per turn": (0.25, ""),
}
_VOLTAGE = {"in mV": (1e-3, "mV"), "in kV": (1e3, "kV")}
_EXACT, _ROUGH = 1.25, 2.2
# Rigs within 30 % of the paper's lie inside; a wrong unit, or counts times four, outside.
_LOW, _HIGH = 0.42, 2.2
GIVEN = 1.8
"""How far sizes may be from a given rig's."""

INCOMPLETE = 3.0
"""The same where physics may be missing from it, which bends what is fitted in its place."""

_ENCODERS = 1.25


def compare_encoders(
    upper: UpperFit, lower: LowerFit | None, rig: Rig | None
) -> tuple[str, str] | None:
    """Units that differ between the two encoders, which is seen on any rig.

    Args:
        upper: fit of the upper disc.
        lower: fit of the lower disc, where there is one.
        rig: the rig if it is known; tells which of the two is wrong.

    Returns:
        Code and text of the remark, None if the encoders agree.
    """
    if lower is None or lower.share < 0.5:
        return None
    if not (lower.pull.is_sure(5.0) and lower.hold.is_sure(5.0)):
        return None
    factor = abs(lower.pull.value / lower.hold.value)
    if abs(math.log(factor)) < math.log(_ENCODERS):
        return None
    # The one that leaves the motor near the usual size is taken to be right.
    size = abs(upper.drive.value) / _nominal(rig)[0]
    column = "theta_l" if abs(math.log(size)) < abs(math.log(size * factor)) else "theta_u"
    scale = factor if column == "theta_l" else 1.0 / factor
    text = (
        f"the two encoders disagree: theta_l is {factor:.4g} times too large beside theta_u; "
        f"{column} seems to be {_named_factor(scale, column)}"
    )
    return "encoder_units", text


def compare_sizes(
    s: Smoothed, upper: UpperFit, lower: LowerFit | None, rig: Rig | None, most: float = GIVEN
) -> tuple[str, str] | None:
    """Clock, damping and drive against those of the given rig, or roughly of the paper's.

    Args:
        s: what was fitted.
        upper: fit of the upper disc.
        lower: fit of the lower disc, where there is one.
        rig: the rig if it is known.
        most: times by which sizes may be off those of the given rig.

    Returns:
        Code and text of the remark, None if all sizes are usual or nothing is sure.
    """
    # On slow signals drive and damping may err together, but hardly their ratio.
    if not (upper.drive.is_sure(2.5) and upper.drive.value > 0.0 and upper.share > 0.5):
        return None
    km, bu, k = _nominal(rig)
    damping = upper.damping.value / bu if bu > 0.0 else 1.0
    drive = upper.drive.value / km
    pace = damping
    string = lower is not None and lower.hold.sign > 0 and lower.share > 0.5 and k > 0.0
    if string and lower is not None:
        pace = math.sqrt(lower.hold.value / k)
    whose = "the paper's rig" if rig is None else "the given rig"
    highest = (upper.damping.value + 3.0 * upper.damping.spread) / bu if bu > 0.0 else 1.0
    if damping < 0.25 * pace and highest < 0.5 * pace and is_varied(s.u):
        return "current", (
            f"the upper disc has only {100 * max(damping, 0.0):.0f} % of the damping that a motor "
            "at a voltage has; the column u looks like a current: record the voltage"
        )
    if not upper.damping.is_sure(2.5) or damping <= 0.0:
        return None
    gain = drive / damping
    alike = 0.4 < pace / damping < 2.5 and (string or 0.4 < gain / pace < 2.5)
    if alike and _is_off(damping, rig, most) and _is_off(pace, rig, most):
        return "clock", (
            f"everything runs {pace:.3g} times as fast as on {whose}; if it is not another rig, "
            "the clock is in another unit or at another rate than it says: --map t=t:UNIT"
        )
    same_side = (drive - 1.0) * (gain - 1.0) > 0.0 or not upper.drive.is_sure()
    if _is_off(gain, rig, most) and same_side:
        text = f"a volt turns the upper disc {gain:.3g} times as fast as on {whose}"
        return "unit", f"{text}; {_named_common(gain)}"
    return None


def _nominal(rig: Rig | None) -> tuple[float, float, float]:
    """km/Ju, bu/Ju and ktheta/Jl of the given rig, or of the paper's."""
    rig = Rig.paper() if rig is None else rig
    return rig.km / rig.Ju, rig.bu / rig.Ju, rig.ktheta / rig.Jl


def _is_off(ratio: float, rig: Rig | None, most: float) -> bool:
    low, high = (_LOW, _HIGH) if rig is None else (1.0 / most, most)
    return not low < ratio < high


def _named_factor(factor: float, column: str) -> str:
    """What an angle column is in that is `factor` times too large, with the remedy."""
    near = [(n, u) for n, (f, u) in _ANGLE.items() if _distance(f, factor) < math.log(_EXACT)]
    if not near:
        return f"{factor:.4g} times too large: --map {column}={column}:{1.0 / factor:.6g}"
    unit = near[0][1] or f"{1.0 / factor:.6g}"
    return f"{' or '.join(n for n, _ in near)}: --map {column}={column}:{unit}"


def _named_common(factor: float) -> str:
    """What could make the response to the voltage `factor` times too large."""
    angle = _near(_ANGLE, factor)
    volts = _near(_VOLTAGE, factor)
    guesses = [f"the angles may be {name}" for name in angle]
    guesses += [f"the voltage may be {name}" for name in volts]
    if not guesses:
        return "another rig, or a wrong unit of u or of both angles: check them"
    units = {unit for unit in angle.values() if unit} | {u for u in volts.values() if u}
    remedy = f"; state the unit with --map ({', '.join(sorted(units))})" if units else ""
    return f"if it is not another rig, {' or '.join(guesses)}{remedy}"


def _near(known: dict[str, tuple[float, str]], factor: float) -> dict[str, str]:
    found = [(n, u, _distance(f, factor)) for n, (f, u) in known.items()]
    return {n: u for n, u, d in sorted(found, key=lambda e: e[2]) if d < math.log(_ROUGH)}


def _distance(known: float, factor: float) -> float:
    return abs(math.log(known / abs(factor)))
