"""Friction of the lower disc as a diagnosis found it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.diagnosis.rounds import Found
from drill_env.friction import lower_curve
from drill_env.identification.coordinates import inverse
from drill_env.parameters import Rig
from drill_env.report._inline_svg import BEFORE, MEASURED, inline, legend, new_figure, page_style
from drill_env.report.diagnosis_evidence import Points
from drill_env.report.diagnosis_figures import dots_drawn, law_drawn

_DRAWS, _SPEEDS, _SPEED_BINS = 200, 160, 24
_SLOW = 0.05


def friction_figure(found: Found, start: Rig, torques: Sequence[FloatArray]) -> Markup:
    """Friction of the lower disc: given, fitted with its band, and as the recordings show it.

    Args:
        found: the search.
        start: the rig that was given.
        torques: latent torques when all that was found is known, Nm, each of shape (n, 2).
    """
    fit = found.final
    omega = np.concatenate([m.states[:, 2] for m in fit.motions])
    left = np.concatenate([d[:, 1] for d in torques])
    speeds = np.linspace(0.0, float(np.quantile(np.abs(omega), 0.998)), _SPEEDS)
    with page_style():
        figure = new_figure((1.0,), 3.2)
        axis = figure.axes[0]
        axis.plot(speeds, lower_curve(start, speeds), color=BEFORE, ls="--", lw=1.2, label="given")
        low, high = _friction_band(found, speeds)
        law_drawn(axis, Points(speeds, lower_curve(fit.rig, speeds), low, high), "fitted")
        dots_drawn(axis, _measured_friction(fit.rig, omega, left), MEASURED, "o", "recordings")
        axis.set_xlabel("speed of the lower disc [rad/s]")
        axis.set_ylabel("friction torque [Nm]")
        legend(axis)
    return inline(figure, "friction", "friction torque of the lower disc over its speed")


def _measured_friction(rig: Rig, omega: FloatArray, left: FloatArray) -> Points:
    moving = np.abs(omega) > _SLOW
    speed = np.abs(omega[moving])
    torque = lower_curve(rig, speed) - np.sign(omega[moving]) * left[moving]
    if len(speed) < _SPEED_BINS:
        return Points(*(np.zeros(0) for _ in range(4)))
    shares = np.linspace(0.0, 0.998, _SPEED_BINS + 1)
    even = np.linspace(0.0, float(np.quantile(speed, 0.998)), _SPEED_BINS + 1)
    edges = np.unique(0.5 * (np.quantile(speed, shares) + even))
    place = np.clip(np.searchsorted(edges, speed, side="right") - 1, 0, len(edges) - 2)
    count = np.maximum(np.bincount(place, minlength=len(edges) - 1), 1)
    x, y = (np.bincount(place, v, minlength=len(edges) - 1) / count for v in (speed, torque))
    return Points(x, y, y, y)


def _friction_band(found: Found, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    fit, coordinates = found.final, found.setting.coordinates
    free = len(fit.vector)
    values, vectors = np.linalg.eigh(inverse(fit.information)[:free, :free])
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    moved = np.random.default_rng(0).standard_normal((_DRAWS, free)) @ root.T
    curves = [lower_curve(fit.rig, speeds)]
    for vector in fit.vector + moved:
        try:
            curves.append(lower_curve(coordinates.rig(vector), speeds))
        except InputError:
            # A draw past a bound makes no rig.
            continue
    low, high = np.quantile(curves, [0.025, 0.975], axis=0)
    return low, high
