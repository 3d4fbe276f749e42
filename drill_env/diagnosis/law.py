"""Whether the recordings ask for the humped friction law in place of a simpler one."""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, replace
from functools import partial

from drill_env._watch import Report, left_by, over_by, stopwatch
from drill_env.diagnosis.attempts import restated
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.find import find_beside
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.held_out import remaining
from drill_env.diagnosis.humped_law import HumpedAlone, humped_alone, near_own_law
from drill_env.diagnosis.joint import polished
from drill_env.diagnosis.linearised import linearised_at
from drill_env.diagnosis.residual_torque import PREDICTABLE, Latent, residual_torque_of
from drill_env.diagnosis.rounds import NEEDED, Found, nameless, place_of
from drill_env.diagnosis.scan import scored_together
from drill_env.diagnosis.search import scores_of_shapes
from drill_env.diagnosis.shapes import plain_shape
from drill_env.diagnosis.unusual import unusual
from drill_env.effects import Effect
from drill_env.parameters import Rig

# Where the brake's law acts.
_BRAKE = ("lower", "omega_l")


@dataclass(frozen=True, slots=True, eq=False)
class LawFit:
    """A search with the humped law.

    Attributes:
        setting: of the fit before.
        before: the rig with its own law, fitted.
        found: the search with the humped law.
        gain: of the information criterion over the search with its own law.
    """

    setting: Setting
    before: Fit
    found: Found
    gain: float


def find_with_laws(
    setting: Setting, base: Fit, effects: Sequence[Effect], most: int, report: Report,
    fixed: Container[str] = (), named: Callable[[], None] = lambda: None,
) -> tuple[LawFit | None, Found]:  # fmt: skip
    """What a rig with a simpler law lacks: the humped law, or what is found with its own.

    Where the rig is better off with the humped law alone, that is searched first: beside a wrong
    law of the brake many names gain, and all the time would go on them. Its own law is searched
    for what may take its place, if the time is left that the first search took.

    Args:
        setting: recordings and free parameters.
        base: the rig with its own law, fitted.
        effects: the library.
        most: effects that are looked for.
        report: told what is being done.
        fixed: parameters that are held as given.
        named: called once a name leads.

    Returns:
        The search with the humped law, if it is another one, and the search with the rig's own.
    """
    search = partial(find_beside, report=report, named=named)
    find = partial(search, effects=effects, most=most)
    setting = replace(setting, over=over_by(report))
    report("asking for another friction law")
    humped = _leading(setting, base, effects, fixed)
    if humped is None:
        plain = find(setting, base)
        if report("trying another friction law"):
            return None, plain
        return law_fit(plain, find, report, fixed)
    clock = stopwatch()
    found = find(humped.setting, humped.fit)
    if not _gains_beside(humped, setting, base, _led_to(found)):
        return None, find(setting, base)
    plain = Found(setting, base, (), base)
    if left_by(report) > clock():
        plain = search(setting, base, *_rivals(found, effects, most))
    return _other_law(plain, found, humped)


def _leading(
    setting: Setting, base: Fit, effects: Sequence[Effect], fixed: Container[str]
) -> HumpedAlone | None:
    """The rig alone with the humped law, where it is another one and leads all free shapes."""
    if not _may_bend(setting, base):
        return None
    # One descent tells; those that begin again take as long each.
    gain = humped_alone(setting, base, fixed, again=0).gain(base)
    if gain < NEEDED or gain < _of_free_shapes(setting, base, effects):
        return None
    humped = humped_alone(setting, base, fixed)
    return humped if near_own_law(humped.fit, base) is None else None


def _of_free_shapes(setting: Setting, base: Fit, effects: Sequence[Effect]) -> float:
    """What the best free shape gains by its score, and what any effect must gain."""
    shapes, waves = scores_of_shapes(linearised_at(setting, base), effects)
    return max([NEEDED, *(scored.gain for scored in (*shapes, *waves))])


def _led_to(found: Found) -> Fit:
    """What a search came to: its names, or a shape that explains clearly more.

    A free function of the brake's speed is no rival of its law, but what that is to explain.
    """
    first = found.rounds[0] if found.rounds else None
    if first is None or first.best is None or not nameless(first):
        return found.final
    return found.final if place_of(first.best.term) == _BRAKE else first.best.fit


def _gains_beside(humped: HumpedAlone, setting: Setting, base: Fit, fit: Fit) -> bool:
    """Whether the humped law is needed beside what was found with it.

    Args:
        humped: the rig alone with it.
        setting: with the rig's own law.
        base: the rig alone with that.
        fit: with the humped law and what was found.
    """
    if not fit.terms:
        return True
    own = evaluate(setting, base.vector, fit.terms, fit.noise, fit.starts, fit.motions)
    return polished(setting, own).bic - fit.bic - humped.price >= NEEDED


