"""A recording: the channels of one run on the rig, in SI units."""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from drill_env._checks import real
from drill_env._errors import InputError, printable
from drill_env._types import BoolArray, FloatArray, IntArray
from drill_env.recordings.columns import missing_text
from drill_env.recordings.limits import LARGEST
from drill_env.recordings.prescribed import held_acceleration
from drill_env.recordings.units import ANGLES, INERTIAS, LOADS, VELOCITIES, Channel

Drive: TypeAlias = Literal["voltage", "torque", "motion"]
"""What drives the rig: the motor's voltage, its torque (of a linear axis, force) itself, or
something unknown, where the upper disc's measured motion is the input."""

BRAKES = 1e-12
"""Voltage (V) of a bridge that brakes at 0 V: below any converter's step, and not 0."""

_CHANNELS: tuple[Channel, ...] = ("t", "u", *ANGLES, *VELOCITIES, *LOADS, "bridge")
_GAP = 1.8


def is_gap(t: FloatArray) -> BoolArray:
    """Whether rows are missing between neighbouring times (s), shape (n - 1,)."""
    steps = np.diff(t)
    return steps > _GAP * float(np.median(steps))


def _bridged(recording: Recording, bridge: FloatArray) -> FloatArray | None:
    """The voltage, 0 where the bridge is off and nowhere else."""
    u, source = recording.u, recording.source
    if recording.drive != "voltage":
        raise InputError(
            f"{source}: bridge goes with a voltage u; a measured torque is 0 where the motor "
            "coasts, and an unknown drive has none: leave bridge out"
        )
    other = bridge[(bridge != 0.0) & (bridge != 1.0)]
    if len(other):
        raise InputError(
            f"{source}: bridge is {other[0]:g} in {len(other)} rows; give 1 where it drives or "
            "brakes and 0 where it is off"
        )
    driven = None if u is None else np.where(u == 0.0, BRAKES, u)
    return None if driven is None else np.where(bridge == 0.0, 0.0, driven)


def _tables(source: str, effects: Any) -> tuple[Mapping[str, Any], ...]:
    if isinstance(effects, (tuple, list)) and all(isinstance(e, Mapping) for e in effects):
        return tuple(effects)
    raise InputError(
        f"{source}: effects is {effects!r}; give a list of tables, each with its id, as those of "
        "a rig file"
    )


