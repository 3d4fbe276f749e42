"""Whether a recording can come from the rig: signs, units, swapped channels, shifted clock.

The torn equations (`drill_env.identification.equation_error`) give the sign and the size of what
drives each disc. Signs must be right on any rig. Sizes are known for a given rig only, or
roughly where the rig resembles the paper's; there they give remarks and no errors.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.alternatives import angle_or_none, explained, find_alternative
from drill_env.identification.drive import driven_rig
from drill_env.identification.equation_error import (
    CUTOFF,
    LowerFit,
    Smoothed,
    UpperFit,
    fit_lower,
    fit_upper,
    grid_step,
    is_varied,
    smoothed,
    with_integrals,
)
from drill_env.identification.known_loads import with_added_inertia
from drill_env.identification.row_checks import check_rows
from drill_env.identification.sizes import GIVEN, INCOMPLETE, compare_encoders, compare_sizes
from drill_env.parameters import Rig
from drill_env.recordings import Recording, RecordingWarning

FATAL = (
    "sign", "swapped_encoders", "swapped_columns", "same_column", "velocity", "reversed_time",
    "encoder_units",
)  # fmt: skip
"""Findings that `screen` raises: a fit would give a wrong rig, whichever the rig."""

_POWER = 0.5
_LONGEST_SHIFT_S, _SHIFT_S = 2.0, 0.08
# Beyond this a shift can only fit the noise.
_EXPLAINED = 0.99
_ALIKE = 1.5
_SLOW_CUTOFF = 1.2
_UNRELATED, _DRIVEN = 0.6, 0.4
# Far below that frequency the discs turn as one, and twist is acceleration but for a factor: an
# octave above it the whole swing is kept.
_SWINGS = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class _Case:
    recording: Recording
    given: Rig | None
    s: Smoothed
    upper: UpperFit
    lower: LowerFit | None

    def note(self, code: str, text: str) -> RecordingWarning:
        return RecordingWarning(code, f"{self.recording.source}: {text}")


def screen(
    recording: Recording, rig: Rig | None = None, *, alone: bool = False, incomplete: bool = False
) -> tuple[RecordingWarning, ...]:
    """Refuse a recording that no rig can make, and remark what is doubtful.

    Args:
        recording: with u and at least one angle or velocity; gaps and missing samples are skipped.
        rig: the rig if it is known, not a mere starting guess; sizes are then held against
            it, too.
        alone: the upper disc was alone, as in stage 1, and theta_l says nothing. Without theta_l
            and this, a shifted voltage or one of another run cannot be told.
        incomplete: physics may be missing from the rig: what is fitted in its place is off by as
            much as a wrong unit is by, so less than three times as large is a remark and no error.

    Returns:
        The remarks; none for a sound recording.

    Raises:
        InputError: a sign is wrong, channels are swapped, the time runs backwards, the two
            encoders disagree in their units, or a size contradicts the given rig.
    """
    notes = findings(recording, rig, alone=alone)
    sure = findings(recording, rig, alone=alone, most=INCOMPLETE) if incomplete and notes else notes
    fatal = FATAL if rig is None else (*FATAL, "unit", "clock")
    for note in sure:
        if note.code in fatal:
            raise InputError(str(note))
    return notes


def findings(
    recording: Recording, rig: Rig | None = None, *, alone: bool = False, most: float = GIVEN
) -> tuple[RecordingWarning, ...]:
    """What `screen` found, as remarks only: at most one by physics, the first that explains it.

    Codes: those of `drill_env.identification.row_checks.check_rows`, "sign",
    "swapped_encoders", "swapped_columns", "velocity", "reversed_time", "encoder_units",
    "unit", "clock", "current", "shifted_voltage" and "unrelated".

    Args:
        recording: with u and at least one angle or velocity. A disc of which there is only a
            velocity is looked at by the integral of that.
        rig: the rig if it is known.
        alone: the upper disc was alone; so, too, if the rig has one inertia.
        most: times by which sizes may be off those of the rig, if it is known.
    """
    measured = recording
    rig = None if rig is None else with_added_inertia(rig, recording)
    recording = with_integrals(recording)
    alone = alone or (rig is not None and rig.inertias == 1)
    # A dead encoder has been remarked on reading.
    recording = replace(
        recording,
        theta_u=angle_or_none(recording.theta_u),
        theta_l=None if alone else angle_or_none(recording.theta_l),
    )
    if not recording.angles():
        return ()
    moved = recording.u is None or recording.drive == "motion"
    given = None if rig is None or moved else driven_rig(rig, [recording])
    known = recording.loads() or recording.effects or recording.coasts()
    if moved or known:
        # What the discs do is judged by the voltage, as if that alone moved them.
        return tuple(check_rows(recording, given))
    # An integral jumps and stands still by the noise of the velocity: no encoder to be judged.
    whole = measured.angles().keys() == recording.angles().keys()
    other = find_alternative(recording) if whole else None
    notes = [other] if other is not None else check_rows(recording, given) if whole else []
    # Across a jump every derivative is wrong.
    if notes or recording.has_note("jump"):
        return tuple(notes)
    found = _physics(recording, rig, given, alone, most)
    return () if found is None else (_as_recorded(found, measured),)


def _as_recorded(note: RecordingWarning, measured: Recording) -> RecordingWarning:
    """The remark with the velocity named that was recorded, and not its integral."""
    text = str(note)
    for disc in "ul":
        if f"theta_{disc}" not in measured.angles() and f"omega_{disc}" in measured.velocities():
            text = text.replace(f"theta_{disc}", f"omega_{disc}")
    text = re.sub(r"(=omega_[ul]:(?:deg|turn|mrad))\b", r"\1/s", text)
    return RecordingWarning(note.code, text)


def _physics(
    recording: Recording, rig: Rig | None, given: Rig | None, alone: bool, most: float
) -> RecordingWarning | None:
    if recording.theta_u is None:
        return _lower_alone(recording)
    s = smoothed(recording, CUTOFF if given is None else max(CUTOFF, _SWINGS * _swing(given)))
    upper = None if s is None else fit_upper(s)
    if s is None or upper is None:
        return None
    lower = None if recording.theta_l is None else fit_lower(s)
    case = _Case(recording, given, s, upper, lower)
    # A string whose other end is not seen disturbs the disc like a wrong voltage.
    whole = alone or recording.theta_l is not None
    for check in (_swapped, _shifted, _unrelated, _signs) if whole else (_signs,):
        note = check(case)
        if note is not None:
            return note
    found = compare_encoders(upper, lower, rig)
    # How much a Nm moves is another rig's, and no unit's.
    if found is None and (recording.drive == "voltage" or rig is not None):
        found = compare_sizes(s, upper, lower, given, most)
    return None if found is None else case.note(*found)


def _swing(rig: Rig) -> float:
    """Frequency at which the discs swing against each other, Hz."""
    return math.sqrt(rig.ktheta * (1.0 / rig.Ju + 1.0 / rig.Jl)) / (2.0 * math.pi)


def _is_natural(s: Smoothed, upper: UpperFit | None, lower: LowerFit | None) -> bool:
    """Whether the string moves the lower disc more than the upper, and the voltage the upper."""
    if upper is None or lower is None:
        return True
    if upper.hold.is_sure() and upper.hold.value > 3.0 * abs(lower.hold.value):
        return False
    if is_varied(s.u) and upper.driven > 0.6:
        return True
    if not (lower.hold.is_sure() and lower.pull.is_sure(4.0)):
        return False
    alike = abs(math.log(abs(lower.pull.value / lower.hold.value))) < math.log(_ALIKE)
    return alike and lower.hold.value > upper.hold.value


def _swapped(case: _Case) -> RecordingWarning | None:
    if case.lower is None or _is_natural(case.s, case.upper, case.lower):
        return None
    if case.given is not None and case.given.Jl >= case.given.Ju:
        # The string then moves the upper disc more, as it would with the columns exchanged.
        return None
    upper, lower = fit_upper(case.s, 1), fit_lower(case.s, 0)
    if upper is None or lower is None or not _is_natural(case.s, upper, lower):
        return None
    if not (lower.hold.sign > 0 and lower.share > 0.5):
        return None
    text = (
        "the encoders are swapped: the column theta_u moves as the lower disc on the string and "
        "theta_l as the disc on the motor; exchange them, for example "
        "--map theta_u=theta_l --map theta_l=theta_u"
    )
    return case.note("swapped_encoders", text)


def _shifted(case: _Case) -> RecordingWarning | None:
    s, step = case.s, grid_step(case.recording)
    reach = min(round(_LONGEST_SHIFT_S / step), len(s.u) // 4)
    now = fit_upper(s, margin=reach) if is_varied(s.u) else None
    if now is None or now.share > _EXPLAINED:
        return None
    best, lag = now, 0
    for trial in range(-reach, reach + 1):
        fit = fit_upper(s, lag=trial, margin=reach)
        if fit is not None and fit.drive.sign > 0 and fit.damping.sign > 0:
            best, lag = (fit, trial) if fit.share > best.share else (best, lag)
    gain = (1.0 - now.share) / max(1.0 - best.share, 1e-6)
    if abs(lag) * step < _SHIFT_S or gain < 4.0 or best.share < 0.6 or abs(lag) == reach:
        return None
    where = "before" if lag > 0 else "behind"
    text = (
        f"the voltage runs about {abs(lag) * step:.2f} s {where} the motion it causes; shift the "
        "column u by so much, or record both with one clock"
    )
    return case.note("shifted_voltage", text)


def _signs(case: _Case) -> RecordingWarning | None:
    upper, lower = case.upper, case.lower
    drive = _drive_sign(case.s, upper)
    against = lower is not None and lower.pull.sign < 0 and lower.hold.sign > 0
    against = against and lower is not None and lower.share > 0.3
    brakes = upper.damping.sign < 0 and upper.share > 0.3 and not _is_made_up(case.s, upper)
    if drive > 0 and brakes:
        text = "friction drives the discs and the motor brakes them: the time runs backwards"
        return case.note("reversed_time", f"{text}; reverse the rows, not the times")
    if drive >= 0 and not against:
        return None
    if not against:
        column, why = "u", "or those of both angles: the motor would turn the disc backwards"
    elif drive < 0:
        column, why = "theta_u", "it turns against the voltage and against the other disc"
    else:
        column, why = "theta_l", "the string would push the lower disc away from the upper"
    text = f"the sign of {column} is flipped ({why}); turn it with --map {column}={column}:-1"
    return case.note("sign", text)


def _drive_sign(s: Smoothed, upper: UpperFit) -> int:
    """Sign of the motor's effect; by the power it puts in where the fit does not tell."""
    power = _power(s.u, s.omega[0])
    if is_varied(s.u) and upper.share > 0.3 and upper.drive.sign:
        return int(np.sign(power)) if _is_made_up(s, upper) else upper.drive.sign
    # Power flows the wrong way when the time runs backwards, too; then friction drives.
    backwards = upper.damping.sign < 0 and upper.share > 0.3
    return 0 if abs(power) < _POWER else int(np.sign(power)) * (-1 if backwards else 1)


