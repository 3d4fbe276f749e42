"""The drawings of a diagnosis: where it sits, the law, and held-out recordings."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup

from drill_env._types import FloatArray
from drill_env.diagnosis.held_out import Judged
from drill_env.effects.along import Motion
from drill_env.report._inline_svg import (
    AFTER,
    BEFORE,
    INK,
    MEASURED,
    SHADE,
    SOFT,
    extremes,
    inline,
    legend,
    new_figure,
    page_style,
)
from drill_env.report.diagnosis_evidence import Evidence, Points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_DISCS = ("upper", "lower")
_SHOWN = 8.0


def recording_figure(
    motion: Motion, torques: FloatArray, seen: Evidence | None, place: int,
    intervals: Sequence[Sequence[float]], *, inertias: int,
) -> Markup:  # fmt: skip
    """One fitted recording: speeds, and what is missing over time.

    Args:
        motion: of the discs.
        torques: latent torques when all that was found is known, Nm, shape (n, 2).
        seen: the term that is shown, if one was found.
        place: of the recording in `seen`.
        intervals: times between which the mismatch is large, shaded, s.
        inertias: of the rig.
    """
    reading = seen is not None and seen.senses
    with page_style():
        figure = new_figure((1.0, 1.0, 0.7) if reading else (1.0, 1.0), 3.6 if reading else 3.0)
        speeds, lower = figure.axes[:2]
        for disc, colour in ((0, MEASURED), (1, AFTER))[:inertias]:
            _line(speeds, motion.t, motion.states[:, 1 + disc], colour, f"{_DISCS[disc]} disc")
        speeds.set_ylabel("speed [rad/s]")
        legend(speeds)
        _missing(lower, motion.t, torques, seen, place, inertias)
        if seen is not None and reading:
            _line(figure.axes[2], motion.t, seen.acts[place], AFTER, "misreading found")
            figure.axes[2].set_ylabel("error [rad]")
            legend(figure.axes[2])
        for axis in figure.axes:
            for begin, end in intervals:
                axis.axvspan(begin, end, color=SHADE, alpha=0.3, lw=0, zorder=0)
        figure.axes[-1].set_xlabel("time [s]")
        figure.axes[-1].set_xlim(float(motion.t[0]), float(motion.t[-1]))
    return inline(figure, f"recording-{place}", "speeds and missing torque over time")


def _missing(
    axis: Axes, t: FloatArray, torques: FloatArray, seen: Evidence | None, place: int, inertias: int
) -> None:
    if seen is None:
        for disc, colour in ((0, MEASURED), (1, AFTER))[:inertias]:
            _line(axis, t, torques[:, disc], colour, f"on the {_DISCS[disc]} disc")
        axis.set_ylabel("torque left [Nm]")
    else:
        _line(axis, t, seen.left[place], SOFT, "residual")
        _line(axis, t, seen.without[place], BEFORE, "not in the model", width=1.5)
        if not seen.senses:
            _line(axis, t, seen.acts[place], AFTER, _short(seen.term.id))
        axis.set_ylabel(f"{_DISCS[seen.disc]} torque [Nm]")
    legend(axis)


def law_figure(seen: Evidence, number: int) -> Markup:
    """Latent torque over the coordinate that explains it, with the fitted law.

    Args:
        seen: of one term.
        number: of the term.
    """
    reading = seen.senses
    with page_style():
        figure = new_figure((1.0, 1.0) if reading else (1.0,), 4.2 if reading else 3.2)
        axis = figure.axes[0]
        if reading:
            law_drawn(figure.axes[1], seen.law, "fitted law")
            figure.axes[1].set_ylabel("misreading [rad]")
            legend(figure.axes[1])
        else:
            law_drawn(axis, seen.law, "fitted law")
        dots_drawn(axis, seen.points, BEFORE, "o", "missing torque")
        dots_drawn(axis, seen.rest, SOFT, "s", "residual")
        what = f"torque {seen.turned} [Nm]" if seen.turned else "torque [Nm]"
        axis.set_ylabel(f"{_DISCS[seen.disc]} disc: {what}")
        legend(axis)
        figure.axes[-1].set_xlabel(seen.coordinate)
    return inline(figure, f"law-{number}", "missing torque over its coordinate")


def held_out_figure(before: Judged, after: Judged, number: int) -> Markup:
    """Measured beside simulated, before and after, where the error before was largest.

    Args:
        before: under the rig alone.
        after: with what was found.
        number: of the recording.
    """
    t = after.motion.t
    known = [bool(np.isfinite(after.measured[:, disc]).any()) for disc in (0, 1)]
    gap = np.nan_to_num(before.short - before.measured, posinf=0.0, neginf=0.0)
    rows = _window(t, (gap**2).sum(axis=1))
    series, label = _shown(after, known, rows)
    with page_style():
        figure = new_figure((1.0,), 2.4)
        axis = figure.axes[0]
        for values, colour, style, name in (
            (before.short, BEFORE, "-", "before"), (after.short, AFTER, "-", "after"),
            (after.measured, INK, "--", "measured"),
        ):  # fmt: skip
            axis.plot(t[rows], series(values), color=colour, ls=style, lw=1.1, label=name)
        axis.set_ylabel(label)
        axis.set_xlabel("time [s]")
        legend(axis)
    return inline(figure, f"held-{number}", "measured and simulated motion")


def _shown(
    judged: Judged, known: Sequence[bool], rows: slice
) -> tuple[Callable[[FloatArray], FloatArray], str]:
    """What is drawn of the readings, and its label; whole turns would hide the vibration."""
    words = [_words(name) for name in judged.channels]
    if all(known) and words[0] == words[1]:
        return (lambda a: a[rows, 0] - a[rows, 1]), f"upper less lower {words[0]}"
    disc = 0 if known[0] and not known[1] else 1
    return (lambda a: a[rows, disc]), f"{_DISCS[disc]} {words[disc]}"


def _words(channel: str) -> str:
    return "speed [rad/s]" if channel.startswith("omega") else "angle [rad]"


def _window(t: FloatArray, size: FloatArray) -> slice:
    total = np.concatenate([[0.0], np.cumsum(size)])
    ends = np.searchsorted(t, t + _SHOWN)
    whole = t + _SHOWN <= t[-1]
    score = np.where(whole, total[ends] - total[:-1], -1.0)
    begin = int(np.argmax(score)) if whole.any() else 0
    return slice(begin, int(ends[begin]))


def errors_figure(
    before: Judged, after: Judged, floors: Sequence[float | None], number: int
) -> Markup:
    """Errors of the 5 s predictions over the whole recording, with the band of the noise.

    Args:
        before: under the rig alone.
        after: with what was found.
        floors: root mean square that noise alone gives, rad or rad/s, of each channel.
        number: of the recording.
    """
    discs = [i for i in (0, 1) if np.isfinite(after.measured[:, i]).any()]
    t = after.motion.t
    with page_style():
        figure = new_figure((1.0,) * len(discs), 0.8 + 1.6 * len(discs))
        for axis, disc in zip(figure.axes, discs, strict=True):
            for judged, colour, name in ((before, BEFORE, "before"), (after, AFTER, "after")):
                gap = judged.short[:, disc] - judged.measured[:, disc]
                _line(axis, t, np.where(np.isfinite(gap), gap, np.nan), colour, name)
            floor = floors[disc]
            if floor is not None and math.isfinite(floor):
                axis.axhspan(
                    -2 * floor, 2 * floor, color=SHADE, alpha=0.35, lw=0, label="noise alone"
                )
            unit = "rad/s" if after.channels[disc].startswith("omega") else "rad"
            axis.set_ylabel(f"{_DISCS[disc]} error [{unit}]")
            legend(axis)
        figure.axes[-1].set_xlabel("time [s]")
        figure.axes[-1].set_xlim(float(t[0]), float(t[-1]))
    return inline(figure, f"errors-{number}", "errors of the predictions over time")


def _line(
    axis: Axes, t: FloatArray, values: FloatArray, colour: str, label: str, width: float = 0.8
) -> None:
    rows = extremes(values)
    axis.plot(t[rows], values[rows], color=colour, lw=width, label=label)


def law_drawn(axis: Axes, law: Points, label: str) -> None:
    """A curve with its band."""
    axis.fill_between(law.x, law.low, law.high, color=AFTER, alpha=0.3, lw=0, label="95 % band")
    axis.plot(law.x, law.mean, color=AFTER, lw=1.5, label=label)


def dots_drawn(axis: Axes, points: Points, colour: str, marker: str, label: str) -> None:
    """Means with bars."""
    axis.errorbar(
        points.x, points.mean, yerr=[points.mean - points.low, points.high - points.mean],
        fmt=marker, color=colour, ms=3.0, lw=0.9, label=label,
    )  # fmt: skip


def _short(name: str) -> str:
    return name.replace("_", " ")
