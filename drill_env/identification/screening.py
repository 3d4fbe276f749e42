"""Whether a recording can come from the rig: signs, units, swapped channels, shifted clock.

The torn equations (`drill_env.identification.torn`) give the sign and the size of what
drives each disc. Signs must be right on any rig. Sizes are known for a given rig only, or
roughly where the rig resembles the paper's; there they give remarks and no errors.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np

from drill_env._errors import InputError
from drill_env.identification.row_checks import check_rows
from drill_env.identification.torn import (
    LowerFit,
    Smoothed,
    UpperFit,
    fit_lower,
    fit_upper,
    is_varied,
    smoothed,
)
from drill_env.identification.unit_names import named_common, named_factor
from drill_env.parameters import Rig
from drill_env.recordings import Recording, RecordingWarning

FATAL = ("sign", "swapped_encoders", "swapped_columns", "reversed_time", "encoder_units")
"""Findings that `screen` raises: a fit would give a wrong rig, whichever the rig."""

_LOW, _HIGH = 0.42, 2.2
_GIVEN = 1.8
_RATIO = 1.25
_POWER = 0.5
_LONGEST_SHIFT_S = 2.0
_SHIFT_S = 0.08
_SLOW_CUTOFF = 1.2


def screen(recording: Recording, rig: Rig | None = None) -> tuple[RecordingWarning, ...]:
    """Refuse a recording that no rig can make, and remark what is doubtful.

    Args:
        recording: with u and at least one angle; gaps and missing samples are skipped.
        rig: the rig if it is known; sizes are then held against it, too.

    Returns:
        The remarks; none for a sound recording.

    Raises:
        InputError: a sign is wrong, channels are swapped, the time runs backwards, the two
            encoders disagree in their units, or a size contradicts the given rig.
    """
    notes = findings(recording, rig)
    fatal = (*FATAL, *(() if rig is None else ("unit", "clock")))
    for note in notes:
        if note.code in fatal:
            raise InputError(str(note))
    return notes


def findings(recording: Recording, rig: Rig | None = None) -> tuple[RecordingWarning, ...]:
    """What `screen` found, as remarks only.

    Args:
        recording: with u and at least one angle.
        rig: the rig if it is known.
    """
    notes = check_rows(recording)
    # Across a jump every derivative is wrong, so the physics would name the wrong thing.
    if notes or recording.has_note("jump") or recording.u is None:
        return tuple(notes)
    if recording.theta_u is None or np.ptp(recording.theta_u[np.isfinite(recording.theta_u)]) == 0:
        return _lower_alone(recording)
    s = smoothed(recording)
    if s is None:
        return ()
    found = _physics(recording, s, rig)
    return () if found is None else (found,)


def _note(recording: Recording, code: str, text: str) -> RecordingWarning:
    return RecordingWarning(code, f"{recording.source}: {text}")


def _physics(recording: Recording, s: Smoothed, rig: Rig | None) -> RecordingWarning | None:
    upper, lower = fit_upper(s), fit_lower(s)
    steps = (_swapped, _shifted, _signs, _columns, _encoder_units, _sizes)
    for step in steps:
        note = step(recording, s, upper, lower, rig)
        if note is not None:
            return note
    return None


def _is_natural(s: Smoothed, upper: UpperFit | None, lower: LowerFit | None) -> bool:
    """Whether the string moves the lower disc more than the upper, and the voltage the upper."""
    if upper is None or lower is None:
        return True
    if is_varied(s.u) and upper.driven > 0.6:
        return True
    return lower.hold.is_sure() and lower.hold.value > upper.hold.value


def _swapped(
    recording: Recording, s: Smoothed, upper: UpperFit | None, lower: LowerFit | None, rig: Rig | None
) -> RecordingWarning | None:
    if recording.theta_l is None or _is_natural(s, upper, lower):
        return None
    upper, lower = fit_upper(s, 1), fit_lower(s, 0)
    if upper is None or lower is None or not _is_natural(s, upper, lower):
        return None
    if not (lower.hold.sign > 0 and lower.share > 0.5):
        return None
    text = (
        "the encoders are swapped: the column theta_u moves as the lower disc on the string and "
        "theta_l as the disc on the motor; exchange them, for example "
        "--map theta_u=theta_l --map theta_l=theta_u"
    )
    return _note(recording, "swapped_encoders", text)


def _shifted(
    recording: Recording, s: Smoothed, upper: UpperFit | None, lower: LowerFit | None, rig: Rig | None
) -> RecordingWarning | None:
    if upper is None or not is_varied(s.u):
        return None
    step = _grid_step(recording)
    reach = min(round(_LONGEST_SHIFT_S / step), len(s.u) // 4)
    now = fit_upper(s, margin=reach)
    if now is None:
        return None
    best, lag = now, 0
    for trial in range(-reach, reach + 1):
        fit = fit_upper(s, lag=trial, margin=reach)
        if fit is not None and fit.drive.sign > 0 and fit.damping.sign > 0:
            if fit.share > best.share:
                best, lag = fit, trial
    gain = (1.0 - now.share) / max(1.0 - best.share, 1e-6)
    if abs(lag) * step < _SHIFT_S or gain < 4.0 or best.share < 0.6 or abs(lag) == reach:
        return None
    where = "before" if lag > 0 else "behind"
    text = (
        f"the voltage runs about {abs(lag) * step:.2f} s {where} the motion it causes; shift the "
        "column u by so much, or record both with one clock"
    )
    return _note(recording, "shifted_voltage", text)


def _grid_step(recording: Recording) -> float:
    rate = 1.0 / float(np.median(np.diff(recording.t)))
    return max(1, round(rate / 20.0)) / rate


def _signs(
    recording: Recording, s: Smoothed, upper: UpperFit | None, lower: LowerFit | None, rig: Rig | None
) -> RecordingWarning | None:
    drive, damping = _drive_sign(s, upper), 0 if upper is None else upper.damping.sign
    if upper is not None and upper.share < 0.3:
        damping = 0
    against = lower is not None and lower.pull.sign < 0 and lower.hold.sign > 0
    against = against and lower is not None and lower.share > 0.3
    if drive > 0 and damping < 0:
        text = "both discs are driven by friction and braked by the motor: the time runs backwards"
        return _note(recording, "reversed_time", f"{text}; reverse the rows, not the times")
    if drive >= 0 and not against:
        return None
    if against and drive < 0:
        column, others = "theta_u", "both u and theta_l are right"
    elif against:
        column, others = "theta_l", "the string would pull the lower disc the wrong way"
    else:
        column, others = "u", "or those of both angles; the motor would turn the disc backwards"
    text = f"the sign of {column} is flipped ({others}); turn it with --map {column}={column}:-1"
    return _note(recording, "sign", text)


def _drive_sign(s: Smoothed, upper: UpperFit | None) -> int:
    """Sign of the motor's effect; by the power it puts in where the voltage never changes."""
    if upper is None:
        return 0
    if is_varied(s.u):
        return upper.drive.sign if upper.share > 0.3 else 0
    moving = np.abs(s.omega[0]) > 0.3
    u, omega = s.u[moving], s.omega[0][moving]
    scale = math.sqrt(float(np.mean(u**2)) * float(np.mean(omega**2)))
    if scale == 0.0:
        return 0
    power = float(np.mean(u * omega)) / scale
    if abs(power) < _POWER:
        return 0
    # Power flows the wrong way when the time runs backwards, too; then friction drives.
    backwards = upper.damping.sign < 0 and upper.share > 0.3
    return int(np.sign(power)) * (-1 if backwards else 1)


