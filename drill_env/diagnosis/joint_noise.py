"""Steps of the noise model while a rig and its terms stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.extended import evaluate, value_at
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.identification.noise import NoiseModel
from drill_env.identification.noise_fit import LONGEST_STEP, noise_step

SIZES, TORQUES = (0, 1), (0, 1, 2, 3)
"""Places of the torques' sizes in a noise model, and of their sizes and correlation times."""

# A step of the noise along its bent valley (much and slow, little and fast) may be too long.
_HALVINGS = 4

# Above what an encoder's readings show by themselves, its noise would hide missing physics.
_MOST_ROUNDING = 2.0

# Change of the logarithms of a noise model that counts as none.
_STILL = 0.03


@dataclass(frozen=True, slots=True)
class NoiseStep:
    """One step of scoring of a noise model, and where those to come would lead.

    Attributes:
        here: where it begins.
        there: where it leads.
        further: where all later ones would end if they shorten as the last two did.
    """

    here: NoiseModel
    there: NoiseModel
    further: NoiseModel


def better_noise(
    setting: Setting, here: Fit, only: Sequence[int] | None, before: NoiseStep | None = None
) -> NoiseStep:
    """One step of the noise model.

    Args:
        setting: recordings.
        here: the point.
        only: places of the numbers that move, `SIZES` at less than half of the work; None for all.
        before: the step before; without it nothing tells how steps shorten.
    """
    given = [
        with_terms(s, here.terms, here.rig, m)
        for s, m in zip(setting.samples, here.motions, strict=True)
    ]
    model = noise_step(
        given, here.starts, here.rig, here.noise, robust=setting.robust,
        only=only, known=here.traces,
    )  # fmt: skip
    there = _bounded(setting, model)
    step = NoiseStep(here.noise, there, there)
    if before is None:
        return step
    return replace(step, further=_bounded(setting, extrapolated(step, before)))


def extrapolated(step: NoiseStep, before: NoiseStep) -> NoiseModel:
    """Where steps of scoring would end: Anderson, Journal of the ACM 12 (1965), of the last two.

    Of noise that is next to none each step takes away the same small share.
    """
    here, there = step.here.vector(), step.there.vector()
    last, moved = before.there.vector(), there - here
    turn = moved - (last - before.here.vector())
    share = float(moved @ turn) / max(float(turn @ turn), 1e-300)
    whole = moved - share * (there - last)
    whole *= min(1.0, LONGEST_STEP / max(float(np.abs(whole).max()), 1e-12))
    return NoiseModel.from_vector(here + whole)


def _bounded(setting: Setting, model: NoiseModel) -> NoiseModel:
    """No more noise than what is known of it.

    Encoders err by their rounding. Torques that are noise under the rig alone hold all that is
    missing, so nothing that is found may leave a slower or larger one: it would hide a rig that
    has gone astray.
    """
    for name, size in setting.shown.items():
        most = _MOST_ROUNDING * size
        model = replace(model, **{name: min(getattr(model, name), most)})
    if setting.wide is None:
        return model
    for disc in ("u", "l"):
        names = (f"torque_{disc}", f"tau_{disc}")
        size, time = (getattr(model, name) for name in names)
        most, longest = (getattr(setting.wide, name) for name in names)
        # The power at frequencies that neither resolves.
        if size * size * time > most * most * longest:
            model = replace(model, **dict(zip(names, (most, longest), strict=True)))
    return model


def still(one: NoiseModel, other: NoiseModel) -> bool:
    """Whether two noise models are as good as the same."""
    return float(np.abs(one.vector() - other.vector()).max()) < _STILL


def with_noise(setting: Setting, here: Fit, step: NoiseStep | None) -> Fit:
    """The noise model moved alone: as far as it leads, or by less where a step is too long."""
    if step is None:
        return here
    old = here.noise.vector()
    plain = step.there.vector() - old
    moves = [plain * 0.5**halved for halved in range(_HALVINGS)]
    if step.further is not step.there:
        moves.insert(0, step.further.vector() - old)
    for move in moves:
        model = NoiseModel.from_vector(old + move)
        point = (here.vector, here.terms, model, here.starts, here.motions)
        if value_at(setting, *point) < here.value:
            there = evaluate(setting, *point)
            return there if there.value < here.value else here
        if float(np.abs(move).max()) < 2.0 * _STILL:
            break
    return here
