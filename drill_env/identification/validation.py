"""Validation of a rig on a recording: free run, 5 s prediction and what the filter leaves over."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.drive import as_given, driven_rig, torque_driven
from drill_env.identification.estimate import Estimate
from drill_env.identification.noise import NoiseModel
from drill_env.identification.noise_of_recording import estimated_noise, settled_starts
from drill_env.identification.prediction_error import Trace, trace_of
from drill_env.identification.replay import ReplayResult, channel_errors, replay, run_pieces
from drill_env.identification.samples import Samples, prepare
from drill_env.identification.whiteness import Whiteness, whiteness
from drill_env.parameters import Rig
from drill_env.recordings import Channel, Recording

HORIZON = 5.0
"""Length of a prediction, s."""

# Of each of six tests: then about one true rig in a hundred is called wrong.
_DOUBT = 0.001
# Of a disc at rest all samples hold one and the same rounding error: they are no dice.
_SHARED = 8.0
_SIZES = (0.8, 1.25)


@dataclass(frozen=True, slots=True, eq=False)
class Validation:
    """What a rig makes of one recording.

    Attributes:
        recording: what was measured.
        rig: the parameters.
        noise: what the prediction errors were measured against.
        noise_estimated: whether `noise` was estimated on this very recording, the rig held.
        start: theta_u - theta_l, omega_u, omega_l, theta_l at the first row and the twist at
            which the encoders agree, as the filter estimates them, shape (5,).
        replay: free run from `start` and predictions from the filter's states.
        trace: the filter's pass.
        residuals: tests of the standardised innovations by channel, but for samples that show
            the same count as 8 neighbours.
    """

    recording: Recording
    rig: Rig
    noise: NoiseModel
    noise_estimated: bool
    start: FloatArray
    replay: ReplayResult
    trace: Trace
    residuals: Mapping[Channel, Whiteness]

    @property
    def name(self) -> str:
        """The recording's file name."""
        return Path(self.recording.source).name

    @property
    def verdict(self) -> str:
        """What the innovations still hold, in words: "white", "left-over near 0.25 Hz", ..."""
        if not self.residuals:
            return "too short, or too long at rest, to judge"
        drive = "input" if self.recording.drive == "motion" else "voltage"
        tests = self.residuals.items()
        found = [text for name, test in tests for text in _findings(name, test, drive)]
        return "; ".join(found) or "white"

    def as_dict(self) -> dict[str, Any]:
        """Figures without the traces, plain values for JSON."""
        return {
            **self.replay.as_dict(),
            "encoder_offset": float(self.start[4]),
            "noise": {
                **self.noise.named(velocities=bool(self.recording.velocities())),
                "estimated_here": self.noise_estimated,
            },
            "residuals": {name: test.as_dict() for name, test in self.residuals.items()},
            "verdict": self.verdict,
        }


def validate(recording: Recording, rig: Rig, noise: NoiseModel | None = None) -> Validation:
    """Judge a rig on a recording, best one that it was not fitted to.

    Free run and predictions start from states of the filter: those of a smooth fit to the
    samples around a restart miss omega_l by ten times as much.

    Args:
        recording: with u and theta_u or theta_l, or velocities.
        rig: parameters; where the drive is a measured torque, km is taken to be 1.
        noise: of the recordings that the rig was fitted to; None to estimate it on this one.
            It then grows with the rig's errors and hides part of them.

    Raises:
        InputError: a channel is missing, or the rig's motion runs away.
    """
    given, rig = rig, driven_rig(rig, [recording])
    if rig.effects:
        raise InputError(
            "validate judges a rig without [[effects]], which the filter does not follow: replay "
            "the recording instead, or diagnose it"
        )
    samples = prepare(recording, rig)
    if noise is None:
        found, starts = estimated_noise(samples, rig)
    else:
        found, starts = noise, settled_starts(samples, rig, noise)
    trace = trace_of(samples, rig, found, starts)
    sound = bool(np.isfinite(trace.state).all()) and _reaches_end(samples, trace)
    with np.errstate(over="ignore", invalid="ignore"):
        result = _replayed(samples, rig, starts, trace) if sound else None
    if result is None or not all(math.isfinite(e.rms) for e in result.errors.values()):
        raise InputError(
            f"{recording.source}: the rig's motion runs away under this voltage; check its "
            "parameters and the recording's units and signs"
        )
    return Validation(
        recording=recording, rig=as_given(rig, given, [recording]), noise=found,
        noise_estimated=noise is None,
        start=starts[0], replay=result, trace=trace,
        residuals=_residuals(samples, trace),
    )  # fmt: skip


