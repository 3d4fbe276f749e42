"""A diagnosis by prediction as one page that a lab engineer reads without help."""

from __future__ import annotations

from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from drill_env._types import FloatArray
from drill_env.diagnosis.by_prediction import PredictionDiagnosis
from drill_env.diagnosis.result import FoundShape
from drill_env.integrator.windows import Windows
from drill_env.prediction.cut import Cut
from drill_env.prediction.fit import Fit, errors_of
from drill_env.report._diagnosis_rows import (
    effect_rows,
    grade_rows,
    names_of,
    number_text,
    parameter_rows,
    prediction_rows,
)
from drill_env.report._inline_svg import (
    AFTER,
    BEFORE,
    INK,
    inline,
    legend,
    new_figure,
    page_style,
)

VERDICTS = {
    "consistent": ("good", "Nothing is missing"),
    "parameters": ("note", "Parameters differ, nothing is missing"),
    "missing_physics": ("bad", "Physics is missing from the model"),
    "unexplained": ("bad", "Something is missing that has no name"),
}
# Of the driven disc: a share of the brake's friction is none there.
_UNITS = {"torque": "Nm", "friction": "Nm", "damping": "Nm s/rad"}
_DISCS = ("upper", "lower")
# Windows in a row that are drawn, and rows of each.
_DRAWN, _ROWS = 6, 60


def prediction_page(found: PredictionDiagnosis) -> str:
    """The page, one file that needs no network.

    Args:
        found: from `drill_env.diagnosis.diagnose`.
    """
    page = Environment(
        loader=PackageLoader("drill_env.report", "templates"), autoescape=True,
        trim_blocks=True, lstrip_blocks=True,
    ).get_template("prediction.html")  # fmt: skip
    result = found.result
    tone, title = VERDICTS[result.verdict]
    return page.render(
        result=result, tone=tone, title=title, names=names_of(result), grades=grade_rows(result),
        effects=[effect_rows(e.parameters) for e in result.effects],
        shape=None if result.shape is None else _shape_figure(result.shape),
        criteria=found.fold.setting.criteria, horizon=number_text(float(found.leads[-1]), 2),
        leads=", ".join(f"{lead:.2g}" for lead in found.leads) + " s",
        rounds=prediction_rows(result), figures=_figures(found), parameters=parameter_rows(result),
    )  # fmt: skip


def _figures(found: PredictionDiagnosis) -> list[dict[str, Any]]:
    unseen = found.fold.unseen
    before, after = (errors_of(f, unseen) for f in (found.before, found.after))
    figures: list[dict[str, Any]] = [
        {
            "caption": "Error of the prediction over its time, root mean square of unseen windows",
            "figure": _lead_figure(found.leads, before, after),
        }
    ]
    for disc in range(before.shape[2]):
        figures.append(
            {
                "caption": f"Unseen windows with the largest errors before, {_DISCS[disc]} disc",
                "figure": _windows_figure(found, before, disc),
            }
        )
    return figures


def _lead_figure(leads: FloatArray, before: FloatArray, after: FloatArray) -> Markup:
    with page_style():
        figure = new_figure((1.0,), 2.4)
        axis = figure.axes[0]
        for errors, colour, name in ((before, BEFORE, "before"), (after, AFTER, "after")):
            rms = np.sqrt(np.mean(errors**2, axis=0))
            for disc in range(rms.shape[1]):
                which = f", {_DISCS[disc]}" if rms.shape[1] > 1 else ""
                axis.loglog(
                    leads, rms[:, disc], color=colour, ls=("-", "--")[disc], marker="o", ms=3,
                    label=name + which,
                )  # fmt: skip
        axis.set_xticks(leads, [f"{lead:.2g}" for lead in leads.tolist()])
        axis.set_xticks([], minor=True)
        axis.set_xlabel("time ahead [s]")
        axis.set_ylabel("error [rad]")
        legend(axis)
    return inline(figure, "leads", "error of the prediction over its time")


def _windows_figure(found: PredictionDiagnosis, before: FloatArray, disc: int) -> Markup:
    cut, first = _worst(found.fold.unseen, before[:, -1, disc])
    starts = cut.windows.starts[first : first + _DRAWN]
    last = cut.windows.rows[first : first + _DRAWN, -1]
    rows = np.linspace(starts + 1, last, _ROWS).astype(np.int64).T
    dense = Windows(cut.windows.motion, starts, rows)
    t = cut.samples.t
    with page_style():
        figure = new_figure((1.0,), 2.4)
        axis = figure.axes[0]
        span = slice(int(starts[0]), int(last[-1]) + 1)
        axis.plot(t[span], cut.samples.angles[span, disc], color=INK, lw=1.0, label="measured")
        for fit, colour, name in ((found.before, BEFORE, "before"), (found.after, AFTER, "after")):
            _draw(axis, t, cut, dense, fit, disc, colour, name)
        axis.set_xlabel("time [s]")
        axis.set_ylabel("angle [rad]")
        legend(axis)
    return inline(figure, f"windows-{disc}", "measured and predicted angle")


def _draw(
    axis: Any, t: FloatArray, cut: Cut, dense: Windows, fit: Fit, disc: int, colour: str, name: str
) -> None:
    predicted = cut.predicted(fit.rig, float(fit.vector[-1]), dense)[..., disc]
    for i, row in enumerate(dense.rows):
        axis.plot(t[row], predicted[i], color=colour, lw=1.2, label=name if i == 0 else None)


def _worst(unseen: tuple[Cut, ...], errors: FloatArray) -> tuple[Cut, int]:
    """The recording and its first window of the stretch with the largest errors."""
    best, place = (unseen[0], 0), 0
    most = -1.0
    for cut in unseen:
        count = len(cut.windows.starts)
        own = errors[place : place + count] ** 2
        place += count
        for first in range(max(count - _DRAWN, 0) + 1):
            size = float(own[first : first + _DRAWN].mean())
            if size > most:
                most, best = size, (cut, first)
    return best


def _shape_figure(shape: FoundShape) -> Markup:
    with page_style():
        figure = new_figure((1.0,), 2.2)
        axis = figure.axes[0]
        axis.plot(shape.knots, shape.values, color=AFTER, marker="o", ms=3, lw=1.3)
        axis.set_xlabel(shape.coordinate)
        axis.set_ylabel(f"{shape.sort} [{_UNITS.get(shape.sort, 'share')}]")
    return inline(figure, "shape", "the function that was found")
