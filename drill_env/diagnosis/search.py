"""Search for what is missing: score every candidate, try the best, keep what the data demand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drill_env._watch import Report
from drill_env.diagnosis.attempts import (
    FIRST_ROUNDS,
    best_of_each,
    carried_on,
    confused_with,
    heated,
    settled_within,
    tightened,
    tuned_alike,
    with_resonances_retuned,
)
from drill_env.diagnosis.first_look import Look, first_look
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import own_values
from drill_env.diagnosis.grid_starts import descended, has_peaks
from drill_env.diagnosis.joint_noise import SIZES, TORQUES
from drill_env.diagnosis.linearised import Linearised, linearised_at
from drill_env.diagnosis.lost_counts import broken_counts, slips
from drill_env.diagnosis.rounds import (
    BELIEVED,
    Attempt,
    Round,
    at_its_limit,
    is_named,
    shape_leads,
)
from drill_env.diagnosis.row_times import of_row_times
from drill_env.diagnosis.scan import Scored, score_effects, score_shapes
from drill_env.diagnosis.sensor_starts import sensor_starts
from drill_env.diagnosis.shapes import at_driven_disc, free_shapes
from drill_env.diagnosis.strikes import Strike, faint, named_strikes, score_strikes
from drill_env.diagnosis.terms import Named, Shape
from drill_env.diagnosis.unusual import unusual
from drill_env.diagnosis.waves import Wave, free_waves, score_waves
from drill_env.effects import Effect
from drill_env.prediction.offer import second_gear

# Effects and shapes that get a first look; a rig without what it lacks most scores badly.
_WIDTHS, _LATER_WIDTHS = (12, 5), (7, 3)
_TRIED, _TRIED_SHAPES, _TRIED_WAVES = 6, 3, 2
# Criteria by score that are worth a look: scores fall short of the gain that a fit with its noise
# reaches. Beside what was found more is needed, and where the noise is usual scores are true.
_WORTH, _WORTH_BESIDE, _WORTH_BESIDE_IF_USUAL = -15.0, 0.0, 10.0


def search(
    setting: Setting, fit: Fit, effects: Sequence[Effect], report: Report, *, more: bool = False
) -> Round:
    """Look for one more effect at a fit.

    Args:
        setting: recordings and free parameters.
        fit: where to look.
        effects: the library.
        report: told what is done next, see `Report`.
        more: whether another effect is looked for beside the one that is found here. What leaves
            the noise unusual may be that one: effects that are found by the likelihood itself,
            which takes long, are asked then.
    """
    report("scoring the library")
    linearised = linearised_at(setting, fit)
    others = [effect for effect in effects if _may_join(effect, fit)]
    # Slopes tell little of these; where much is missing the likelihood itself is asked.
    peaked = [effect for effect in others if has_peaks(effect)]
    noise = unusual(setting, fit)
    scores = _scores(linearised, [e for e in others if not noise or e not in peaked], effects)
    done: list[Attempt] = []
    hopeful = _hopeful(linearised, scores, effects, bool(noise))
    starts = _starts(setting, fit, hopeful, report)
    for start in [*starts, *sensor_starts(setting, fit, others)]:
        if report(f"trying {start.terms[-1].id}") and done:
            break
        done.append(carried_on(setting, fit, start, FIRST_ROUNDS))
    done = heated(setting, fit, done, TORQUES if noise else SIZES, report)
    done = settled_within(setting, fit, done, TORQUES if noise else SIZES)
    later = more and any(_believed(a, done) for a in done)
    unknown = shape_leads(done) or (not later and _left_unusual(setting, fit, done))
    asked = peaked if unknown else confused_with(done, peaked)
    done = descended(linearised, asked, done, report)
    complete = not report("comparing what was tried")
    done = tuned_alike(setting, fit, done, others)
    done = with_resonances_retuned(setting, fit, done)
    tight = bool(noise) and _left_unusual(setting, fit, done)
    if tight and not report("trying with the usual noise"):
        done = sorted([*done, *tightened(setting, fit, done, noise)], key=lambda a: -a.gain)
    done = [a for a in best_of_each(done) if not faint(a.term, a.gain)]
    done = [a for a in done if not broken_counts(a.term, setting.samples)]
    done = [a for a in done if not of_row_times(a, setting.samples)]
    return Round(
        fit, tuple(score for kind in scores for score in kind),
        tuple(a for a in done if is_named(a.term) and not at_its_limit(a, done)),
        tuple(a for a in done if not is_named(a.term)), complete=complete,
    )  # fmt: skip


def _may_join(effect: Effect, fit: Fit) -> bool:
    """Whether an effect is not there yet, nor a gear beside the one that the motor is behind."""
    there = [term.source.effect for term in fit.terms if isinstance(term.source, Named)]
    return not second_gear(effect, there) and effect.id not in {term.id for term in fit.terms}


def _scores(
    linearised: Linearised, scored: Sequence[Effect], effects: Sequence[Effect]
) -> tuple[list[Scored], ...]:
    """Scores of names, free shapes, waves and strikes, each the best first.

    Args:
        linearised: where they are taken.
        scored: effects that are.
        effects: the library; what it has is no free wave.
    """
    named = score_effects(linearised, scored, _widths(linearised.fit)[0])
    discs = (1,) if _moved(linearised) else (0, 1)
    return (named, *scores_of_shapes(linearised, effects), score_strikes(linearised, discs=discs))


def scores_of_shapes(
    linearised: Linearised, effects: Sequence[Effect]
) -> tuple[list[Scored], list[Scored]]:
    """Scores of free shapes and of free waves, each the best first.

    Args:
        linearised: where they are taken.
        effects: the library; what it has is no free wave.
    """
    moved = _moved(linearised)
    shapes = free_shapes(linearised.fit.motions, linearised.setting.coordinates.free)
    shapes = tuple(s for s in shapes if not (moved and at_driven_disc(s)))
    waves = free_waves({effect.id for effect in effects}, moved=moved)
    return score_shapes(linearised, shapes), score_waves(linearised, waves)


def _moved(linearised: Linearised) -> bool:
    """Whether the upper disc's motion is the input."""
    return linearised.known[0].samples.recording.drive == "motion"