class RecordingWarning(UserWarning):
    """Something in a recording that the reader should know of.

    Attributes:
        code: what it is, one of "jitter", "gap", "slow_clock", "constant", "saturated",
            "wrapped", "jump", "implausible_speed", "large_voltage", "ignored_column",
            "two_drives", "missing", "clocks", "interpolated", "no_manifest", "twist_offset",
            "hidden_state", "coasting", "long", or one of
            `drill_env.identification.screening.findings`.
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(printable(message))
        self.code = code


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """One run. Row i holds the readings at t[i] and the drive held from t[i] to t[i+1].

    Rows that were lost are not there: a gap shows as a long step of `t`, see `gaps`. A reading
    that is missing while the drive is known is NaN, if it was read with missing="keep".

    Attributes:
        t: times in s, strictly ascending, shape (n,).
        u: motor voltage in V, or motor torque in Nm (force in N) where `drive` says so,
            shape (n,), or None. Where the motion is the drive, leave it None: it becomes the upper
            disc's acceleration in rad/s^2, held so that it leads along the measured motion.
        theta_u: upper-disc angle in rad (or position in m), shape (n,), or None; NaN if missing.
        theta_l: lower-disc angle in rad, shape (n,), or None; NaN where missing.
        omega_u: upper-disc velocity in rad/s (or m/s) as measured, and not as computed from
            `theta_u`, shape (n,), or None; NaN where missing.
        omega_l: lower-disc velocity likewise.
        load_u: torque in Nm (force in N) that was measured to act on the upper disc from outside,
            positive along theta_u, shape (n,), or None. It is read at t[i] as an angle is, and
            straight in between.
        load_l: the same of the lower disc.
        bridge: 1 where the motor's bridge drives or brakes and 0 where it is off, held as `u` is,
            shape (n,), or None. With it `u` is 0 only there: where 0 V brake, `u` is `BRAKES`.
        added_inertia_u: bolted on the upper disc in this run alone, kg m^2 (kg if linear).
        added_inertia_l: the same of the lower disc.
        effects: known physics of this run alone, tables as the `[[effects]]` of a rig file.
        drive: what `u` is.
        extra: other numeric columns as they stand in the file, each of shape (n,).
        constants: single numbers in the file, such as a drive gain.
        quanta: encoder step of each angle where one is visible, rad.
        stated: encoder step of each angle that was given in counts, by the stated counts a turn.
        source: the file it came from.
        columns: all columns found in the file.
        notes: what the checks remarked.
    """

    t: FloatArray
    u: FloatArray | None = None
    theta_u: FloatArray | None = None
    theta_l: FloatArray | None = None
    omega_u: FloatArray | None = None
    omega_l: FloatArray | None = None
    load_u: FloatArray | None = None
    load_l: FloatArray | None = None
    bridge: FloatArray | None = None
    added_inertia_u: float = 0.0
    added_inertia_l: float = 0.0
    effects: tuple[Mapping[str, Any], ...] = ()
    drive: Drive = "voltage"
    extra: Mapping[str, FloatArray] = field(default_factory=dict)
    constants: Mapping[str, float] = field(default_factory=dict)
    quanta: Mapping[str, float] = field(default_factory=dict)
    stated: Mapping[str, float] = field(default_factory=dict)
    source: str = "recording"
    columns: tuple[str, ...] = ()
    notes: tuple[RecordingWarning, ...] = ()

    def __post_init__(self) -> None:
        for name, values in self.channels().items():
            if values.shape != self.t.shape or values.ndim != 1:
                raise InputError(
                    f"{self.source}: {name} has shape {values.shape} and t {self.t.shape}; "
                    "make them one-dimensional and equally long"
                )
        for name in INERTIAS:
            most, value = LARGEST[name][0], real(getattr(self, name), f"{self.source}: {name}")
            if not 0.0 <= value <= most:
                raise InputError(
                    f"{self.source}: {name} is {value:g}; give what was added to the rig, 0 to "
                    f"{most:g} kg m^2, and write the rig without it"
                )
        object.__setattr__(self, "effects", _tables(self.source, self.effects))
        if self.bridge is not None:
            object.__setattr__(self, "u", _bridged(self, self.bridge))
        if self.drive == "motion" and self.u is None:
            held = held_acceleration(self.t, self.theta_u, self.omega_u, self.source)
            object.__setattr__(self, "u", held)

    def __len__(self) -> int:
        return len(self.t)

    def channels(self) -> dict[Channel, FloatArray]:
        """The channels present, t among them."""
        values: dict[Channel, FloatArray | None] = {c: getattr(self, c) for c in _CHANNELS}
        return {name: value for name, value in values.items() if value is not None}

    def fingerprint(self) -> int:
        """A number that copies of the recording share and other recordings do not."""
        mark = 0
        for values in self.channels().values():
            mark = zlib.crc32(values.tobytes(), mark)
        return mark

    def angles(self) -> dict[Channel, FloatArray]:
        """The angle channels present."""
        return {name: value for name, value in self.channels().items() if name in ANGLES}

    def velocities(self) -> dict[Channel, FloatArray]:
        """The velocity channels present."""
        return {name: value for name, value in self.channels().items() if name in VELOCITIES}

    def loads(self) -> dict[Channel, FloatArray]:
        """The channels of measured loads present."""
        return {name: value for name, value in self.channels().items() if name in LOADS}

    def coasts(self) -> bool:
        """Whether the bridge is off in some rows."""
        return self.bridge is not None and not self.bridge.all()

    def readings(self) -> dict[Channel, FloatArray]:
        """Angles and velocities present."""
        return self.angles() | self.velocities()

    def channel(self, name: Channel) -> FloatArray:
        """One channel, shape (n,).

        Raises:
            InputError: the recording does not hold it.
        """
        values = self.channels().get(name)
        if values is None:
            found = self.columns or tuple(self.channels())
            raise InputError(missing_text(self.source, (name,), found))
        return values

    @property
    def interval(self) -> float:
        """Mean sampling interval in s, as if rows that are missing were there."""
        steps = np.diff(self.t)
        return float((self.t[-1] - self.t[0]) / np.rint(steps / np.median(steps)).sum())

    @property
    def rate(self) -> float:
        """Samples per second."""
        return 1.0 / self.interval

    @property
    def duration(self) -> float:
        """Time from the first to the last sample in s."""
        return float(self.t[-1] - self.t[0])

    @property
    def gaps(self) -> IntArray:
        """Rows after which rows are missing: the next one is 1.8 usual intervals away or more."""
        return np.flatnonzero(is_gap(self.t))

    def stretches(self) -> tuple[Recording, ...]:
        """The parts between the gaps, those of one row left out."""
        ends = [0, *(self.gaps + 1).tolist(), len(self)]
        pairs = zip(ends, ends[1:], strict=False)
        return tuple(self.part(a, b) for a, b in pairs if b - a > 1)

    def has_note(self, code: str) -> bool:
        """Whether a check remarked `code`."""
        return any(note.code == code for note in self.notes)

    def constant(self, name: str) -> float:
        """A single number of the file: a scalar, or a column that never changes.

        Raises:
            InputError: there is none of that name, or the column varies.
        """
        if name in self.constants:
            return self.constants[name]
        column = self.extra.get(name)
        if column is None:
            found = ", ".join([*self.constants, *self.extra]) or "none"
            raise InputError(f"{self.source}: no number {name}; found besides channels: {found}")
        if not np.all(column == column[0]):
            raise InputError(f"{self.source}: column {name} varies; give the number itself")
        return float(column[0])

    def part(self, start: int, stop: int) -> Recording:
        """Rows start to stop - 1, with the same source and notes."""
        cut = {name: values[start:stop] for name, values in self.channels().items()}
        extra = {name: values[start:stop] for name, values in self.extra.items()}
        return replace(self, extra=extra, **cut)
