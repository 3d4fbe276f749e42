"""Rows that no rig can make: lost or doubled rows, jumps of an encoder, frozen channels."""

from __future__ import annotations

import numpy as np

from drill_env._types import BoolArray, FloatArray
from drill_env.recordings import Channel, Recording, RecordingWarning, longest_run

# Twice what a rig 30 % off the paper's reaches when the voltage jumps by 10 V, rad/s^2.
_HARDEST = 150.0
_STEPS = 3.5
_USUAL = 10.0
_FROZEN_S = 1.0
_TURNED = 6.0


def check_rows(recording: Recording) -> list[RecordingWarning]:
    """Remark rows that were lost, doubled or joined, and encoders that froze.

    Codes: "duplicated_rows", "dropped_rows", "glued", "jump" and "dead_encoder".

    Args:
        recording: with at least one angle, in rad.
    """
    return _frozen(recording) or _breaks(recording)


def _breaks(recording: Recording) -> list[RecordingWarning]:
    """Steps between neighbouring rows that stand out of the motion around them."""
    t = recording.t
    excess = {name: _excess(t, a, recording) for name, a in recording.angles().items()}
    places = {name: np.flatnonzero(e != 0.0) for name, e in excess.items()}
    odd = np.unique(np.concatenate(list(places.values()))) if places else np.array([], dtype=int)
    if len(odd) == 0:
        return []
    source, first = recording.source, f"the first at {t[odd[0]]:.6g} s"
    doubled = odd[_is_repeated(recording, odd)]
    if len(doubled) >= 0.5 * len(odd):
        text = (
            f"{source}: {len(doubled)} rows repeat the one before in the middle of the motion, "
            f"{first}, with times as if they were new; remove them and restore the true times"
        )
        return [RecordingWarning("duplicated_rows", text)]
    angles = list(recording.angles().values())
    both = np.all([e[odd] != 0.0 for e in excess.values()], axis=0)
    if len(angles) < 2 or both.mean() < 0.5:
        return [_jump(recording, excess, places)]
    lost = [_lost(a, e, odd[both]) for a, e in zip(angles, excess.values(), strict=True)]
    same = (np.abs(lost[0] - lost[1]) < 0.25 * np.abs(lost[0]) + 0.3) & (lost[0] > 0.5)
    if same.mean() > 0.5 and len(same) > 1:
        text = (
            f"{source}: about {np.round(lost[0][same]).sum():.0f} rows are missing in "
            f"{int(same.sum())} places, {first}, although the times run on evenly; export the "
            "recording with its true times, then the gaps can be skipped"
        )
        return [RecordingWarning("dropped_rows", text)]
    text = (
        f"{source}: both encoders jump in the same row in {int(both.sum())} places, {first}: two "
        "recordings glued together or rows lost; cut the recording there"
    )
    return [RecordingWarning("glued", text)]


def _excess(t: FloatArray, theta: FloatArray, recording: Recording) -> FloatArray:
    """What a step has over the steps around it where no rig could do so, else 0, shape (n - 1,)."""
    dt, moves = np.diff(t), np.diff(theta)
    usual = float(np.median(dt))
    gap = ~((dt < 1.8 * usual) & np.isfinite(moves))
    speed = np.where(gap, np.nan, moves / dt)
    odd = np.zeros(len(moves))
    around = 0.5 * (speed[:-2] + speed[2:])
    odd[1:-1] = np.nan_to_num((speed[1:-1] - around) * dt[1:-1])
    sizes = np.abs(odd[1:-1])
    quantum = _quantum(recording, theta)
    limit = max(
        _STEPS * quantum, _USUAL * float(np.quantile(sizes, 0.9)), 0.5 * _HARDEST * usual**2
    )
    found = np.abs(odd) > limit
    # A jump also spoils the comparison of its neighbours, by half its size.
    for shift in (-1, 1):
        larger = np.abs(np.roll(odd, shift)) > 1.5 * np.abs(odd)
        found &= ~(larger & (np.abs(np.roll(odd, shift)) > limit))
    return np.where(found, odd, 0.0)


def _quantum(recording: Recording, theta: FloatArray) -> float:
    name: Channel = "theta_u" if theta is recording.theta_u else "theta_l"
    return recording.quanta.get(name, 0.0)


def _is_repeated(recording: Recording, steps: np.ndarray) -> BoolArray:
    """Whether no channel but the time changes over these steps."""
    channels = [v for name, v in recording.channels().items() if name != "t"]
    return np.all([v[steps + 1] == v[steps] for v in channels], axis=0)


def _lost(theta: FloatArray, excess: FloatArray, steps: np.ndarray) -> FloatArray:
    """The excess in units of the usual step around it."""
    around = 0.5 * (theta[steps] - theta[steps - 1] + theta[steps + 2] - theta[steps + 1])
    return excess[steps] / np.where(around == 0.0, np.inf, around)


def _jump(
    recording: Recording, excess: dict[Channel, FloatArray], places: dict[Channel, np.ndarray]
) -> RecordingWarning:
    name = max(places, key=lambda key: len(places[key]))
    i = int(places[name][0])
    text = (
        f"{recording.source}: {name} jumps in {len(places[name])} places, first by "
        f"{excess[name][i]:.4g} rad at {recording.t[i]:.6g} s, faster than any disc can; cut the "
        "recording there or mend the encoder"
    )
    return RecordingWarning("jump", text)


def _frozen(recording: Recording) -> list[RecordingWarning]:
    """An angle that stops for good while the other disc, or the voltage, goes on."""
    notes = []
    t, angles = recording.t, recording.angles()
    for name, theta in angles.items():
        start, length = longest_run(np.diff(theta) == 0.0)
        stop = start + length
        if length == 0 or t[stop] - t[start] < _FROZEN_S or start < 5:
            continue
        others = [a[start : stop + 1] for other, a in angles.items() if other != name]
        to_end = stop >= len(theta) - 3
        turned = float(np.ptp(others[0])) if others else 0.0
        if (to_end and turned > _TURNED) or turned > 4.0 * _TURNED:
            what = f"while the other disc turns by {turned:.4g} rad"
        elif to_end and turned == 0.0 and _still_driven(recording, start):
            what = "although the voltage goes on as when the disc turned"
        else:
            continue
        text = (
            f"{recording.source}: {name} stays at {theta[start]:.6g} rad from {t[start]:.6g} s on "
            f"for {t[stop] - t[start]:.4g} s {what}: the encoder is dead; cut the recording there"
        )
        notes.append(RecordingWarning("dead_encoder", text))
    return notes


def _still_driven(recording: Recording, start: int) -> bool:
    u = recording.u
    if u is None or start < 20:
        return False
    return float(np.median(np.abs(u[start:]))) > 0.7 * float(np.median(np.abs(u[:start]))) > 0.0
