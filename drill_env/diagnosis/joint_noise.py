"""Steps of the noise model while a rig and its terms stay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.extended import evaluate, value_at
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.identification.noise import NoiseModel
from drill_env.identification.noise_fit import noise_step

SIZES, TORQUES = (0, 1), (0, 1, 2, 3)
"""Places of the torques' sizes in a noise model, and of their sizes and correlation times."""

# A step of the noise along its bent valley (much and slow, little and fast) may be too long.
_HALVINGS = 4

# Above what an encoder's readings show by themselves, its noise would hide missing physics.
_MOST_ROUNDING = 2.0

# Change of the logarithms of a noise model that counts as none.
_STILL = 0.03


def better_noise(setting: Setting, here: Fit, only: Sequence[int] | None) -> NoiseModel:
    """One step of the noise model.

    Args:
        setting: recordings.
        here: the point.
        only: places of the numbers that move, `SIZES` at less than half of the work; None for all.
    """
    given = [
        with_terms(s, here.terms, here.rig, m)
        for s, m in zip(setting.samples, here.motions, strict=True)
    ]
    model = noise_step(
        given, here.starts, here.rig, here.noise, robust=setting.robust,
        only=only, known=here.traces,
    )  # fmt: skip
    return _bounded(setting, model)


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


def with_noise(setting: Setting, here: Fit, noise: NoiseModel) -> Fit:
    """The noise model moved alone, by half as much as long as the step is too long."""
    if noise is here.noise:
        return here
    old = here.noise.vector()
    step = noise.vector() - old
    for _ in range(_HALVINGS):
        model = NoiseModel.from_vector(old + step)
        point = (here.vector, here.terms, model, here.starts, here.motions)
        if value_at(setting, *point) < here.value:
            there = evaluate(setting, *point)
            return there if there.value < here.value else here
        step = 0.5 * step
        if float(np.abs(step).max()) < _STILL:
            break
    return here
