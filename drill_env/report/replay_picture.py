"""A replay drawn in the manner of the paper's Figure 3."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from drill_env._errors import InputError
from drill_env._files import replacing
from drill_env._types import FloatArray, PathLike
from drill_env.identification.drive import UNIT
from drill_env.identification.replay import ReplayResult
from drill_env.report.names import drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_KINDS = (".png", ".pdf", ".svg", ".jpg", ".jpeg", ".webp")
_LABELS = {
    "theta_u": r"$\theta_u$", "theta_l": r"$\theta_l$",
    "omega_u": r"$\omega_u$", "omega_l": r"$\omega_l$",
}  # fmt: skip
_MEASURED, _SIMULATED, _PREDICTED = "#1f3b73", "#d1495b", "#edae49"


def replay_figure(result: ReplayResult) -> Figure:
    """Voltage, then each channel measured and simulated with its error below."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    channels = list(result.simulated)
    heights = [1.0] + [2.0, 1.0] * len(channels)
    figure = Figure(figsize=(9.0, 1.2 * sum(heights) + 1.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    t = result.recording.t
    axes[0].step(t, result.recording.channel("u"), where="post", color="0.2", lw=0.8)
    axes[0].set_ylabel(f"u [{UNIT[result.recording.drive]}]")
    unit = "rad" if result.rig.inertias == 2 else "unit of position"
    for i, name in enumerate(channels):
        measured = result.recording.channel(name)
        label = f"{_LABELS[name]} [{unit}{'/s' if name.startswith('omega') else ''}]"
        _traces(axes[1 + 2 * i], t, measured, result.simulated[name], label)
        _error(axes[2 + 2 * i], result, i, measured)
    for axis in axes:
        axis.grid(alpha=0.25)
    axes[-1].set_xlabel("time [s]")
    figure.suptitle(_title(result), fontsize="medium")
    return figure


def _traces(
    axis: Axes, t: FloatArray, measured: FloatArray, simulated: FloatArray, label: str
) -> None:
    axis.plot(t, measured, color=_MEASURED, lw=1.4, label="recording")
    axis.plot(t, simulated, color=_SIMULATED, lw=1.0, ls="--", label="simulation")
    axis.set_ylabel(label)
    _legend(axis)


def _error(axis: Axes, result: ReplayResult, index: int, measured: FloatArray) -> None:
    name = list(result.simulated)[index]
    t = result.recording.t
    axis.axhline(0.0, color="0.6", lw=0.6)
    axis.plot(t, measured - result.simulated[name], color=_SIMULATED, lw=0.9, label="free run")
    if name in result.predicted:
        axis.plot(
            t, measured - result.predicted[name], color=_PREDICTED, lw=0.9,
            label=f"restarted every {result.horizon:g} s",
        )  # fmt: skip
    axis.set_ylabel("error")
    _legend(axis)


def _legend(axis: Axes) -> None:
    # Above the axes, where it covers no trace.
    axis.legend(
        loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, fontsize="small", frameon=False
    )


def _title(result: ReplayResult) -> str:
    parts = [
        f"{_LABELS[name]}: {error.rms:.3g} rms, {error.percent:.2f} % of range"
        for name, error in result.errors.items()
    ]
    if result.force_error is not None:
        parts.append(f"force error {100 * result.force_error:.2f} %")
    return f"{drawn(Path(result.recording.source).name)}: " + "; ".join(parts)


def save_replay_picture(result: ReplayResult, path: PathLike) -> None:
    """Draw a replay into a .png, .pdf or .svg file.

    Raises:
        InputError: the kind of picture is unknown or the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() not in _KINDS:
        raise InputError(f"picture {path}: unknown kind; end the name in {', '.join(_KINDS)}")
    figure = replay_figure(result)
    with replacing(path) as temporary:
        figure.savefig(temporary, dpi=130)
