"""What is left over decides whether names stay, and whether nothing is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.held_out import Judged, remaining
from drill_env.diagnosis.judging import without_names
from drill_env.diagnosis.remainder import PREDICTABLE, Latent, Remainder, remainder_of, share_by
from drill_env.diagnosis.rounds import Found, acts_at, is_named
from drill_env.diagnosis.shapes import COORDINATES, Place, plain_shape
from drill_env.diagnosis.slips import Slips
from drill_env.diagnosis.terms import Term
from drill_env.identification.samples import Samples

# Names are refuted by more than this share of what the rig alone left and the motion predicts.
# Seven wrong answers had 0.42 and more; of three right ones on made rigs that left something the
# largest was 0.06, of two on a real axis, which has more that no formula holds, 0.32.
_REFUTING = 0.4
# Above this one, and above that share of what is left, by a free shape that held-out recordings
# prefer: two wrong answers had 0.16 and 0.024.
_DOUBTING, _MOSTLY = 0.01, 0.5
_DISCS: tuple[Place, Place] = ("upper", "lower")
# Cosine of both discs' torques below which they are the string's.
_OPPOSED = -0.8


def weighed(
    found: Found, setting: Setting, base: Fit, law: bool, held: Sequence[Samples],
    before: tuple[Judged, ...], after: tuple[Judged, ...],
) -> tuple[Found, tuple[Judged, ...]]:  # fmt: skip
    """Names whose remainder the motion predicts are given up; what has none is told as a shape.

    Args:
        found: the search, judged.
        setting: of the rig alone.
        base: the rig alone, fitted.
        law: whether another friction law was found.
        held: held-out recordings.
        before: these under the rig alone.
        after: these under what was found.
    """
    if not found.rounds:
        return found, after
    latents = _latents(found.setting, found.final, after)
    left = remainder_of(latents)
    found = replace(found, remainder=left)
    if max(left.shares) < PREDICTABLE or not all(map(is_named, found.final.terms)):
        return found, after
    if not found.final.terms and not law:
        return _told(found, latents), after
    plainly, maybe = _doubted(left, remainder_of(_latents(setting, base, before)))
    if law:
        return _told(found, latents) if plainly else found, after
    if not _any_at(found, [*plainly, *maybe]):
        # A small trace at the other disc is told by its share alone.
        return found, after
    bare, other = without_names(found, held, before)
    preferred = bool(bare.final.terms) and sum(j.value for j in other) < sum(j.value for j in after)
    if not preferred and not _any_at(found, plainly):
        return found, after
    latents = _latents(bare.setting, bare.final, other)
    bare = replace(bare, remainder=remainder_of(latents))
    return bare if bare.final.terms else _told(bare, latents), other


def _latents(setting: Setting, fit: Fit, judged: Sequence[Judged]) -> list[Latent]:
    """What a fit leaves over of the fitted and the judged recordings.

    Lost counts are placed in the fitted ones alone.
    """
    seen = [Latent(*remaining(samples, setting, fit)) for samples in setting.samples]
    if any(isinstance(term.source, Slips) for term in fit.terms):
        return seen
    return [*seen, *(Latent(one.motion, one.torques) for one in judged)]


def _doubted(left: Remainder, alone: Remainder) -> tuple[list[int], list[int]]:
    """Discs at which what names leave over refutes them, and at which it may.

    It must be predictable, and no small part of what was so without them.
    """
    plainly, maybe = [], []
    for disc in range(2):
        now, then = left.squares[disc], alone.squares[disc]
        if left.shares[disc] > PREDICTABLE and now > _REFUTING * then:
            plainly.append(disc)
        elif left.shares[disc] > _MOSTLY and now > _DOUBTING * then:
            maybe.append(disc)
    return plainly, maybe


def _any_at(found: Found, discs: Sequence[int]) -> bool:
    """Whether something that was found acts at one of some discs."""
    return any(acts_at(term, discs) for term in found.final.terms)


def _told(found: Found, latents: Sequence[Latent]) -> Found:
    """What is left over told as a shape over the coordinate that alone predicts most of it."""
    left = found.remainder
    assert left is not None
    upper, lower = np.concatenate([one.torques for one in latents]).T
    together = float(upper @ lower) / float(np.linalg.norm(upper) * np.linalg.norm(lower) + 1e-300)
    both = min(left.shares) > PREDICTABLE and together < _OPPOSED
    disc = int(np.argmax(left.shares))
    place: Place = "string" if both else _DISCS[disc]
    values = [
        0.5 * (one.torques[:, 1] - one.torques[:, 0]) if both else one.torques[:, disc]
        for one in latents
    ]
    motions, inertias = [one.motion for one in latents], found.final.rig.inertias
    shapes = {
        name: shape
        for name in COORDINATES
        if (shape := plain_shape(place, name, motions, inertias)) is not None
    }
    if not shapes:
        return found
    name = max(shapes, key=lambda key: share_by(key, latents, values))
    shape = shapes[name]
    column = 0 if place == "upper" else 1
    flat = Term(shape, np.zeros(shape.size))
    basis = np.concatenate([flat.slopes(found.final.rig, m)[0][:, column] for m in motions])
    q = np.linalg.lstsq(basis, np.concatenate(values), rcond=None)[0]
    return replace(found, untold=Term(shape, np.asarray(q, dtype=np.float64)))