def _columns(
    recording: Recording, s: Smoothed, upper: UpperFit | None, lower: LowerFit | None, rig: Rig | None
) -> RecordingWarning | None:
    """Name columns that only fit in another order, or do not belong together."""
    if upper is None or not is_varied(s.u) or upper.share > 0.5:
        return None
    slow = smoothed(recording, _SLOW_CUTOFF)
    again = None if slow is None else fit_upper(slow)
    # Backlash shakes the disc, but slowly seen the voltage still moves it.
    if again is None or (again.share > 0.5 and again.drive.sign > 0):
        return None
    rows = (recording.u, recording.theta_u, recording.theta_l)
    names = ("u", "theta_u", "theta_l")
    if all(row is not None for row in rows):
        for order in list(itertools.permutations(range(3)))[1:]:
            if _fits(recording, order):
                maps = " ".join(
                    f"--map {names[i]}={names[j]}" for i, j in enumerate(order) if i != j
                )
                text = f"the columns are swapped; they fit the rig as {maps}"
                return _note(recording, "swapped_columns", text)
    text = (
        "the voltage does not move the upper disc as a motor would (it explains "
        f"{100 * max(upper.share, 0.0):.0f} % of the acceleration); check that u is the voltage of "
        "this very run and that theta_u is an angle, not a velocity"
    )
    return _note(recording, "unrelated", text)