def _hopeful(
    linearised: Linearised, scores: tuple[list[Scored], ...], effects: Sequence[Effect], noisy: bool
) -> list[Scored]:
    """Candidates by whose scores a look is worth its time; lost counts have no score.

    Args:
        linearised: where the scores were taken.
        scores: of `_scores`.
        effects: the library.
        noisy: whether a latent torque is slow or fast.
    """
    fit, wanted = linearised.fit, {effect.id for effect in effects}
    named, shapes, waves, strikes = scores
    wide, wide_shapes = _widths(fit)
    struck = named_strikes(linearised, strikes, effects)
    likely = (*named[:wide], *shapes[:wide_shapes], *waves, *strikes, *struck)
    least, price = _least(fit, noisy), np.log(fit.count)
    lost = [pair for pair in (slips(linearised, 0), slips(linearised, 1)) if pair is not None]
    return [
        *(s for s in likely if s.gain - s.numbers * price > least),
        *(Scored(*pair) for pair in lost
          if pair[0].id in wanted and pair[1] - len(pair[0].q) * price > 0.0),
    ]  # fmt: skip


def _widths(fit: Fit) -> tuple[int, int]:
    """How many effects and shapes get a first look at a fit."""
    return _LATER_WIDTHS if fit.terms else _WIDTHS


def _left_unusual(setting: Setting, fit: Fit, done: Sequence[Attempt]) -> bool:
    """Whether what is missing still poses as noise beside the best name."""
    best = max((a for a in done if is_named(a.term)), key=lambda a: a.criterion, default=None)
    return bool(unusual(setting, fit if best is None else best.fit))


def _believed(attempt: Attempt, done: Sequence[Attempt]) -> bool:
    """Whether an attempt is an effect beside which another one is looked for."""
    likely = isinstance(attempt.term.source, Named) and attempt.criterion >= BELIEVED
    return likely and not at_its_limit(attempt, done)


def _least(fit: Fit, noisy: bool) -> float:
    """The least criterion by score that is worth a look."""
    if not fit.terms:
        return _WORTH
    return _WORTH_BESIDE if noisy else _WORTH_BESIDE_IF_USUAL


def _starts(setting: Setting, fit: Fit, hopeful: Sequence[Scored], report: Report) -> list[Fit]:
    """Where the candidates of most promise start: names, shapes, waves and strikes."""
    own = own_values(setting, fit)
    looks: list[Look] = []
    for scored in hopeful:
        if report(f"looking at {scored.term.id}") and looks:
            break
        looks.append(first_look(setting, fit, scored, own))
    looks.sort(key=lambda look: -look.gain)
    names = [look for look in looks if is_named(look.term)]
    free = [look for look in looks if not is_named(look.term)]
    waves = [look for look in free if isinstance(look.term.source, Wave)]
    strikes = [look for look in free if isinstance(look.term.source, Strike)]
    shapes = [look for look in free if isinstance(look.term.source, Shape)]
    shapes = [look for look in shapes if look not in strikes]
    best = [*names[:_TRIED], *shapes[:_TRIED_SHAPES], *waves[:_TRIED_WAVES], *strikes[:1]]
    return [look.start(setting, fit) for look in best]
