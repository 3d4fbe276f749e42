"""Simulation laid over a recording: what the rig's parameters leave unexplained."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray, IntArray
from drill_env.friction import lower_curve
from drill_env.identification.coasting import untold_coasting
from drill_env.identification.drive import as_given, driven_rig
from drill_env.identification.initial_state import state_at
from drill_env.identification.inverse_dynamics import InverseOptions, rig_force_error
from drill_env.identification.known_loads import loaded, with_added_inertia
from drill_env.integrator import Voltage, sampled_voltage, simulate
from drill_env.parameters import Rig
from drill_env.recordings import Channel, Recording, RecordingWarning


@dataclass(frozen=True, slots=True)
class ChannelError:
    """Error of one simulated channel against the measured one.

    Attributes:
        rms: root mean square, rad, or rad/s of a velocity.
        max: largest absolute error, likewise.
        range: largest minus smallest measured value, likewise.
    """

    rms: float
    max: float
    range: float

    @property
    def percent(self) -> float:
        """The rms error in % of the measured range, NaN where nothing moved."""
        return 100.0 * self.rms / self.range if self.range > 0 else math.nan


@dataclass(frozen=True, slots=True, eq=False)
class ReplayResult:
    """A recording and the rig's answer to its voltage.

    Attributes:
        recording: what was measured.
        rig: the parameters.
        initial: (twist, omega_u, omega_l, theta_l) at the first row, shape (4,).
        simulated: reading by channel over the whole run, free after the first row, rad or rad/s.
        errors: error of `simulated` by channel.
        horizon: s between the restarts of the prediction.
        predicted: reading by channel when restarted every `horizon` s from the measured
            state; empty where an angle was not recorded.
        prediction_errors: error of `predicted` by channel.
        force_error: relative force error of a one-inertia rig, share of 1, else None.
        notes: what a reader should know of this replay.
    """

    recording: Recording
    rig: Rig
    initial: FloatArray
    simulated: Mapping[Channel, FloatArray]
    errors: Mapping[Channel, ChannelError]
    horizon: float
    predicted: Mapping[Channel, FloatArray]
    prediction_errors: Mapping[Channel, ChannelError]
    force_error: float | None
    notes: tuple[RecordingWarning, ...]

    def as_dict(self) -> dict[str, Any]:
        """Figures without the traces, plain values for JSON."""
        recording = self.recording
        return {
            "recording": recording.source,
            "samples": len(recording),
            "duration_s": recording.duration,
            "rate_hz": recording.rate,
            "initial": dict(
                zip(("twist", "omega_u", "omega_l", "theta_l"), self.initial.tolist(), strict=True)
            ),
            "errors": _plain(self.errors),
            "prediction": {"horizon_s": self.horizon, "errors": _plain(self.prediction_errors)},
            "force_error": self.force_error,
            "notes": [
                {"code": note.code, "message": str(note)}
                for note in (*recording.notes, *self.notes)
            ],
        }


def _plain(errors: Mapping[Channel, ChannelError]) -> dict[str, Any]:
    return {
        name: {**asdict(e), "percent": e.percent if e.range > 0 else None}
        for name, e in errors.items()
    }


def replay(
    recording: Recording,
    rig: Rig,
    *,
    initial: FloatArray | None = None,
    horizon: float = 5.0,
    options: InverseOptions | None = None,
) -> ReplayResult:
    """Simulate a rig through a recording's voltage and compare.

    Args:
        recording: with u and at least one angle or velocity; the upper disc's for a one-inertia
            rig.
        rig: parameters; where the drive is a measured torque, km is taken to be 1.
        initial: (twist, omega_u, omega_l, theta_l) at the first row, shape (4,); by
            default the first angles and velocities fitted to the first samples.
        horizon: s between restarts of the prediction.
        options: derivatives for the force error of a one-inertia rig.

    Raises:
        InputError: a channel is missing or an argument is out of range.
    """
    if not (math.isfinite(horizon) and horizon > 0):
        raise InputError(f"horizon is {horizon}: give seconds greater than 0")
    given, rig = rig, driven_rig(rig, [recording])
    channels = _compared(recording, rig)
    t = recording.t - recording.t[0]
    voltage = sampled_voltage(t, recording.channel("u"))
    start = state_at(recording, rig, 0) if initial is None else np.asarray(initial, dtype=float)
    free = _run(loaded(rig, recording), voltage, t, start)
    simulated: dict[Channel, FloatArray] = {name: free[name] for name in channels}
    predicted: dict[Channel, FloatArray] = {}
    if len(recording.angles().keys() & set(channels)) == rig.inertias:
        pieces = _restarted(recording, rig, start, horizon)
        predicted = {name: pieces[name] for name in channels}
    force_error = rig_force_error(recording, rig, options) if _has_force(recording, rig) else None
    return ReplayResult(
        recording=recording, rig=as_given(rig, given, [recording]), initial=start,
        simulated=simulated,
        errors=channel_errors(recording, simulated), horizon=horizon, predicted=predicted,
        prediction_errors=channel_errors(recording, predicted), force_error=force_error,
        notes=tuple(_notes(recording, rig)),
    )  # fmt: skip


def _compared(recording: Recording, rig: Rig) -> list[Channel]:
    if rig.inertias == 1:
        found: list[Channel] = [name for name in recording.readings() if name.endswith("_u")]
    else:
        found = list(recording.readings())
    if not found:
        recording.channel("theta_u" if rig.inertias == 1 else "theta_l")
    return found


def _has_force(recording: Recording, rig: Rig) -> bool:
    return rig.inertias == 1 and recording.theta_u is not None and not recording.has_note("gap")


def _run(rig: Rig, voltage: Voltage, t: FloatArray, state: FloatArray) -> dict[Channel, FloatArray]:
    # A little longer than the samples, lest rounding puts the last one past the end.
    seconds = float(t[-1] - t[0]) + 1e-9
    run = simulate(rig, voltage, seconds, t_start=float(t[0]), t_eval=t, initial=state)
    return {
        "theta_u": run.readings[:, 0], "theta_l": run.readings[:, 1],
        "omega_u": run.omega_u, "omega_l": run.omega_l,
    }  # fmt: skip


def _restarted(
    recording: Recording, rig: Rig, start: FloatArray, horizon: float
) -> dict[Channel, FloatArray]:
    t = recording.t - recording.t[0]
    rows = np.unique(np.searchsorted(t, np.arange(0.0, t[-1], horizon) - 1e-9))
    later = [state_at(recording, rig, row) for row in rows[1:].tolist()]
    return run_pieces(recording, rig, rows, np.array([start, *later]))


def run_pieces(
    recording: Recording, rig: Rig, rows: IntArray, states: FloatArray
) -> dict[Channel, FloatArray]:
    """Angles (rad) of a rig put into a state at some rows and left to itself in between.

    The velocities (rad/s) that were recorded are there, too.

    Args:
        recording: with u.
        rig: parameters.
        rows: ascending, the first 0, shape (m,).
        states: (twist, omega_u, omega_l, theta_l) there, shape (m, 4).
    """
    t = recording.t - recording.t[0]
    voltage = sampled_voltage(t, recording.channel("u"))
    rig = loaded(rig, recording)
    bounds = [*rows.tolist(), len(t)]
    pieces = [
        _run(rig, voltage, t[row:end], state)
        for row, end, state in zip(bounds[:-1], bounds[1:], states, strict=True)
    ]
    speeds = recording.velocities()
    names: list[Channel] = [n for n in pieces[0] if n.startswith("theta") or n in speeds]
    return {name: np.concatenate([p[name] for p in pieces]) for name in names}


def channel_errors(
    recording: Recording, simulated: Mapping[Channel, FloatArray]
) -> dict[Channel, ChannelError]:
    """Error of each simulated channel."""
    errors: dict[Channel, ChannelError] = {}
    for name, values in simulated.items():
        measured = recording.channel(name)
        gap = values - measured
        errors[name] = ChannelError(
            float(np.sqrt(np.mean(gap**2))), float(np.abs(gap).max()), float(np.ptp(measured))
        )
    return errors


def _notes(recording: Recording, rig: Rig) -> list[RecordingWarning]:
    if untold_coasting(recording, rig):
        text = (
            f"{recording.source}: the bridge is off in some rows, and the rig brakes there as in "
            "the others: give it, or the recording, the effect coasting with its back_emf"
        )
        return [RecordingWarning("coasting", text), *_hidden(recording, rig)]
    return _hidden(recording, rig)


def _hidden(recording: Recording, rig: Rig) -> list[RecordingWarning]:
    if rig.inertias == 1:
        return []
    source, angles = recording.source, recording.angles()
    if not angles:
        text = (
            f"{source}: only velocities are recorded; the string is taken as twisted as a steady "
            "run twists it at the start, and nothing is restarted from the measured state"
        )
        return [RecordingWarning("hidden_state", text)]
    if len(angles) == 1:
        there = next(iter(angles))
        other = "theta_l" if there == "theta_u" else "theta_u"
        text = (
            f"{source}: of the two angles only {there} is recorded (columns: "
            f"{', '.join(recording.columns)}; name the other with --map {other}=COLUMN); the "
            "string is taken as untwisted at the start, and nothing is restarted from the "
            "measured state"
        )
        return [RecordingWarning("hidden_state", text)]
    mean = _mean(recording.t, angles["theta_u"] - angles["theta_l"])
    if abs(mean) <= 2.0 * _explained_twist(recording, rig):
        return []
    text = (
        f"{source}: the string is twisted by {mean:.4g} rad on average, more than the lower disc's "
        "friction explains; if the encoders were zeroed apart, shift one of them"
    )
    return [RecordingWarning("twist_offset", text)]


def _mean(t: FloatArray, values: FloatArray) -> float:
    return float(np.trapezoid(values, t) / (t[-1] - t[0]))


def _explained_twist(recording: Recording, rig: Rig) -> float:
    """The mean twist (rad) that friction and a change of speed can hold: their mean torque."""
    t, theta = recording.t, recording.channel("theta_l")
    stride = min(max(1, round(0.1 * recording.rate)), len(t) - 1)
    speeds = np.abs((theta[stride:] - theta[:-stride]) / (t[stride:] - t[:-stride]))
    friction = float(lower_curve(rig, np.linspace(0.0, speeds.max(), 200)).max())
    change = 2.0 * with_added_inertia(rig, recording).Jl * float(speeds.max()) / recording.duration
    return (friction + change) / rig.ktheta