def validate_estimate(estimate: Estimate, holdout: Sequence[Recording] = ()) -> list[Validation]:
    """Validate a fitted rig on the recordings of its fit, then on others.

    Args:
        estimate: the fit.
        holdout: recordings that it was not fitted to; judged against the noise of the fit
            where its recordings share one, else against their own.

    Raises:
        InputError: some recordings are driven by a voltage and some by a torque.
    """
    fitted = [sample.recording for sample in estimate.problem.samples]
    torque_driven([*fitted, *holdout])
    shared = estimate.point.noise[0] if len(estimate.point.noise) == 1 else None
    if not estimate.problem.torques:
        # Multiple shooting has no torques: held, they would count every disturbance as an error.
        return [validate(recording, estimate.rig) for recording in (*fitted, *holdout)]
    jobs = [*zip(fitted, estimate.noise, strict=True), *((r, shared) for r in holdout)]
    return [validate(recording, estimate.rig, noise) for recording, noise in jobs]


def _reaches_end(samples: Samples, trace: Trace) -> bool:
    """Whether the filter took the last sample in: it stops where the integrator fails."""
    measured = np.flatnonzero(np.isfinite(samples.angles).any(axis=1))
    return len(measured) == 0 or bool(np.any(trace.variance[measured[-1]] > 0.0))


def _replayed(samples: Samples, rig: Rig, starts: FloatArray, trace: Trace) -> ReplayResult:
    """Free run and predictions; both begin anew behind a gap, where the voltage is not known."""
    recording, rows = samples.recording, samples.restarts
    t, ends = samples.t, [*samples.restarts[1:].tolist(), len(samples.t)]
    states = trace.state[:, :4].copy()
    states[rows] = starts[:, :4]
    states[rows, 0] += starts[:, 4]
    spans = [
        a + np.searchsorted(t[a:b], np.arange(float(t[a]), float(t[b - 1]), HORIZON) - 1e-9)
        for a, b in zip(rows.tolist(), ends, strict=True)
    ]
    shorter = np.unique(np.concatenate([rows, *spans]))
    # A replay knows of no encoder offset: theta_u is read where the string was slack.
    offset = np.repeat(starts[:, 4], np.diff([*rows.tolist(), len(t)]))
    free = run_pieces(recording, rig, rows, states[rows])
    short = run_pieces(recording, rig, shorter, states[shorter])
    done = replay(recording, rig, initial=states[0], horizon=HORIZON)
    for angles in (free, short):
        angles["theta_u"] = angles["theta_u"] - offset
    simulated: dict[Channel, FloatArray] = {name: free[name] for name in done.simulated}
    predicted: dict[Channel, FloatArray] = {name: short[name] for name in done.simulated}
    return replace(
        done, simulated=simulated, errors=channel_errors(recording, simulated),
        predicted=predicted, prediction_errors=channel_errors(recording, predicted),
    )  # fmt: skip


def _residuals(samples: Samples, trace: Trace) -> dict[Channel, Whiteness]:
    tests: dict[Channel, Whiteness] = {}
    for i, name in enumerate(samples.names):
        if samples.recording.drive == "motion" and name.endswith("_u"):
            # They are what the spline left that the input was made by.
            continue
        alone = samples.repeats[:, i] <= _SHARED
        errors = np.where(alone, trace.standardised[:, i], math.nan)
        found = whiteness(errors, samples.u, samples.recording.interval)
        if found is not None:
            tests[name] = found
    return tests


def _findings(name: Channel, test: Whiteness, drive: str) -> list[str]:
    found = []
    if test.p_peak < _DOUBT:
        found.append(f"left-over near {test.peak_hz:.2g} Hz in {name}")
    elif test.p_white < _DOUBT:
        lag = float(test.lags[np.abs(test.autocorrelation).argmax()])
        found.append(f"{name} repeats itself after {lag:.3g} s")
    if test.p_cross < _DOUBT:
        found.append(f"{name} follows the {drive} by {test.cross_largest[0]:.3g} s")
    if not _SIZES[0] < test.rms < _SIZES[1]:
        found.append(f"errors of {name} {test.rms:.2g} times the noise expected")
    return found
