"""The twist at which the encoders agree, and the torques of terms that follow from it.

Encoders begin anywhere, so the twist between their zeros is a number of each start. A torque over
the twist must move with it: a stiffening string's slope is soon larger than the string's own, and
then a fit along a motion with another offset leads further away from round to round.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.diagnosis.applied import as_heavy, effects_of
from drill_env.diagnosis.terms import Term, at_rest, late_disc
from drill_env.effects.along import Motion
from drill_env.identification.known_loads import with_added_inertia
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Path
from drill_env.identification.samples import Samples
from drill_env.identification.smoothing import slopes_of
from drill_env.parameters import Rig

# Twist over which slopes by it are taken, rad.
_TURN = 1e-5


def twisted_by_start(samples: Samples, motion: Motion, change: FloatArray) -> Motion:
    """The motion when the encoders agree at another twist.

    Args:
        samples: the recording; where one of the angles is not read, they tell no twist.
        motion: told at some starts.
        change: of that twist after each restart, rad, shape (m,).
    """
    if not (change.any() and np.isfinite(samples.angles[:, :2]).any(axis=0).all()):
        return motion
    edges = np.diff([*samples.restarts.tolist(), len(samples.t)])
    states = motion.states.copy()
    states[:, 0] += np.repeat(change, edges)
    return replace(motion, states=states)


def by_the_offset(
    samples: Samples, terms: Sequence[Term], rig: Rig, noise: NoiseModel, path: Path,
    motion: Motion, number: int,
) -> FloatArray | float:  # fmt: skip
    """How predictions follow the twist at which the encoders agree through what terms make of it.

    Args:
        samples: the recording, with the terms.
        terms: beside the rig's own effects.
        rig: parameters.
        noise: under which the pass was made.
        path: the pass.
        motion: along which the terms act.
        number: of starts.

    Returns:
        Standardised slopes, 1/rad, shape (n, readings); 0 where nothing follows it.
    """
    moved = twisted_by_start(samples, motion, np.full(number, _TURN))
    every = as_heavy((*effects_of(rig), *terms), rig, samples.recording)
    along = [t for t in every if not at_rest(t) and late_disc(t) is None]
    if moved is motion or not along:
        return 0.0
    heavy = with_added_inertia(rig, samples.recording)
    there, here = ([t.source.response(t.q, heavy, m) for t in along] for m in (moved, motion))
    loads, errors = (
        np.sum([a[i] - b[i] for a, b in zip(there, here, strict=True)], axis=0) / _TURN
        for i in range(2)
    )
    told = errors[:, :, np.newaxis] if errors.any() else None
    return slopes_of(samples, noise, path, loads[:, :, np.newaxis], told)[:, :, 0]