def _fits(recording: Recording, order: tuple[int, ...]) -> bool:
    rows = (recording.u, recording.theta_u, recording.theta_l)
    changed = [rows[j] for j in order]
    other = replace(recording, u=changed[0], theta_u=changed[1], theta_l=changed[2])
    s = smoothed(other)
    if s is None or not is_varied(s.u):
        return False
    upper, lower = fit_upper(s), fit_lower(s)
    if upper is None or lower is None or upper.share < 0.9 or lower.share < 0.7:
        return False
    signs = (upper.drive.sign, upper.damping.sign, lower.hold.sign, lower.pull.sign)
    return upper.driven > 0.6 and signs == (1, 1, 1, 1)


def _encoder_units(
    recording: Recording, s: Smoothed, upper: UpperFit | None, lower: LowerFit | None, rig: Rig | None
) -> RecordingWarning | None:
    """Units that differ between the two encoders: seen on any rig."""
    if lower is None or upper is None or lower.share < 0.5:
        return None
    if not (lower.pull.is_sure(10.0) and lower.hold.is_sure(10.0)):
        return None
    factor = abs(lower.pull.value / lower.hold.value)
    if abs(math.log(factor)) < math.log(_RATIO):
        return None
    # The one that leaves the motor near the usual size is taken to be right.
    size = upper.drive.value / _nominal(rig)[0]
    column = "theta_l" if abs(math.log(abs(size))) < abs(math.log(abs(size * factor))) else "theta_u"
    scale = factor if column == "theta_l" else 1.0 / factor
    text = (
        f"the two encoders disagree by a factor of {factor:.4g}: theta_l over theta_u is that much "
        f"too large; {column} seems to be {named_factor(scale, column)}"
    )
    return _note(recording, "encoder_units", text)


def _nominal(rig: Rig | None) -> tuple[float, float, float]:
    """km/Ju, bu/Ju and ktheta/Jl of the given rig, or of the paper's."""
    rig = Rig.paper() if rig is None else rig
    return rig.km / rig.Ju, rig.bu / rig.Ju, rig.ktheta / rig.Jl


def _is_off(ratio: float, rig: Rig | None) -> bool:
    low, high = (_LOW, _HIGH) if rig is None else (1.0 / _GIVEN, _GIVEN)
    return not low < ratio < high


def _sizes(
    recording: Recording, s: Smoothed, upper: UpperFit | None, lower: LowerFit | None, rig: Rig | None
) -> RecordingWarning | None:
    if upper is None or not (upper.drive.is_sure() and upper.damping.is_sure()):
        return None
    if upper.share < 0.5 or upper.drive.value <= 0.0:
        return None
    km, bu, k = _nominal(rig)
    drive, damping = upper.drive.value / km, upper.damping.value / bu
    known = lower is not None and lower.hold.is_sure() and k > 0 and lower.share > 0.5
    pace = math.sqrt(abs(lower.hold.value) / k) if known and lower is not None else damping
    whose = "the given rig's" if rig is not None else "the paper's rig"
    if damping > 0 and _is_off(damping, rig) and _is_off(pace, rig) and 0.4 < pace / damping < 2.5:
        text = (
            f"everything runs {pace:.3g} times as fast as on {whose}; if that is not so, the "
            "clock is in another unit or the times were made up from a wrong rate: --map t=t:UNIT"
        )
        return _note(recording, "clock", text)
    if damping < 0.25 * pace and is_varied(s.u):
        text = (
            f"the upper disc has only {100 * max(damping, 0.0):.0f} % of the damping a motor at a "
            "voltage has; the column u looks like a current: record the voltage"
        )
        return _note(recording, "current", text)
    if _is_off(drive, rig):
        text = f"a volt moves the upper disc {drive:.3g} times as much as on {whose}"
        return _note(recording, "unit", f"{text}; {named_common(drive)}")
    return None


def _lower_alone(recording: Recording) -> tuple[RecordingWarning, ...]:
    """Without the upper encoder: over seconds the lower disc must follow the voltage."""
    if recording.theta_l is None:
        return ()
    s = smoothed(recording, 0.2)
    if s is None or len(s.u) < 200:
        return ()
    norm = math.sqrt(float(np.mean(s.u**2)) * float(np.mean(s.omega[1] ** 2)))
    if norm == 0.0 or float(np.mean(s.u * s.omega[1])) / norm > -_POWER:
        return ()
    text = "the lower disc turns against the voltage; turn u or theta_l with --map u=u:-1"
    return (_note(recording, "sign", f"the sign of u or theta_l is flipped: {text}"),)
