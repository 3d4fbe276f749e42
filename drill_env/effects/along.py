"""What effects do along a known motion of the rig."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.effects._along import follow
from drill_env.effects._along_interval import call_over_interval as call_over_interval
from drill_env.effects._along_interval import over_interval as over_interval
from drill_env.effects.declared import Declared, declared
from drill_env.effects.readings import errors_of
from drill_env.effects.signal import ENTRY, MOST_STATES, PORTS, SIGNAL, number_places
from drill_env.friction import kernel_record
from drill_env.parameters import Rig

_NO_ROWS: IntArray = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """How the rig moved.

    Attributes:
        t: times in s, shape (n,).
        u: held voltages, V, shape (n,).
        states: twist, omega_u, omega_l, theta_l and both accelerations, shape (n, 6).
        restarts: rows after a gap, and row 0; shape (m,).
        recording: fingerprint of the recording it was told by, see `Recording.fingerprint`.
    """

    t: FloatArray
    u: FloatArray
    states: FloatArray
    restarts: IntArray
    recording: int = 0

    @property
    def angles(self) -> FloatArray:
        """theta_u and theta_l, rad, shape (n, 2)."""
        return np.column_stack([self.states[:, 0] + self.states[:, 3], self.states[:, 3]])

    def until(self, end: int) -> Motion:
        """Its rows before the row `end`."""
        restarts = self.restarts[self.restarts < end]
        t, u, states = self.t[:end], self.u[:end], self.states[:end]
        return replace(self, t=t, u=u, states=states, restarts=restarts)


def joined(*parts: Declared) -> Declared:
    """Several bundles as one, in their order but for a drive, which comes last.

    The parts must live as long: the entries hold addresses of their tables.
    """
    entries = np.concatenate([part.entries for part in parts], dtype=ENTRY)
    entries = entries[np.argsort(entries["drives"], kind="stable")]
    number_places(entries)
    return Declared(entries, tuple(table for part in parts for table in part.tables))


def responses_along(effects: Declared, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """Torques and encoder errors of effects, their sum.

    Args:
        effects: of `declared` or `bundled`.
        rig: parameters of the rig.
        motion: how the rig moved, taken as straight between the rows.

    Returns:
        Mean torques (Nm) on the upper and lower disc over the interval after each row and errors
        (rad) of theta_u and theta_l at each row, both of shape (n, 2).
    """
    torques = np.zeros((len(motion.t), 2))
    for entry in effects.entries[effects.entries["senses"] == 0]:
        torques += _followed(entry, rig, motion, _NO_ROWS)[0]
    return torques, reading_errors(effects, rig, motion)


def reading_errors(effects: Declared, rig: Rig, motion: Motion) -> FloatArray:
    """Errors (rad) that effects give to the readings of theta_u and theta_l, shape (n, 2)."""
    senses = effects.entries[effects.entries["senses"] != 0]
    if not len(senses):
        return np.zeros((len(motion.t), 2))
    inner = _inner(effects, senses, rig, motion, np.arange(len(motion.t)))
    late = np.stack([late_angles(motion, delay) for delay in effects.encoder_delays], axis=1)
    return errors_of(kernel_record(rig), effects.entries, motion.t, motion.states, inner, late)


def inner_states(rig: Rig, motion: Motion, rows: IntArray) -> FloatArray:
    """Inner states with which a simulation can go on from rows of a known motion.

    Args:
        rig: parameters and effects.
        motion: how the rig moved, taken as straight between the rows.
        rows: to go on from, ascending, shape (r,).

    Returns:
        Shape (r, m), see `Trajectory.inner`.

    Raises:
        InputError: an effect of the rig is wrong.
    """
    return inner_states_of(declared(rig), rig, motion, np.asarray(rows, dtype=np.int64))


def inner_states_of(effects: Declared, rig: Rig, motion: Motion, rows: IntArray) -> FloatArray:
    """The same of effects that are those of the rig, laid out already."""
    return _inner(effects, effects.entries, rig, motion, rows)


def late_angles(motion: Motion, delay: float, rows: IntArray | None = None) -> FloatArray:
    """theta_u and theta_l (rad) a delay (s) before each row, cubic between rows; shape (n, 2).

    Nothing is known from before a restart: there it is the angle of that row.

    Args:
        motion: how the rig moved.
        delay: s.
        rows: all by default, shape (n,).
    """
    t, restarts, states = motion.t, motion.restarts, motion.states
    rows = np.arange(len(t)) if rows is None else rows
    first = restarts[np.searchsorted(restarts, rows, side="right") - 1]
    late = np.maximum(t[rows] - delay, t[first])
    a = np.clip(np.searchsorted(t, late, side="right") - 1, 0, len(t) - 2)
    width = t[a + 1] - t[a]
    share = (late - t[a]) / width
    # The cubic through both angles and speeds (Hermite).
    weights = np.stack(
        [(1.0 + 2.0 * share) * (1.0 - share) ** 2, share * (1.0 - share) ** 2 * width,
         share**2 * (3.0 - 2.0 * share), share**2 * (share - 1.0) * width]
    )  # fmt: skip
    lower = np.stack([states[a, 3], states[a, 2], states[a + 1, 3], states[a + 1, 2]])
    twist = np.stack([states[a, 0], states[a + 1, 0]])
    upper = lower.copy()
    upper[::2] += twist
    upper[1::2] = states[a, 1], states[a + 1, 1]
    return np.stack([(weights * upper).sum(axis=0), (weights * lower).sum(axis=0)], axis=1)


def _inner(
    effects: Declared, wanted: np.ndarray, rig: Rig, motion: Motion, rows: IntArray
) -> FloatArray:
    kept = np.zeros((len(rows), effects.inner))
    for entry in wanted[wanted["states"] > 0]:
        way = motion.until(int(rows[-1]) + 1)
        first = int(entry["first_state"])
        kept[:, first : first + int(entry["states"])] = _followed(entry, rig, way, rows)[1]
    return kept


def _followed(
    entry: np.ndarray, rig: Rig, motion: Motion, rows: IntArray
) -> tuple[FloatArray, FloatArray]:
    signal, ports = np.zeros(1, dtype=SIGNAL)[0], np.zeros(1, dtype=PORTS)[0]
    torques, kept = np.zeros((len(motion.t), 2)), np.zeros((len(rows), int(entry["states"])))
    follow(
        kernel_record(rig)[0], entry, signal, ports, over_interval.address, motion.t, motion.u,
        motion.states, motion.restarts, np.zeros((11, MOST_STATES)), torques, rows, kept,
    )  # fmt: skip
    return torques, kept
