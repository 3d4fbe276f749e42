"""Whether the recordings ask for the humped friction law in place of a simpler one."""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env._watch import Report
from drill_env.diagnosis.attempts import restated
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.held_out import remaining
from drill_env.diagnosis.joint import polished
from drill_env.diagnosis.linearised import linearised_at
from drill_env.diagnosis.residual_torque import PREDICTABLE, Latent, residual_torque_of
from drill_env.diagnosis.rounds import NEEDED, Found
from drill_env.diagnosis.scan import scored_together
from drill_env.diagnosis.search import find
from drill_env.diagnosis.shapes import plain_shape
from drill_env.effects import Effect
from drill_env.friction import lower_curve
from drill_env.identification.coordinates import active_names
from drill_env.identification.samples import Samples
from drill_env.parameters import SYMBOLS, Rig
from drill_env.parameters.rig import LOWER_LAW

# Share of the friction (root mean square) by which a law must bend away from the rig's own to be
# another one. A brake without a hump had 0.0002, one of eddy currents 0.14, the paper's 0.12.
_BENT = 0.01


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


def law_fit(
    samples: Sequence[Samples], rig: Rig, plain: Found, effects: Sequence[Effect], most: int,
    report: Report, doubt: float = 0.05, fixed: Container[str] = (),
) -> tuple[LawFit | None, Found]:  # fmt: skip
    """The search with the humped law, if it is another one, and the search with the rig's own law.

    The second is the given one, or what the first found where its law bends to no hump.

    Args:
        samples: recordings.
        rig: the given one, with a simpler law.
        plain: the search with it.
        effects: the library.
        most: effects that are looked for.
        report: told what is being done.
        doubt: relative standard deviation of the rig's parameters around the start.
        fixed: parameters that are held as given.
    """
    if not _may_bend(plain):
        return None, plain
    humped, freed = _humped(rig, plain.final, fixed)
    kept = {*plain.setting.coordinates.free, *freed}
    free = [n for n in SYMBOLS if n in active_names(humped) & kept]
    # The two laws have not the same parameters, which the criterion of one rig leaves out.
    more = len(free) - len(plain.setting.coordinates.free)
    price = more * math.log(max(plain.final.count, 2))
    setting, base = base_fit(plain.setting.samples, humped, free, doubt)
    alone = replace(setting, over=plain.setting.over), base
    if _left_at_the_brake(plain):
        # The law has the rig's own in it: what it gains, it gains without the names too.
        if plain.base.bic - alone[1].bic <= price:
            return None, plain
    else:
        beside = _beside(*alone, plain)
        if plain.final.bic - beside.bic <= price:
            return None, plain
        near = nearest_of_law(beside.rig, plain.final.rig, _speeds(beside))
        if near is not None:
            return None, _with_own_law(beside, plain, near)
    found = find(samples, humped, free, effects, most=most, doubt=doubt, report=report)
    if report("weighing the laws"):
        # With the other law not everything was tried.
        return None, plain
    gain = plain.final.bic - found.final.bic - price
    if gain < NEEDED:
        return None, plain
    near = nearest_of_law(found.final.rig, plain.final.rig, _speeds(found.final))
    if near is None:
        return LawFit(plain.setting, plain.base, found, gain), plain
    return None, _with_own_law(found.final, plain, near)


def _humped(rig: Rig, own: Fit, fixed: Container[str]) -> tuple[Rig, list[str]]:
    """The rig with the paper's law, as strong as its own is fitted, and what of it is free."""
    paper, speeds = Rig.paper(), _speeds(own)
    freed = [name for name in LOWER_LAW if name not in fixed]
    sizes = [float(np.linalg.norm(lower_curve(one, speeds))) for one in (own.rig, paper)]
    level = sizes[0] / sizes[1] if min(sizes) > 0.0 else 1.0
    law = {name: getattr(paper, name) for name in freed}
    law |= {name: level * law[name] for name in law if name not in ("beta1", "beta2")}
    return rig.replace(friction="humped", **law), freed


def nearest_of_law(rig: Rig, own: Rig, speeds: FloatArray) -> Rig | None:
    """A rig with another one's law in place of its own; None where its own bends away from that.

    Args:
        rig: with the humped law.
        own: with a simpler one.
        speeds: of the lower disc, rad/s, shape (n,).
    """
    curve = lower_curve(rig, speeds)
    columns = {"Tsl": np.ones_like(speeds), "bl": speeds}
    if own.friction == "stribeck":
        columns["T1"] = 1.0 - np.exp(-own.beta1 * speeds)
    basis = np.column_stack(list(columns.values()))
    values = np.linalg.lstsq(basis, curve, rcond=None)[0]
    bent = float(np.linalg.norm(curve - basis @ values))
    if bent > _BENT * float(np.linalg.norm(curve)):
        return None
    law = dict(zip(columns, values.tolist(), strict=True))
    kept = {name: getattr(own, name) for name in LOWER_LAW} | law
    try:
        return rig.replace(friction=own.friction, **kept)
    except InputError:
        return None


def _speeds(fit: Fit) -> FloatArray:
    """Speeds (rad/s) of the lower disc while it turns."""
    speeds = np.abs(np.concatenate([motion.states[:, 2] for motion in fit.motions]))
    return speeds[speeds > 0.0]


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


def _may_bend(plain: Found) -> bool:
    """Whether a free function of the lower disc's speed may gain what any effect must gain.

    Any law of the brake is such a function, and needs more of gain for its numbers. The gain is
    expected from the slopes at the fit (Rao, Proceedings of the Cambridge Philosophical Society 44,
    1948), with what the fit itself may still gain; fits take a hundred times as long.
    """
    fit = plain.final
    brake = plain_shape("lower", "omega_l", fit.motions)
    if brake is None:
        return False
    linearised = linearised_at(plain.setting, fit)
    own = float(fit.gradient @ linearised.cross @ fit.gradient) / linearised.dispersion
    return own + scored_together(linearised, [brake])[0].gain >= NEEDED


def _left_at_the_brake(plain: Found) -> bool:
    """Whether the motion predicts what a simpler law leaves over at the lower disc."""
    fit, setting = plain.final, plain.setting
    left = residual_torque_of([Latent(*one) for one in remaining(setting, fit)])
    return left.shares[1] > PREDICTABLE


def _beside(setting: Setting, alone: Fit, plain: Found) -> Fit:
    """The humped law, fitted alone, beside what was found with a simpler one.

    A search of its own takes several times as long as this.
    """
    fit = plain.final
    if not fit.terms:
        return alone
    here = evaluate(setting, alone.vector, fit.terms, fit.noise, fit.starts, fit.motions)
    return polished(setting, here)
