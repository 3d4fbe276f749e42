"""Whether the residual torque of a fit says that something without a name is missing."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from drill_env.diagnosis.explained import ALIKE, happened_once, may_leave_more
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.held_out import Judged, remaining
from drill_env.diagnosis.lost_counts import LostCounts
from drill_env.diagnosis.repetition import Repetition, Residual, repetition_of
from drill_env.diagnosis.residual_torque import (
    PREDICTABLE,
    Latent,
    ResidualTorque,
    residual_torque_of,
    share_by,
)
from drill_env.diagnosis.rounds import Found, is_named
from drill_env.diagnosis.shapes import COORDINATES, Place, plain_shape
from drill_env.diagnosis.strikes import Once
from drill_env.diagnosis.terms import Term
from drill_env.identification.noise_fit import torques_told
from drill_env.prediction.criteria import Criteria

_DISCS: tuple[Place, Place] = ("upper", "lower")
# Components that each disc's torque may tell of; a misread angle seems a torque on either.
_ACTS_ON = (
    frozenset({"actuator", "upper", "string", "sensor"}), frozenset({"lower", "string", "sensor"})
)  # fmt: skip
# Cosine of both discs' torques below which they are the string's.
_OPPOSED = -0.8


def with_residual_torque(
    found: Found, setting: Setting, base: Fit, law: bool, before: Sequence[Judged],
    after: Sequence[Judged], criteria: Criteria,
) -> Found:  # fmt: skip
    """How much of the residual torque the motion predicts, and its shape if nothing explains it.

    Of what the rig alone leaves predictable, names and another law of friction must remove the
    share that a name must explain of a free function; else they are rejected.

    Args:
        found: the search, decided.
        setting: of the rig alone.
        base: the rig alone, fitted.
        law: whether another friction law was found.
        before: held-out recordings under the rig alone.
        after: these under what was found.
        criteria: of the decision.
    """
    if not found.rounds:
        return found
    latents = _latents(found.setting, found.final, after)
    left = residual_torque_of(latents)
    found = replace(found, residual_torque=left)
    contradicted = found.refuted is not None and found.explained == 1.0
    fitted = len(found.setting.samples)
    terms, little = found.final.terms, max(left.shares) < PREDICTABLE
    if little or contradicted:
        # A name that other recordings did not bear out may have been one phase of what repeats.
        if not (law or terms):
            found = replace(found, repetition=_repeats(latents, fitted))
        # What the fitted ones alone have, of which each tells the others, is there nevertheless.
        nothing = contradicted and little and found.repetition is None
        if nothing and max(residual_torque_of(latents[:fitted]).shares) < PREDICTABLE:
            found = replace(found, refuted=None)
        return found
    single = [t.source for t in terms if happened_once(t.source)]
    strikes = not single or any(isinstance(source, Once) for source in single)
    if not law and strikes and len(single) == len(terms):
        # Strikes and lost counts beside what the motion predicts are pieces of it.
        return _told(replace(found, final=found.base), latents)
    if may_leave_more([t.source for t in terms]) or not (law or all(map(is_named, terms))):
        return found
    # Less may be the difference of their laws, or a second effect: a sentence says so.
    alone = _latents(setting, base, before)
    then = residual_torque_of(alone)
    places = None if law else {t.source.component for t in terms if not happened_once(t.source)}
    if not removes_too_little(left, then, places, criteria):
        return found
    if law:
        return _told(found, latents)
    reason = "the motion predicts the residual torque that it leaves"
    rest = replace(
        found, final=found.base, refuted=found.final, reason=reason, residual_torque=then
    )
    return _told(rest, alone)


def removes_too_little(
    left: ResidualTorque, alone: ResidualTorque, places: Collection[str] | None, criteria: Criteria
) -> bool:
    """Whether at a disc more stays predictable than may be of what the rig alone leaves so.

    What stays at a disc at which no name acts is something else, and no reason against these; but
    they may not bring it there.

    Args:
        left: with the names.
        alone: of the rig alone.
        places: components at which the names act; all by default.
        criteria: of the decision.
    """
    discs = zip(_ACTS_ON, left.shares, left.squares, alone.squares, strict=True)
    return any(
        share > PREDICTABLE and now > _may_stay(acting, places, criteria) * then
        for acting, share, now, then in discs
    )


def _may_stay(acting: frozenset[str], places: Collection[str] | None, criteria: Criteria) -> float:
    """Of what the rig alone leaves predictable at a disc."""
    named = places is None or not acting.isdisjoint(places)
    return 1.0 - criteria.share if named else ALIKE


def _latents(setting: Setting, fit: Fit, judged: Sequence[Judged]) -> list[Latent]:
    """Residual torques of the fitted and the judged recordings.

    Lost counts are placed in the fitted ones alone.
    """
    told = torques_told(fit.noise, fit.rig)
    found = remaining(setting, fit)
    if not any(isinstance(term.source, LostCounts) for term in fit.terms):
        found += [(one.motion, one.torques) for one in judged]
    return [Latent(motion, torques * told) for motion, torques in found]


def _repeats(latents: Sequence[Latent], fitted: int) -> Repetition | None:
    """What repeats in time in the residual torques, at a phase of its own in each recording.

    Args:
        latents: of the fitted recordings, then of the judged ones.
        fitted: how many were.
    """
    found = []
    for disc in range(2):
        rows = [Residual(one.motion.t, one.torques[:, disc], one.motion.u) for one in latents]
        one = repetition_of(rows[:fitted], rows[fitted:], disc=disc, driven=disc == 0)
        found += [one] if one else []
    return max(found, key=lambda one: one.share, default=None)


def _told(found: Found, latents: Sequence[Latent]) -> Found:
    """The residual torque as a shape over the coordinate that alone predicts most of it."""
    left = found.residual_torque
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
    motions = [one.motion for one in latents]
    shapes = {
        name: shape
        for name in COORDINATES
        if (shape := plain_shape(place, name, motions)) is not None
    }
    if not shapes:
        return found
    name = max(shapes, key=lambda key: share_by(key, latents, values))
    shape = shapes[name]
    column = 0 if place == "upper" else 1
    basis = np.concatenate([shape.slopes(found.final.rig, m)[0][:, column] for m in motions])
    q = np.linalg.lstsq(basis, np.concatenate(values), rcond=None)[0]
    return replace(found, residual_shape=Term(shape, np.asarray(q, dtype=np.float64)))
