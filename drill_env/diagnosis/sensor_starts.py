"""Where errors of a reading start: from a fit in which the sensor takes the blame.

A fit of the rig alone takes what is missing for a torque, and its smoothed motion follows the
readings, errors and all: no error of a reading is left to be seen. With the torque held at its
usual size and the sensor's noise free instead, the motion is what the rig says, and the error
stands out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from drill_env.diagnosis.extended import evaluate, value_at
from drill_env.diagnosis.first_look import first_look
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import with_new_motions
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.linearised import linearised_at
from drill_env.diagnosis.rounds import NEEDED
from drill_env.diagnosis.scan import score_effects
from drill_env.effects import Effect
from drill_env.identification.noise import NoiseModel, usual_noise

# Sizes of the sensor's noise that are tried, rad or rad/s: three a decade.
_SIZES = np.geomspace(1e-4, 1.0, 13)
# Effects that are started from, and rounds of a descent between two smoothed motions.
_BEST, _ROUNDS = 2, 3
# Descents at most: a play of 65 steps of the encoder took four.
_DESCENTS = 6


def sensor_starts(setting: Setting, fit: Fit, effects: Sequence[Effect]) -> list[Fit]:
    """Fits with an error of a reading that are more likely than the one without it.

    Args:
        setting: recordings and free parameters.
        fit: where to look.
        effects: that may join; those of the sensors are tried.
    """
    starts = []
    for disc, equation in (("u", "upper"), ("l", "lower")):
        errors = [e for e in effects if e.component == "sensor" and e.equation == equation]
        blamed = _blamed(setting, fit, disc) if errors else None
        if blamed is None:
            continue
        scores = score_effects(linearised_at(setting, blamed), errors, _BEST)[:_BEST]
        price = math.log(max(fit.count, 2))
        worth = [s for s in scores if s.gain - s.numbers * price > NEEDED]
        begun = [first_look(setting, blamed, s).start(setting, blamed) for s in worth]
        ends = [_descended(setting, start, disc) for start in begun]
        starts += [end for end in ends if end.bic < fit.bic]
    return starts


def _blamed(setting: Setting, fit: Fit, disc: str) -> Fit | None:
    """The fit with a disc's torque as usual and its sensor's noise free; None if that is no other.

    Where it is hardly less likely, nothing of what is missing was taken for a torque.
    """
    usual = usual_noise(fit.rig)
    held = {name: getattr(usual, name) for name in (f"torque_{disc}", f"tau_{disc}")}
    sensor = _sensor(setting, disc)
    tried = [replace(fit.noise, **held, **{sensor: float(size)}) for size in _SIZES]
    values = [
        value_at(setting, fit.vector, fit.terms, noise, fit.starts, fit.motions) for noise in tried
    ]
    best = int(np.argmin(values))
    if not math.isfinite(values[best]) or values[best] - fit.value < NEEDED:
        return None
    here = tried[best]
    there = evaluate(setting, fit.vector, fit.terms, here, fit.starts, fit.motions)
    return with_new_motions(setting, there)


def _sensor(setting: Setting, disc: str) -> str:
    """Name of the noise of what reads a disc: that of its velocity where no angle is read."""
    angles = setting.samples[0].recording.angles()
    return f"encoder_{disc}" if f"theta_{disc}" in angles else f"speed_{disc}"


def _descended(setting: Setting, here: Fit, disc: str) -> Fit:
    """The best fit on the way down, of the noise the sensor's alone free."""
    sensor = [one.name for one in fields(NoiseModel)].index(_sensor(setting, disc))
    here = with_new_motions(setting, here)
    for _ in range(_DESCENTS):
        there = descend_jointly(setting, here, limit=_ROUNDS, enough=1.0, only=(sensor,))
        there = with_new_motions(setting, there)
        if not there.value < here.value - NEEDED:
            break
        here = there
    return here