def _is_made_up(s: Smoothed, upper: UpperFit) -> bool:
    """Whether the fit shares out signs at will, as where a slow voltage hardly bends the string.

    A string that pushes is none, and power tells whether the voltage drives the disc.
    """
    return upper.hold.sign < 0 and _power(s.u, s.omega[0]) * upper.drive.sign < -_POWER


def _power(u: FloatArray, omega: FloatArray) -> float:
    """Power of the voltage on the disc, between -1 and 1."""
    norm = math.sqrt(float(np.mean(u**2)) * float(np.mean(omega**2)))
    return float(np.mean(u * omega)) / norm if norm > 0.0 else 0.0


def _unrelated(case: _Case) -> RecordingWarning | None:
    varied = float(np.std(case.s.u)) > 0.2 * math.sqrt(float(np.mean(case.s.u**2)))
    if (
        not varied
        or _drives_as_given(case)
        or (case.upper.share > _UNRELATED and case.upper.driven > _DRIVEN)
    ):
        return None
    # Backlash shakes the disc, but slowly seen the voltage still moves it.
    share, sign = explained(smoothed(case.recording, _SLOW_CUTOFF))
    if share > _UNRELATED and sign > 0 and case.upper.driven > _DRIVEN:
        return None
    text = (
        "the voltage does not move the upper disc as a motor would (all that is "
        f"known explains {100 * max(case.upper.share, 0.0):.0f} % of the acceleration, the voltage "
        f"{100 * case.upper.driven:.0f} % of that); check that u is the voltage of this very run "
        "and theta_u the angle of the disc"
    )
    return case.note("unrelated", text)


def _drives_as_given(case: _Case) -> bool:
    """Whether the drive moves the disc as on the given rig, however much else moves it."""
    usual = 0.0 if case.given is None else case.given.km / case.given.Ju
    found = case.upper.drive
    return found.sign > 0 and usual / INCOMPLETE < found.value < INCOMPLETE * usual


def _lower_alone(recording: Recording) -> RecordingWarning | None:
    """Without the upper encoder: over seconds the lower disc must follow the voltage."""
    s = smoothed(recording, 0.2)
    if s is None or len(s.u) < 200 or _power(s.u, s.omega[1]) > -_POWER:
        return None
    text = "the sign of u or theta_l is flipped (the disc turns back); turn one with --map u=u:-1"
    return RecordingWarning("sign", f"{recording.source}: {text}")
