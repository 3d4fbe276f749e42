"""A simulated run: speeds, twist, voltage and where the lower disc sticks."""

from __future__ import annotations

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from drill_env._files import replacing
from drill_env.integrator import Disc, Kind, Trajectory


def run_figure(run: Trajectory) -> Figure:
    """Speeds with reversals marked, twist and voltage over time."""
    figure = Figure(figsize=(10.0, 6.0), layout="constrained")
    FigureCanvasAgg(figure)
    speed, twist, volts = figure.subplots(3, 1, sharex=True, height_ratios=[3, 1.4, 1])
    speed.plot(run.t, run.omega_l, color="#c0392b", lw=1.2, label=r"lower disc $\omega_l$")
    speed.plot(run.t, run.omega_u, color="#1f5fa8", lw=1.2, label=r"upper disc $\omega_u$")
    turns = run.events.where(Disc.LOWER, Kind.REVERSAL)
    if len(turns):
        speed.plot(turns.t, 0.0 * turns.t, "|", color="k", ms=9, label="reversal")
    speed.fill_between(
        run.t, 0, 1, where=run.stuck_l.tolist(), color="0.85",
        transform=speed.get_xaxis_transform(), label="stuck",
    )  # fmt: skip
    speed.set_ylabel("speed [rad/s]")
    speed.legend(frameon=False, ncols=4, loc="lower right", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    twist.plot(run.t, run.twist, color="0.25", lw=1.0)
    twist.set_ylabel("twist [rad]")
    volts.step(run.t, run.u, where="post", color="0.25", lw=1.0)
    volts.set_ylabel("u [V]")
    volts.set_xlabel("time [s]")
    for axes in (speed, twist, volts):
        axes.spines[["top", "right"]].set_visible(False)
    return figure


def save_run_picture(run: Trajectory, path: Path) -> None:
    """Write the picture of a run."""
    with replacing(path) as temporary:
        run_figure(run).savefig(temporary, dpi=150, format="png")
