"""Validation of a rig on a recording: free run, 5 s prediction and what the filter leaves over."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from drill_env._errors import InputError
from drill_env._types import FloatArray
from drill_env.identification.estimate import Estimate
from drill_env.identification.noise import NoiseModel
from drill_env.identification.noise_fit import noise_step
from drill_env.identification.prediction_error import (
    Samples,
    Score,
    Trace,
    prepare,
    score,
    trace_of,
)
from drill_env.identification.replay import ReplayResult, replay
from drill_env.identification.whiteness import Whiteness, whiteness
from drill_env.parameters import Rig
from drill_env.recordings import Channel, Recording

HORIZON = 5.0
"""Length of a prediction, s."""

_START_ROUNDS = 5
_ENOUGH = 0.1
# Of each of six tests: then about one true rig in a hundred is called wrong.
_DOUBT = 0.001
_SIZES = (0.8, 1.25)
_CHANNELS: tuple[Channel, Channel] = ("theta_u", "theta_l")


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
        residuals: tests of the standardised innovations by channel.
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
            return "too short to judge"
        found = [text for name, test in self.residuals.items() for text in _findings(name, test)]
        return "; ".join(found) or "white"

    def as_dict(self) -> dict[str, Any]:
        """Figures without the traces, plain values for JSON."""
        return {
            **self.replay.as_dict(),
            "encoder_offset": float(self.start[4]),
            "noise": {**asdict(self.noise), "estimated_here": self.noise_estimated},
            "residuals": {name: test.as_dict() for name, test in self.residuals.items()},
            "verdict": self.verdict,
        }


def validate(recording: Recording, rig: Rig, noise: NoiseModel | None = None) -> Validation:
    """Judge a rig on a recording, best one that it was not fitted to.

    Free run and predictions start from states of the filter: those of a smooth fit to the
    samples around a restart miss omega_l by ten times as much.

    Args:
        recording: with u and theta_u or theta_l.
        rig: parameters.
        noise: of the recordings that the rig was fitted to; None to estimate it on this one.
            It then grows with the rig's errors and hides part of them.

    Raises:
        InputError: a channel is missing, or the rig's motion runs away.
    """
    samples = prepare(recording, rig)
    if noise is None:
        found, starts = estimated_noise(samples, rig)
    else:
        found, starts = noise, _settled_starts(samples, rig, noise, samples.starts)
    trace = trace_of(samples, rig, found, starts)
    if not np.isfinite(trace.state).all() or not trace.variance.any(axis=1)[-1]:
        raise InputError(
            f"{recording.source}: the rig's motion runs away under this voltage; check its "
            "parameters and the recording's units and signs"
        )
    return Validation(
        recording=recording, rig=rig, noise=found, noise_estimated=noise is None,
        start=starts[0], replay=_replayed(recording, rig, starts[0], trace), trace=trace,
        residuals=_residuals(samples, trace),
    )  # fmt: skip


def validate_estimate(estimate: Estimate, holdout: Sequence[Recording] = ()) -> list[Validation]:
    """Validate a fitted rig on the recordings of its fit, then on others.

    Args:
        estimate: the fit.
        holdout: recordings that it was not fitted to; judged against the noise of the fit
            where its recordings share one, else against their own.
    """
    fitted = [sample.recording for sample in estimate.problem.samples]
    shared = estimate.point.noise[0] if len(estimate.point.noise) == 1 else None
    if not estimate.problem.torques:
        # Multiple shooting has no torques: held, they would count every disturbance as an error.
        return [validate(recording, estimate.rig) for recording in (*fitted, *holdout)]
    jobs = [*zip(fitted, estimate.noise, strict=True), *((r, shared) for r in holdout)]
    return [validate(recording, estimate.rig, noise) for recording, noise in jobs]


def estimated_noise(
    samples: Samples, rig: Rig, noise: NoiseModel | None = None, *, rounds: int = 15
) -> tuple[NoiseModel, FloatArray]:
    """Noise and starts of one recording of greatest likelihood, the rig held.

    Args:
        samples: from `prepare`.
        rig: parameters.
        noise: where to begin.
        rounds: at most.

    Returns:
        The noise, and starts as `Samples.starts`, shape (m, 5).
    """
    noise = noise or _first_noise(samples.recording)
    starts = _settled_starts(samples, rig, noise, samples.starts)
    value = score(samples, rig, noise, starts).value
    for _ in range(rounds):
        there = noise_step([samples], [starts], rig, noise)
        moved = _settled_starts(samples, rig, there, starts)
        reached = score(samples, rig, there, moved).value
        if not reached < value:
            break
        gain, noise, starts, value = value - reached, there, moved, reached
        if gain < _ENOUGH:
            break
    return noise, starts


def _first_noise(recording: Recording) -> NoiseModel:
    steps = {
        "encoder_u": recording.quanta.get("theta_u"),
        "encoder_l": recording.quanta.get("theta_l"),
    }
    known = {name: step / math.sqrt(12.0) for name, step in steps.items() if step}
    return replace(NoiseModel(), **known)


def _settled_starts(
    samples: Samples, rig: Rig, noise: NoiseModel, starts: FloatArray
) -> FloatArray:
    here: Score = score(samples, rig, noise, starts)
    for _ in range(_START_ROUNDS):
        there = score(samples, rig, noise, starts + here.start_step)
        if not there.value < here.value:
            break
        starts = starts + here.start_step
        gain, here = here.value - there.value, there
        if gain < _ENOUGH:
            break
    return starts


def _replayed(recording: Recording, rig: Rig, start: FloatArray, trace: Trace) -> ReplayResult:
    offset = float(start[4])
    shifted = recording
    if recording.theta_u is not None and offset != 0.0:
        # The replay knows of no encoder offset: measure theta_u from where the string is slack.
        shifted = replace(recording, theta_u=recording.theta_u + offset)
    initial = start[:4] + np.array([offset, 0.0, 0.0, 0.0])
    done = replay(shifted, rig, initial=initial, states=trace.state[:, :4], horizon=HORIZON)
    back = {"theta_u": offset, "theta_l": 0.0}
    return replace(
        done, recording=recording,
        simulated={name: values - back[name] for name, values in done.simulated.items()},
        predicted={name: values - back[name] for name, values in done.predicted.items()},
    )  # fmt: skip


def _residuals(samples: Samples, trace: Trace) -> dict[Channel, Whiteness]:
    tests: dict[Channel, Whiteness] = {}
    for i, name in enumerate(_CHANNELS):
        found = whiteness(trace.standardised[:, i], samples.u, samples.recording.interval)
        if found is not None:
            tests[name] = found
    return tests


def _findings(name: Channel, test: Whiteness) -> list[str]:
    found = []
    if test.p_peak < _DOUBT:
        found.append(f"left-over near {test.peak_hz:.2g} Hz in {name}")
    elif test.p_white < _DOUBT:
        lag = float(test.lags[np.abs(test.autocorrelation).argmax()])
        found.append(f"{name} repeats itself after {lag:.3g} s")
    if test.p_cross < _DOUBT:
        found.append(f"{name} follows the voltage by {test.cross_largest[0]:.3g} s")
    if not _SIZES[0] < test.rms < _SIZES[1]:
        found.append(f"errors of {name} {test.rms:.2g} times the noise expected")
    return found
