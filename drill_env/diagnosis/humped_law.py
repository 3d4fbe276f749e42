"""The humped friction law in place of a simpler one: the rig alone with it, and its distance."""

from __future__ import annotations

import math
from collections.abc import Container
from dataclasses import dataclass, replace

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.diagnosis.base import AGAIN, base_fit
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.friction import lower_curve
from drill_env.identification.coordinates import active_names
from drill_env.parameters import SYMBOLS, Rig
from drill_env.parameters.rig import LOWER_LAW

# Share of the friction (root mean square) by which a law must bend away from the rig's own to be
# another one. A brake without a hump had 0.0002, one of eddy currents 0.14, the paper's 0.12.
_BENT = 0.01


@dataclass(frozen=True, slots=True, eq=False)
class HumpedAlone:
    """The rig alone, fitted with the humped law.

    Attributes:
        setting: recordings and free parameters.
        fit: of these.
        price: what the criterion asks for the parameters that the simpler law has not.
    """

    setting: Setting
    fit: Fit
    price: float

    def gain(self, own: Fit) -> float:
        """Of the information criterion over a fit with the simpler law."""
        return own.bic - self.fit.bic - self.price


def humped_alone(
    setting: Setting, own: Fit, fixed: Container[str], again: int = AGAIN
) -> HumpedAlone:
    """The rig alone with the paper's law.

    Args:
        setting: recordings and free parameters with its own law.
        own: a fit with that.
        fixed: parameters that are held as given.
        again: how often the descent may begin again.
    """
    rig, freed = _humped(own, fixed)
    kept = {*setting.coordinates.free, *freed}
    free = [n for n in SYMBOLS if n in active_names(rig) & kept]
    # The two laws have not the same parameters, which the criterion of one rig leaves out.
    more = len(free) - len(setting.coordinates.free)
    there, fit = base_fit(setting.samples, rig, free, setting.doubt, again)
    there = replace(there, over=setting.over, jitter=setting.jitter)
    return HumpedAlone(there, fit, more * math.log(max(own.count, 2)))


def _humped(own: Fit, fixed: Container[str]) -> tuple[Rig, list[str]]:
    """The rig with the paper's law, as strong as its own is fitted, and what of it is free."""
    paper, speeds = Rig.paper(), speeds_of(own)
    freed = [name for name in LOWER_LAW if name not in fixed]
    sizes = [float(np.linalg.norm(lower_curve(one, speeds))) for one in (own.rig, paper)]
    level = sizes[0] / sizes[1] if min(sizes) > 0.0 else 1.0
    law = {name: getattr(paper, name) for name in freed}
    law |= {name: level * law[name] for name in law if name not in ("beta1", "beta2")}
    return own.rig.replace(friction="humped", **law), freed


def near_own_law(humped: Fit, own: Fit) -> Rig | None:
    """A rig of one fit with the law of another, where its own bends to that."""
    return nearest_of_law(humped.rig, own.rig, speeds_of(humped))


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


def speeds_of(fit: Fit) -> FloatArray:
    """Speeds (rad/s) of the lower disc while it turns."""
    speeds = np.abs(np.concatenate([motion.states[:, 2] for motion in fit.motions]))
    return speeds[speeds > 0.0]
