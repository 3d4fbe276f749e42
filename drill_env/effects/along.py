"""What effects do along a known motion of the rig."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drill_env._types import FloatArray, IntArray
from drill_env.effects import Effect
from drill_env.effects._along import errors_along, inner_along, torques_along
from drill_env.effects._along_interval import over_interval as over_interval
from drill_env.effects._bundles import number_places
from drill_env.effects.declared import Declared, bundled, declared
from drill_env.effects.signal import ENTRY, MOST_STATES, PORTS, SIGNAL
from drill_env.friction import kernel_record
from drill_env.parameters import Rig


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


def joined(*parts: Declared) -> Declared:
    """Several bundles as one, in their order but for a drive, which comes last.

    The parts must live as long: the entries hold addresses of their tables.
    """
    entries = np.zeros(sum(len(part.entries) for part in parts), dtype=ENTRY)
    for place, entry in enumerate(entry for part in parts for entry in part.entries):
        entries[place] = entry
    entries = entries[np.argsort(entries["drives"], kind="stable")]
    number_places(entries)
    return Declared(entries, tuple(table for part in parts for table in part.tables))


def _scratch() -> tuple[np.ndarray, np.ndarray, FloatArray]:
    signal, ports = np.zeros(1, dtype=SIGNAL)[0], np.zeros(1, dtype=PORTS)[0]
    return signal, ports, np.zeros((11, MOST_STATES))


def response_along(
    effect: Effect, q: FloatArray, rig: Rig, motion: Motion
) -> tuple[FloatArray, FloatArray]:
    """Torques and encoder errors of an effect.

    Args:
        effect: of `drill_env.effects.LIBRARY`.
        q: its parameters in their order.
        rig: parameters of the rig.
        motion: how the rig moved, taken as straight between the rows.

    Returns:
        Mean torques (Nm) on the upper and lower disc over the interval after each row and errors
        (rad) of theta_u and theta_l at each row, both of shape (n, 2).
    """
    return _responses(bundled([(effect, q)]).entries, rig, motion)


def responses_along(rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
    """As `response_along`, the sum over a rig's effects.

    Raises:
        InputError: an effect of the rig is wrong.
    """
    # Kept while its entries are read: they hold addresses of its tables.
    effects = declared(rig)
    return _responses(effects.entries, rig, motion)


def reading_errors(rig: Rig, motion: Motion) -> FloatArray:
    """Errors (rad) that the rig's effects give to theta_u and theta_l, shape (n, 2).

    Raises:
        InputError: an effect of the rig is wrong.
    """
    effects = declared(rig)
    return _responses(effects.entries[effects.entries["senses"] != 0], rig, motion)[1]


def _responses(entries: np.ndarray, rig: Rig, motion: Motion) -> tuple[FloatArray, FloatArray]:
    p, both = kernel_record(rig)[0], np.zeros((2, len(motion.t), 2))
    for entry in entries:
        signal, ports, z = _scratch()
        found = np.zeros((len(motion.t), 2))
        run = errors_along if entry["senses"] else torques_along
        run(
            p, entry, signal, ports, motion.t, motion.u, motion.states, motion.restarts, z, found,
        )  # fmt: skip
        both[int(entry["senses"] != 0)] += found
    return both[0], both[1]


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
    effects = declared(rig)
    kept = np.zeros((len(rows), effects.inner))
    if kept.size:
        signal, ports, z = _scratch()
        inner_along(
            kernel_record(rig)[0], effects.entries, signal, ports, motion.t, motion.u,
            motion.states, motion.restarts, z, np.asarray(rows, dtype=np.int64), kept,
        )  # fmt: skip
    return kept
