"""Predictions of a recorded motion: runs that begin in it, many short ones in one call."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.effects.along import Motion, inner_states_of, late_angles, reading_errors
from drill_env.effects.declared import Declared, declared
from drill_env.effects.readings import errors_of
from drill_env.effects.signal import RESTING
from drill_env.effects.steady import acting
from drill_env.integrator._windows import hold, run_windows
from drill_env.integrator.modes import start_with_effects
from drill_env.integrator.prepared import Prepared
from drill_env.integrator.records import EVENT, N_STATE, RUN, STEPS_PER_PERIOD, new_work
from drill_env.integrator.simulate import simulate
from drill_env.integrator.voltage import Voltage, sampled_voltage, with_past
from drill_env.parameters import Rig

METHOD = "bs23"
"""Pair by which windows are run, of order 3: their steps are short beside the motion."""
# A window of a sensible rig takes some hundreds.
_MOST_STEPS = 5_000


class Predicted(NamedTuple):
    """What a rig predicts at rows of windows; infinite where the integration failed.

    Attributes:
        states: twist, omega_u, omega_l and theta_l, rad and rad/s, shape (w, k, 4).
        readings: theta_u and theta_l as the encoders read them, rad, shape (w, k, 2).
        inner: the effects' inner states, see `Trajectory.inner`, shape (w, k, m).
    """

    states: FloatArray
    readings: FloatArray
    inner: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Windows:
    """Stretches of a motion that are predicted from their first row on.

    Attributes:
        motion: of the whole recording.
        starts: first row of each window, shape (w,).
        rows: rows that are predicted, ascending and after the start, shape (w, k).
        as_read: whether the motion's angles are as encoders read them, with their errors.
        begin: states of the discs at the starts, shape (w, 4); those of the motion by default.
        inner: the effects' inner states at the starts, shape (w, m); by default those to which the
            motion before them leads.
    """

    motion: Motion
    starts: IntArray
    rows: IntArray
    as_read: bool = True
    begin: FloatArray | None = None
    inner: FloatArray | None = None

    def predicted(
        self, rig: Rig | Prepared, *, shift: float = 0.0, rtol: float = 1e-5
    ) -> Predicted:
        """What a rig predicts from the motion at the starts alone.

        The encoders' errors are taken off the start and put onto the prediction.

        Args:
            rig: parameters and effects; laid out already, where it is asked more than once.
            shift: by which the drive acts later than the clock of the readings says, s.
            rtol: relative tolerance of the integration.

        Raises:
            InputError: an effect of the rig is wrong.
        """
        prepared = rig if isinstance(rig, Prepared) else Prepared(rig, METHOD)
        rig = prepared.rig
        senses = bool(prepared.effects.entries["senses"].any())
        read = self.motion
        true = _without_errors(read, rig, prepared.effects) if senses and self.as_read else read
        states, inner = self._run(prepared, true, shift, rtol)
        readings = np.stack([states[..., 0] + states[..., 3], states[..., 3]], axis=2)
        if senses:
            readings += self._errors(prepared, true, states, inner)
        return Predicted(states, readings, inner.reshape(*states.shape[:2], -1))

    def _run(
        self, prepared: Prepared, motion: Motion, shift: float, rtol: float
    ) -> tuple[FloatArray, FloatArray]:
        rig, effects, (w, k) = prepared.rig, prepared.effects, self.rows.shape
        work = new_work(rtol, 0.1 * rtol, rig.natural_period / STEPS_PER_PERIOD)
        work["max_steps"] = _MOST_STEPS
        prepared.equip(work)
        breaks, pieces = _pieces(motion, self, effects, shift)
        work["late"] = pieces.shape[1] - 1
        t, first = motion.t, np.arange(w) * k
        spans = np.column_stack(
            [np.searchsorted(breaks, t[self.starts]), np.searchsorted(breaks, t[self.rows[:, -1]]),
             first, first + k]
        )  # fmt: skip
        begin = start_with_effects.address if effects.acts else 0
        memory = np.zeros((w, 0))
        if begin and effects.inner:
            memory = self.inner
            if memory is None:
                memory = inner_states_of(effects, rig, motion, self.starts)
        states, inner = np.zeros((w * k, N_STATE)), np.zeros((w * k, memory.shape[1]))
        scratch = (
            np.zeros((w * k, 2), dtype=np.int64), np.zeros(256, dtype=EVENT), np.zeros((0, 4, 1)),
        )  # fmt: skip
        starts = motion.states[:, :4][self.starts] if self.begin is None else self.begin
        run_windows(
            prepared.p[0], np.zeros(1, RUN)[0], work[0], prepared.pair[0], begin, (breaks, pieces),
            spans, t[self.rows].ravel(), starts, memory, (states, inner), scratch,
        )  # fmt: skip
        return states.reshape(w, k, N_STATE), inner

    def _errors(
        self, prepared: Prepared, motion: Motion, states: FloatArray, inner: FloatArray
    ) -> FloatArray:
        """What the encoders' errors are at the predicted rows, rad.

        A late encoder is no easier to predict for that: the error of its delay is the motion's.
        """
        effects, rows = prepared.effects, self.rows.ravel()
        flat = states.reshape(-1, N_STATE)
        angles = np.column_stack([flat[:, 0] + flat[:, 3], flat[:, 3]])
        now = motion.angles[rows]
        since = [late_angles(motion, delay, rows) - now for delay in effects.encoder_delays]
        late = angles[:, np.newaxis] + np.stack(since, axis=1)
        found = errors_of(prepared.p, effects.entries, motion.t[rows], flat, inner, late)
        return found.reshape(*states.shape[:2], 2)


def _without_errors(read: Motion, rig: Rig, effects: Declared) -> Motion:
    """The motion of the discs where `read` is what encoders with errors made of it."""
    ahead = _ahead(read, effects)
    timely = tuple(e for e in rig.effects if not str(e.get("id")).startswith("encoder_delay"))
    errors = reading_errors(declared(rig.replace(effects=timely)), rig, ahead)
    rates = np.gradient(errors, read.t, axis=0)
    states = ahead.states.copy()
    states[:, 0] -= errors[:, 0] - errors[:, 1]
    states[:, 3] -= errors[:, 1]
    states[:, 1:3] -= rates
    return replace(read, states=states)


def _ahead(read: Motion, effects: Declared) -> Motion:
    """The motion behind encoders that report late: what they read so much later."""
    late = effects.encoder_delays > 0.0
    if not late.any():
        return read
    t, angles, states = read.t, read.angles, read.states.copy()
    for entry in effects.entries[late]:
        disc = 0 if entry["upper"] else 1
        for known in (angles[:, disc], states[:, 1 + disc]):
            known[:] = np.interp(t + float(entry["delay"]), t, known)
    states[:, 0], states[:, 3] = angles[:, 0] - angles[:, 1], angles[:, 1]
    return replace(read, states=states)


def _pieces(
    motion: Motion, windows: Windows, effects: Declared, shift: float
) -> tuple[FloatArray, FloatArray]:
    """The held voltage, cut also where windows begin and end and where its past changes."""
    t, u = motion.t, motion.u
    ends = np.zeros(len(t), dtype=np.bool_)
    ends[[0, -1]] = ends[windows.starts] = ends[windows.rows[:, -1]] = True
    breaks, values = np.empty(2 * len(t)), np.empty(2 * len(t))
    pieces = hold(t, u, shift, ends, breaks, values)
    found = Voltage(breaks[: pieces + 1], values[:pieces, np.newaxis])
    if effects.reads_past:
        before = 0.0 if abs(motion.states[0, 1]) < RESTING else float(u[0])
        found, _ = with_past(found, effects.delay, before, sampled_voltage(t + shift, u))
    return found.breaks, np.ascontiguousarray(found.pieces)


def resume(rig: Rig, motion: Motion, rows: slice, inner: FloatArray | None) -> Predicted:
    """Simulate on from a row of a motion, through the voltage that was recorded with it.

    Effects take the time and what they read of the past from the motion.

    Args:
        rig: parameters and effects.
        motion: how the rig moved.
        rows: from the row to begin with to the one after the last, without a restart between.
        inner: inner states of the effects that move the rig, of `inner_states`; None to begin
            anew.

    Raises:
        InputError: an effect of the rig is wrong.
        RuntimeError: the step size collapsed.
    """
    first = int(motion.restarts[motion.restarts <= rows.start].max())
    known, t = slice(first, rows.stop), motion.t[rows]
    moving = acting(rig)
    run = simulate(
        moving, Voltage(motion.t[known], motion.u[first : rows.stop - 1, None]),
        float(t[-1] - t[0]), t_start=float(t[0]), t_eval=t, initial=motion.states[rows.start, :4],
        inner=inner, method="dopri5", rtol=1e-7, atol=1e-9,
    )  # fmt: skip
    angles = np.column_stack([run.theta_u, run.theta_l])
    if len(moving.effects) < len(rig.effects):
        both = np.vstack([motion.states[first : rows.start, :4], run.state])
        whole = Motion(
            motion.t[known], motion.u[known], np.hstack([both, np.zeros((len(both), 2))]),
            np.zeros(1, dtype=np.int64),
        )  # fmt: skip
        angles += reading_errors(declared(rig), rig, whole)[rows.start - first :]
    return Predicted(run.state, angles, run.inner)
