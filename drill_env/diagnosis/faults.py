"""Faults of the recording itself: clock, lost rows, lost bits of an encoder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drill_env._types import BoolArray
from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.clock import FEWEST, stale_rows
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.identification.prediction_error import path_of
from drill_env.parameters import Rig
from drill_env.recordings import Recording

_CERTAIN = 8.0
_SLOWEST = 0.5
# Clocks jitter a little: what does not stand out of the rounding is no finding.
_NOTABLE = 0.7
# Share of the variance of times that the filter's own error adds to the product of innovations.
_FORM = 0.04
# Rigs within so many times of the paper's sizes are taken to have its encoders.
_ALIKE = 1.5


@dataclass(frozen=True, slots=True)
class Fault:
    """A fault of how the motion was recorded.

    Attributes:
        id: "clock_jitter", "missing_samples" or "lost_encoder_bits".
        parameters: its sizes: name to (value, low, high, unit).
        score: standard deviations by which it stands out.
        text: one sentence.
        sure: whether it is one; otherwise it may as well be how the rig was built.
    """

    id: str
    parameters: dict[str, tuple[float, float, float, str]]
    score: float
    text: str
    sure: bool = True


def find_faults(setting: Setting, fit: Fit) -> list[Fault]:
    """Faults of the recordings, as far as a fit shows them.

    Args:
        setting: recordings.
        fit: of the rig with what is known to be missing.
    """
    recordings = [s.recording for s in setting.samples]
    found = [
        clock_jitter(setting, fit),
        _stale(recordings),
        lost_bits(recordings, setting.coordinates.base),
    ]
    return [fault for fault in found if fault is not None]


def clock_jitter(setting: Setting, fit: Fit) -> Fault | None:
    """Both encoders misread by their speeds times one and the same error of time."""
    parts, fastest = [np.zeros((0, 3))], 0.0
    for samples, starts, motion in zip(setting.samples, fit.starts, fit.motions, strict=True):
        given = with_terms(samples, fit.terms, fit.rig, motion)
        path = path_of(given, fit.rig, fit.noise, starts, setting.robust)
        gap, variance = path.trace.innovation[:, :2], path.trace.variance[:, :2]
        speed = motion.states[:, 1:3]
        ok = (variance > 0).all(axis=1) & (np.abs(speed) > _SLOWEST).all(axis=1)
        if not ok.any():
            continue
        fastest = max(fastest, float(np.sqrt(np.mean(speed[ok] ** 2))))
        scale = np.sqrt(variance[ok, 0] * variance[ok, 1])
        product = np.clip(gap[ok, 0] * gap[ok, 1] / scale, -25.0, 25.0)
        parts.append(np.column_stack([product, speed[ok, 0] * speed[ok, 1] / scale, 1.0 / scale]))
    product, slope, always = np.concatenate(parts).T
    # E[gap_u gap_l] = omega_u omega_l sigma_t^2 when time is uncertain. What does not grow with
    # the speeds is noise that the sensors share: a twist that was added to one of them.
    if not len(product):
        return None
    slope = slope - always * float(always @ slope) / float(always @ always)
    weight, spread = float(slope @ slope), float(slope**2 @ product**2)
    if weight <= 0.0 or spread <= 0.0:
        return None
    total = float(slope @ product)
    variance_t, score = total / weight, total / math.sqrt(spread)
    rounding = min(fit.noise.encoder_u, fit.noise.encoder_l)
    if score < _CERTAIN or math.sqrt(max(variance_t, 0.0)) * fastest < _NOTABLE * rounding:
        return None
    deviation = math.hypot(math.sqrt(spread) / weight, _FORM * variance_t)
    low, high = (math.sqrt(max(variance_t + k * deviation, 0.0)) for k in (-1.96, 1.96))
    size = math.sqrt(variance_t)
    return Fault(
        "clock_jitter", {"jitter": (size, low, high, "s")}, score,
        f"The times of the samples are uncertain by {1e6 * size:.0f} microseconds.",
    )  # fmt: skip


def _stale(recordings: Sequence[Recording]) -> Fault | None:
    """Rows that repeat the one before while the rig turned."""
    told = [stale_rows(recording) for recording in recordings]
    stale = sum(int(rows.sum()) for rows, _ in told)
    moving = sum(turning for _, turning in told)
    if stale < FEWEST:
        return None
    share = stale / moving
    # Rows go missing in runs: of those there are fewer to average over.
    error = 1.96 * math.sqrt(sum(_squared_runs(rows) for rows, _ in told)) / moving
    return Fault(
        "missing_samples", {"share": (share, max(share - error, 0.0), share + error, "1")},
        math.sqrt(stale) * _CERTAIN / math.sqrt(FEWEST),
        f"{stale} rows repeat the row before although the discs turn: samples are missing.",
    )  # fmt: skip


def _squared_runs(stale: BoolArray) -> float:
    """Sum of the squared lengths of runs of stale rows."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], stale, [False]]).astype(int)))
    return float(((edges[1::2] - edges[::2]) ** 2).sum())


def lost_bits(recordings: Sequence[Recording], rig: Rig) -> Fault | None:
    """One encoder counts in steps that are a power of two times what it should count in.

    That is by its stated counts a turn, where both are stated. Else it is by the other encoder,
    which on the paper's rig is alike; on other rigs it need not be.

    Args:
        recordings: with the steps that are visible in their angles, and the stated ones.
        rig: where the diagnosis starts.
    """
    pairs = [r for r in recordings if {"theta_u", "theta_l"} <= set(r.quanta)]
    if not pairs:
        return None
    steps = np.array([[r.quanta["theta_u"], r.quanta["theta_l"]] for r in pairs])
    stated = all({"theta_u", "theta_l"} <= set(r.stated) for r in pairs)
    if stated:
        steps = steps / np.array([[r.stated["theta_u"], r.stated["theta_l"]] for r in pairs])
    upper, lower = np.median(steps, axis=0)
    bits = math.log2(lower / upper)
    whole = round(bits)
    if whole == 0 or abs(bits - whole) > 0.02:
        return None
    which = "lower" if whole > 0 else "upper"
    count = float(abs(whole))
    other = "the stated ones" if stated else "those of the other"
    return Fault(
        "lost_encoder_bits", {"bits": (count, count, count, "1")}, math.inf,
        f"The {which} encoder counts in steps {2 ** abs(whole)} times {other}: it has "
        f"lost {abs(whole)} bit{'s' if abs(whole) > 1 else ''}, or is a coarser one.",
        sure=stated or _as_in_the_paper(rig),
    )  # fmt: skip


def _as_in_the_paper(rig: Rig) -> bool:
    """Whether a rig is of the size of the paper's."""
    paper = Rig.paper()
    sizes = ("Ju", "Jl", "ktheta")
    shares = [getattr(rig, name) / getattr(paper, name) for name in sizes]
    return all(1.0 / _ALIKE < share < _ALIKE for share in shares)