def _rivals(
    found: Found, effects: Sequence[Effect], most: int
) -> tuple[Sequence[Effect], int]:  # fmt: skip
    """The names, and how many, that may do without the humped law what was found with it.

    Where the law leaves nothing but noise, another model may do as much and no more. Then it is the
    same function of the lower disc's speed, or has one as a limit.
    """
    tried = found.rounds and found.rounds[0].complete
    if not tried or found.final.terms or unusual(found.setting, found.final):
        return effects, most
    return [e for e in effects if (e.component, e.depends_on) == _BRAKE], min(most, 1)


def law_fit(
    plain: Found, find: Callable[[Setting, Fit], Found], report: Report,
    fixed: Container[str] = (),
) -> tuple[LawFit | None, Found]:  # fmt: skip
    """The search with the humped law, if it is another one, and the search with the rig's own law.

    The second is the given one, or what the first found where its law bends to no hump.

    Args:
        plain: the search with the rig's own law.
        find: searches a rig that is fitted alone.
        report: told what is being done.
        fixed: parameters that are held as given.
    """
    own = _led_to(plain)
    if not _may_bend(plain.setting, own):
        return None, plain
    humped = humped_alone(plain.setting, own, fixed)
    if own is plain.final and _left_at_the_brake(plain):
        # The law has the rig's own in it: what it gains, it gains without the names too.
        if humped.gain(plain.base) <= 0.0:
            return None, plain
    else:
        beside = _beside(humped, own)
        if own.bic - beside.bic <= humped.price:
            return None, plain
        near = near_own_law(beside, own)
        if near is not None:
            same = own is plain.final
            return None, _with_own_law(beside, plain, near) if same else plain
    found = find(humped.setting, humped.fit)
    if report("weighing the laws"):
        # With the other law not everything was tried.
        return None, plain
    return _other_law(plain, found, humped)


def _other_law(plain: Found, found: Found, humped: HumpedAlone) -> tuple[LawFit | None, Found]:
    """The search with the humped law where it gains enough and bends away from the rig's own."""
    gain = _led_to(plain).bic - _led_to(found).bic - humped.price
    if gain < NEEDED:
        return None, plain
    near = near_own_law(found.final, plain.final)
    if near is None:
        return LawFit(plain.setting, plain.base, found, gain), plain
    return None, _with_own_law(found.final, plain, near)


def _with_own_law(fit: Fit, plain: Found, rig: Rig) -> Found:
    """What a fit with the humped law found, under the rig's own, if that does better.

    Names that the search with the rig's own law never tried have no chance there: they stay out.
    """
    same = {t.id for t in fit.terms} == {t.id for t in plain.final.terms}
    if len(fit.terms) > 1 and not same:
        return plain
    setting = plain.setting
    vector = setting.coordinates.vector(rig)
    here = evaluate(setting, vector, fit.terms, fit.noise, fit.starts, fit.motions)
    here = polished(setting, here)
    if not here.bic < plain.final.bic:
        return plain
    found = replace(plain, final=here)
    if not same and here.terms and found.rounds:
        rounds = (restated(found.rounds[0], here), *found.rounds[1:])
        found = replace(found, rounds=rounds)
    return found


def _may_bend(setting: Setting, fit: Fit) -> bool:
    """Whether a free function of the lower disc's speed may gain what any effect must gain.

    Any law of the brake is such a function, and needs more of gain for its numbers. The gain is
    expected from the slopes at the fit (Rao, Proceedings of the Cambridge Philosophical Society 44,
    1948), with what the fit itself may still gain; fits take a hundred times as long.
    """
    brake = plain_shape("lower", "omega_l", fit.motions)
    if brake is None:
        return False
    linearised = linearised_at(setting, fit)
    own = float(fit.gradient @ linearised.cross @ fit.gradient) / linearised.dispersion
    return own + scored_together(linearised, [brake])[0].gain >= NEEDED


def _left_at_the_brake(plain: Found) -> bool:
    """Whether the motion predicts what a simpler law leaves over at the lower disc."""
    fit, setting = plain.final, plain.setting
    left = residual_torque_of([Latent(*one) for one in remaining(setting, fit)])
    return left.shares[1] > PREDICTABLE


def _beside(humped: HumpedAlone, fit: Fit) -> Fit:
    """The humped law, fitted alone, beside what was found with a simpler one.

    A search of its own takes several times as long as this.
    """
    alone, setting = humped.fit, humped.setting
    if not fit.terms:
        return alone
    here = evaluate(setting, alone.vector, fit.terms, fit.noise, fit.starts, fit.motions)
    return polished(setting, here)
