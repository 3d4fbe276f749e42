"""Rows that no rig can make: lost or doubled rows, jumps of an encoder, frozen channels."""

from __future__ import annotations

import itertools
import math

import numpy as np

from drill_env._types import BoolArray, FloatArray, IntArray
from drill_env.parameters import Rig
from drill_env.recordings import Channel, Recording, RecordingWarning, longest_run

# Twice what a rig 30 % off the paper's reaches when the voltage jumps by 10 V, rad/s^2.
_HARDEST = 150.0
# Of the given rig likewise: its numbers may be off, and physics may be missing.
_DOUBLED = 2.0
_STEPS = 3.5
_USUAL = 10.0
_FROZEN_S = 1.0
# Well above the voltage at which the paper's rig breaks away, 0.095 V.
_DRIVING_V = 0.5
_TURNED, _TURNED_SHARE = 3.0, 0.05


def check_rows(recording: Recording, rig: Rig | None = None) -> list[RecordingWarning]:
    """Remark rows that were lost, doubled or joined, and encoders that froze.

    Codes: "same_column", "duplicated_rows", "dropped_rows", "glued", "jump" and "dead_encoder".

    Args:
        recording: with at least one angle, in rad.
        rig: as this recording drives it, if it is known; light discs change their speed faster.
    """
    hardest = _HARDEST if rig is None else max(_HARDEST, _DOUBLED * _jerked(recording, rig))
    return _same(recording) or _frozen(recording) or _breaks(recording, hardest)


def _jerked(recording: Recording, rig: Rig) -> float:
    """By how much an acceleration changes where the drive jumps or friction turns, rad/s^2."""
    u = np.zeros(1) if recording.u is None else recording.u
    largest = float(np.nanmax(np.abs(np.diff(u)), initial=0.0))
    upper = (rig.km * largest + 2.0 * (rig.Tsu + abs(rig.dTsu))) / rig.Ju
    return max(upper, 2.0 * rig.Tsl / rig.Jl)


def _same(recording: Recording) -> list[RecordingWarning]:
    channels = recording.channels()
    for one, two in itertools.combinations(channels, 2):
        if np.array_equal(channels[one], channels[two]) and np.ptp(channels[one]) > 0:
            text = (
                f"{recording.source}: {one} and {two} are the same from the first row to the last: "
                "one column was written twice; export the recording again"
            )
            return [RecordingWarning("same_column", text)]
    return []


def _breaks(recording: Recording, hardest: float) -> list[RecordingWarning]:
    """Steps between neighbouring rows that stand out of the motion around them."""
    t, angles = recording.t, recording.angles()
    excess: dict[Channel, FloatArray] = {name: _excess(t, theta) for name, theta in angles.items()}
    quanta = recording.quanta
    limits = {name: _limit(t, excess[name], quanta.get(name, 0.0), hardest) for name in angles}
    flags: dict[Channel, BoolArray] = {name: _peaks(excess[name], limits[name]) for name in angles}
    odd = np.flatnonzero(np.any(list(flags.values()), axis=0))
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
    lost = _lost(list(angles.values()), list(excess.values()), list(limits.values()), odd)
    if len(odd) > 2 and np.mean(lost > 0) > 0.5:
        text = (
            f"{source}: about {lost.sum()} rows are missing in {np.count_nonzero(lost)} places, "
            f"{first}, although the times run on evenly; export the recording with its true "
            "times, then the gaps are skipped"
        )
        return [RecordingWarning("dropped_rows", text)]
    both = np.all(list(flags.values()), axis=0)
    if len(angles) < 2 or both.sum() < 0.5 * len(odd):
        return [_jump(recording, excess, flags)]
    text = (
        f"{source}: both encoders jump in the same row in {both.sum()} places, {first}: two "
        "recordings glued together or rows lost; cut the recording there"
    )
    return [RecordingWarning("glued", text)]


def _excess(t: FloatArray, theta: FloatArray) -> FloatArray:
    """What each step has over the mean of the two around it, rad, shape (n - 1,)."""
    dt, moves = np.diff(t), np.diff(theta)
    # Steps across a gap are long for a good reason.
    speed = np.where(dt < 1.8 * np.median(dt), moves / dt, np.nan)
    odd = np.zeros(len(moves))
    odd[1:-1] = np.nan_to_num((speed[1:-1] - 0.5 * (speed[:-2] + speed[2:])) * dt[1:-1])
    return odd


def _limit(t: FloatArray, excess: FloatArray, quantum: float, hardest: float) -> float:
    """The largest excess that torque, the encoder and the usual noise can make, rad."""
    usual = float(np.quantile(np.abs(excess), 0.9))
    torque = 0.5 * hardest * float(np.median(np.diff(t))) ** 2
    return max(_STEPS * quantum, _USUAL * usual, torque)


def _peaks(excess: FloatArray, limit: float) -> BoolArray:
    size = np.abs(excess)
    # A jump also spoils the comparison of its neighbours, by half its size.
    largest = np.maximum(np.append(size[1:], 0.0), np.append(0.0, size[:-1]))
    return (size > limit) & (size > 0.67 * largest)


def _lost(
    angles: list[FloatArray], excess: list[FloatArray], limits: list[float], steps: IntArray
) -> IntArray:
    """How many rows each step has lost, 0 where that does not explain every angle."""
    around = [0.5 * (a[steps] - a[steps - 1] + a[steps + 2] - a[steps + 1]) for a in angles]
    fastest = np.argmax(np.abs(around), axis=0)
    pick = np.arange(len(steps))
    moves, odd = np.stack(around), np.stack([e[steps] for e in excess])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.nan_to_num(odd[fastest, pick] / moves[fastest, pick], posinf=0.0, neginf=0.0)
    rows = np.round(share).astype(int)
    left = np.abs(odd - rows * moves) - 0.3 * np.abs(rows * moves)
    fits = np.all(left < np.array(limits)[:, None], axis=0)
    return np.where(fits & (rows > 0) & (rows < 50), rows, 0)


def _is_repeated(recording: Recording, steps: IntArray) -> BoolArray:
    """Whether no channel but the time changes over these steps."""
    channels = [v for name, v in recording.channels().items() if name != "t"]
    return np.all([v[steps + 1] == v[steps] for v in channels], axis=0)


def _jump(
    recording: Recording, excess: dict[Channel, FloatArray], flags: dict[Channel, BoolArray]
) -> RecordingWarning:
    name = max(flags, key=lambda key: int(flags[key].sum()))
    places = np.flatnonzero(flags[name])
    i = int(places[0])
    text = (
        f"{recording.source}: {name} jumps in {len(places)} places, first by {excess[name][i]:.4g} "
        f"rad at {recording.t[i]:.6g} s, faster than any disc can; cut the recording there or "
        "mend the encoder"
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
        others = [a for other, a in angles.items() if other != name]
        to_end = stop >= len(theta) - 3
        # There and back is how a disc swings out while the other one stands.
        turned = abs(float(others[0][stop] - others[0][start])) if others else 0.0
        still = turned <= recording.quanta.get(name, 0.0)
        enough = _TURNED if to_end else 4.0 * _TURNED
        if others and turned > max(enough, _TURNED_SHARE * float(np.ptp(others[0]))):
            what = f"while the other disc turns by {turned:.4g} rad"
        elif to_end and (still or name == "theta_u") and _still_driven(recording, start):
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
    if u is None or recording.drive == "motion" or start < 20:
        return False
    before, after = (math.sqrt(float(np.mean(part**2))) for part in (u[:start], u[start:]))
    return after > max(_DRIVING_V, 0.5 * before)
