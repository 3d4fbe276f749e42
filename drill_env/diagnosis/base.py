"""The rig alone, fitted: what every search starts from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from drill_env._errors import InputError
from drill_env._watch import Report
from drill_env.diagnosis.clock import cleaned, with_uncertain_times
from drill_env.diagnosis.extended import evaluate, motion_of
from drill_env.diagnosis.faults import clock_jitter
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import with_new_motions
from drill_env.diagnosis.joint import descend_jointly, polished
from drill_env.diagnosis.rig_coordinates import RigCoordinates
from drill_env.diagnosis.rounds import NEEDED
from drill_env.identification.coordinates import Coordinates
from drill_env.identification.noise import usual_noise
from drill_env.identification.noise_of_recording import noise_shown
from drill_env.identification.prediction_error import path_of
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig
from drill_env.prediction.given import given_numbers

_RELEASE = 6.0
# Rounds of a descent.
_ROUNDS = 25

AGAIN = 2
"""How often a descent begins again under the noise that it came to, at most."""


def base_fit(
    samples: Sequence[Samples], rig: Rig, free: Sequence[str], doubt: float = 0.05,
    again: int = AGAIN,
) -> tuple[Setting, Fit]:  # fmt: skip
    """Fit the rig alone, held near the start where it does not explain the recordings."""
    coordinates = RigCoordinates(Coordinates(rig, tuple(free)), given_numbers(rig))
    samples = [replace(s, release=_RELEASE) for s in samples]
    shown = noise_shown([s.recording for s in samples], samples[0].relative)
    setting = Setting(tuple(samples), coordinates, doubt, shown=shown)
    noise = replace(usual_noise(rig), **setting.shown)
    motions = [motion_of(s, noise, path_of(s, rig, noise, s.starts)) for s in samples]
    # Weights would hold a filter back that starts with a wrong rig and too little noise.
    plain = replace(setting, robust=math.inf)
    here = evaluate(plain, coordinates.vector(rig), (), noise, [s.starts for s in samples], motions)
    if not math.isfinite(here.value):
        raise InputError(
            "the given rig has no likelihood on these recordings: look for readings that are "
            "infinite, and for a rig file with numbers far from the rig's"
        )
    if rig.effects:
        # The first motion was told without them.
        here = with_new_motions(plain, here)
    # Under too little noise a rig goes astray before the noise follows: where discs are shaken, its
    # inertias and torques shrink until the usual noise moves it so much. So it begins again under
    # the noise that it came to.
    begin, ends = here, [_fitted(plain, setting, here)]
    for _ in range(again):
        noise = ends[-1].noise
        start = evaluate(plain, begin.vector, (), noise, begin.starts, begin.motions)
        ends.append(_fitted(plain, setting, start))
        if abs(ends[-1].value - ends[0].value) < NEEDED:
            # The same peak, as far as any effect must gain.
            break
    here = min(ends, key=lambda fit: fit.value)
    return replace(setting, wide=here.noise), here


def _fitted(plain: Setting, setting: Setting, start: Fit) -> Fit:
    here = descend_jointly(plain, start, limit=_ROUNDS, enough=1.0, only=None)
    here = with_new_motions(setting, here)
    # What a candidate is compared with has come to its end, too, or any one would gain. But what is
    # missing would pose as slow noise the more.
    there, usual = polished(setting, here), usual_noise(here.rig)
    slow = there.noise.tau_u > usual.tau_u or there.noise.tau_l > usual.tau_l
    return here if slow else there


def cleaned_base(
    samples: Sequence[Samples], rig: Rig, free: Sequence[str], doubt: float, report: Report
) -> tuple[Setting, Fit]:
    """The rig alone, without stale rows and with the times as uncertain as they are."""
    report("fitting the rig alone")
    samples = cleaned(samples)
    setting, base = base_fit(samples, rig, free, doubt)
    clock = clock_jitter(setting, base)
    if clock is None:
        return setting, base
    report("fitting the rig alone, the times uncertain")
    size = clock.parameters["jitter"][0]
    setting, base = base_fit([with_uncertain_times(s, size) for s in samples], rig, free, doubt)
    return replace(setting, jitter=size), base
