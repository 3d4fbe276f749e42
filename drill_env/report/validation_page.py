"""The validation of a fitted rig as one page and as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
from jinja2 import Environment
from plotly.offline import get_plotlyjs

from drill_env._files import write_text
from drill_env._types import PathLike
from drill_env.identification.coordinates import active_names
from drill_env.identification.estimate import Estimate
from drill_env.identification.estimate_file import estimate_document
from drill_env.identification.knowledge import knowledge_of, residual_shape
from drill_env.identification.laws import LawComparison
from drill_env.identification.validation import Validation
from drill_env.parameters import SYMBOLS
from drill_env.report._validation_template import PAGE
from drill_env.report.validation_figures import (
    correlation_curves,
    correlation_figure,
    friction_band,
    friction_figure,
    traces_figure,
)

_NOISE = (
    ("torque_u", "Nm", "torque on the upper disc"),
    ("torque_l", "Nm", "torque on the lower disc"),
    ("tau_u", "s", "correlation time of the upper torque"),
    ("tau_l", "s", "correlation time of the lower torque"),
    ("encoder_u", "rad", "upper encoder"),
    ("encoder_l", "rad", "lower encoder"),
    ("speed_u", "rad/s", "upper velocity"),
    ("speed_l", "rad/s", "lower velocity"),
)


def validation_summary(
    estimate: Estimate, validations: Sequence[Validation], laws: LawComparison | None = None
) -> dict[str, Any]:
    """Everything on the page but the curves, plain values for JSON.

    Args:
        estimate: the fit.
        validations: of the recordings of the fit and of others.
        laws: comparison of friction laws.
    """
    summary: dict[str, Any] = {
        "estimate": estimate_document(estimate),
        "residual_shape": residual_shape(knowledge_of(estimate)),
        "recordings": [
            {**validation.as_dict(), "role": _role(estimate, validation)}
            for validation in validations
        ],
        "laws": laws.as_dict() if laws is not None else None,
    }
    if estimate.rig.inertias == 2:
        top = _top_speed(validations)
        _, middle, low, high = friction_band(estimate, top)
        summary["friction_curve"] = {
            "to_rad_per_s": top,
            "half_width_percent_of_peak": float(50.0 * (high - low).max() / np.abs(middle).max()),
        }
    return _plain(summary)


def save_validation_page(
    estimate: Estimate,
    validations: Sequence[Validation],
    path: PathLike,
    laws: LawComparison | None = None,
) -> None:
    """Write the page, one file that needs no network.

    Args:
        estimate: the fit.
        validations: of the recordings of the fit and of others.
        path: page to write.
        laws: comparison of friction laws.

    Raises:
        InputError: the file cannot be written.
    """
    template = Environment(autoescape=True).from_string(PAGE)
    whole = estimate.rig.inertias == 2
    text = template.render(
        estimate=estimate,
        fitted=len(estimate.problem.samples),
        parameters=_parameter_rows(estimate),
        noise=_noise_rows(estimate),
        residual_shape=residual_shape(knowledge_of(estimate)),
        plotly=get_plotlyjs(),
        correlation=_html(correlation_figure(estimate)),
        friction=_html(friction_figure(estimate, _top_speed(validations))) if whole else "",
        recordings=[
            {**_errors(validation), **_section(estimate, validation)} for validation in validations
        ],
        laws=_law_rows(laws) if laws is not None else None,
        comparison=laws,
    )
    write_text(Path(path), text)


def _html(figure: go.Figure) -> str:
    return figure.to_html(
        full_html=False,
        include_plotlyjs=False,
        config={"responsive": True, "displayModeBar": False},
    )


def _role(estimate: Estimate, validation: Validation) -> str:
    fitted = any(s.recording is validation.recording for s in estimate.problem.samples)
    return "fit" if fitted else "held out"


def _top_speed(validations: Sequence[Validation]) -> float:
    """Highest speed (rad/s) of the lower disc, by the filters; 10 where nothing was recorded."""
    return max((float(np.abs(v.trace.state[:, 2]).max()) for v in validations), default=10.0)


def _parameter_rows(estimate: Estimate) -> list[dict[str, str]]:
    units = {item.name: item.metadata.get("unit", "") for item in fields(estimate.rig)}
    intervals = estimate.intervals()
    rows = []
    for name in SYMBOLS:
        value = getattr(estimate.rig, name)
        if name in intervals:
            low, high = intervals[name]
            share = 50.0 * (high - low) / abs(value) if value else math.nan
            width = f"{share:.0f} %" if share >= 10.0 else _percent(share)
            between = f"{low:.5g} … {high:.5g}"
        elif name in active_names(estimate.rig):
            between, width = "given", ""
        else:
            continue
        rows.append(
            {
                "name": name,
                "value": f"{value:.5g}",
                "unit": units[name],
                "between": between,
                "width": width,
            }
        )
    return rows


def _noise_rows(estimate: Estimate) -> list[dict[str, Any]]:
    velocities = any(s.recording.velocities() for s in estimate.problem.samples)
    return [
        {
            "what": what,
            "unit": unit,
            "values": [f"{getattr(m, key):.3g}" for m in estimate.point.noise],
        }
        for key, unit, what in (_NOISE if velocities else _NOISE[:6])
    ]


def _errors(validation: Validation) -> dict[str, Any]:
    result, tests = validation.replay, validation.residuals
    rows = []
    for name, error in result.errors.items():
        short = result.prediction_errors[name]
        rows.append(
            {
                "channel": name,
                "free": f"{error.rms:.3g}",
                "free_share": _percent(error.percent),
                "predicted": f"{short.rms:.3g}",
                "predicted_share": _percent(short.percent),
                "size": f"{tests[name].rms:.3f}" if name in tests else "",
            }
        )
    return {"errors": rows}


def _percent(value: float) -> str:
    return f"{value:.2g} %" if math.isfinite(value) else ""


def _section(estimate: Estimate, validation: Validation) -> dict[str, Any]:
    tests = [
        {
            "channel": name,
            "outside": f"{100 * test.outside:.1f} %",
            "p_white": _p(test.p_white),
            "peak": f"{test.peak_hz:.3g} Hz, {test.peak:.3g} times",
            "p_peak": _p(test.p_peak),
            "cross_outside": f"{100 * test.cross_outside:.1f} %"
            if len(test.cross)
            else "constant u",
            "cross_largest": f"{test.cross_largest[1]:+.3f} at {test.cross_largest[0]:.3g} s",
            "p_cross": _p(test.p_cross),
        }
        for name, test in validation.residuals.items()
    ]
    judged = bool(validation.residuals)
    return {
        "name": validation.name,
        "role": _role(estimate, validation),
        "verdict": validation.verdict,
        "notes": [str(note) for note in validation.replay.notes],
        "noise": {k: f"{v:.3g}" for k, v in asdict(validation.noise).items()},
        "estimated": validation.noise_estimated,
        "traces": _html(traces_figure(validation)),
        "auto": _html(correlation_curves(validation, voltage=False)) if judged else "",
        "cross": _html(correlation_curves(validation, voltage=True)) if judged else "",
        "tests": tests,
    }


def _p(value: float) -> str:
    if not math.isfinite(value):
        return ""
    return f"{value:.3f}" if value >= 0.001 else "below 0.001"


def _law_rows(laws: LawComparison) -> list[dict[str, str]]:
    rows = []
    for fit in laws.fits:
        found = fit.vibration
        can = fit.remark
        if found is not None:
            volts = f"{found.volts[0]:.2f} to {found.volts[1]:.2f} V" if found.volts else "yes"
            can = volts if found.exists else "none"
        row = {"law": fit.law, "free": str(len(fit.estimate.free)), "can": can}
        row["bic"] = f"{fit.estimate.bic:.0f}"
        row["gap"] = f"{laws.gap(fit.law):.0f}"
        for name in ("theta_u", "theta_l"):
            row[f"{name}_free"] = f"{fit.error(name, free_run=True):.3g}"
            row[f"{name}_predicted"] = f"{fit.error(name, free_run=False):.3g}"
        row["soft"] = f"{100 * fit.soft:.0f} %" if math.isfinite(fit.soft) else ""
        rows.append(row)
    return rows


def _plain(value: Any) -> Any:
    """The same with None for what JSON cannot say."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value
