"""Where windows begin: on the model's own motion through the readings around their first row."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drill_env._types import FloatArray
from drill_env.effects.along import Motion
from drill_env.identification.samples import Samples
from drill_env.integrator.prepared import Prepared
from drill_env.integrator.windows import Predicted, Windows
from drill_env.parameters import Rig

WIDEST = 0.15
"""Before and behind a start readings are used at most so far, s: those of `local_fit`, 0.3 s."""
# Rows on each side: seven readings determine a parabola and leave four to average.
_FEWEST = 3


@dataclass(frozen=True, slots=True, eq=False)
class Starts:
    """Readings around the first rows of windows.

    The rig moves through them by itself; a parabola through what is left tells angle and speed.
    The drive and all that the model knows may change as fast as they will, as only what it lacks
    has to be smooth. A parabola through the readings themselves errs by the change of the drive.

    Attributes:
        around: windows that begin before the starts and end behind them.
        at: place of a start among their rows.
        read: what the encoders read there, rad, 0 where it is missing, shape (w, m, c).
        average: weights of the readings in angle and speed at the start, shape (w, 2, m, c).
        first: likewise at the first row of `around`.
    """

    around: Windows
    at: int
    read: FloatArray
    average: FloatArray
    first: FloatArray

    def states(
        self, rig: Rig | Prepared, motion: Motion, shift: float
    ) -> tuple[FloatArray, FloatArray]:  # fmt: skip
        """States at the starts, shape (w, 4), and the effects' inner states, shape (w, m).

        These are to where the rig's own motion leads: what strikes or turns back in between, the
        readings' parabolas smooth away.

        Args:
            rig: parameters and effects.
            motion: of the recording, under the drive that acts on the rig.
            shift: by which the drive acts later than the clock of the readings says, s.
        """
        moved, left = self._moved(rig, motion, shift)
        return _corrected(moved.states[:, self.at], self.average, left), moved.inner[:, self.at]

    def led(self, rig: Rig | Prepared, motion: Motion, shift: float) -> Starts:
        """The same with the motion around a start begun where a rig leaves nothing.

        An error of speed there fades as the rig has it, which no parabola follows.

        Args:
            rig: fitted to the recording.
            motion: of the recording, under the drive that acts on the rig.
            shift: by which the drive acts later than the clock of the readings says, s.
        """
        _, left = self._moved(rig, motion, shift)
        begin = motion.states[self.around.starts, :4]
        begin = begin if self.around.begin is None else self.around.begin
        begin = _corrected(begin, self.first, left)
        return replace(self, around=replace(self.around, begin=begin))

    def _moved(
        self, rig: Rig | Prepared, motion: Motion, shift: float
    ) -> tuple[Predicted, FloatArray]:
        """The rig's own motion around the starts, and what is left of the readings, rad."""
        moved = replace(self.around, motion=motion).predicted(rig, shift=shift)
        left = self.read - moved.readings[..., : self.read.shape[2]]
        return moved, np.where(np.isfinite(left), left, 0.0)


def _corrected(states: FloatArray, weights: FloatArray, left: FloatArray) -> FloatArray:
    """States, shape (w, 4), moved by what weights say of readings that are left."""
    found, count = states.copy(), left.shape[2]
    angle, speed = np.zeros((2, len(found), 2))
    angle[:, :count], speed[:, :count] = np.einsum("wimc,wmc->iwc", weights, left)
    found[:, 0] += angle[:, 0] - angle[:, 1]
    found[:, 1:3] += speed
    found[:, 3] += angle[:, 1]
    return found


def starts_of(samples: Samples, windows: Windows, channels: int, width: float) -> Starts:
    """Readings around the starts of windows.

    Args:
        samples: of the recording.
        windows: at least `WIDEST` from either end of their stretch.
        channels: discs that are predicted.
        width: on either side, s.
    """
    t = samples.t
    side = rows_within(samples, width)
    rows = windows.starts[:, np.newaxis] + np.arange(1 - side, side + 1)
    read = samples.angles[rows][..., :channels]
    known = np.isfinite(read)
    late = (t[rows] - t[windows.starts][:, np.newaxis]) / width
    powers = np.stack([np.ones_like(late), late, late**2], axis=2)
    columns = powers[:, :, np.newaxis, :] * known[..., np.newaxis]
    inverse = np.asarray(np.linalg.pinv(columns.swapaxes(1, 2)), dtype=np.float64)
    inverse = inverse.transpose(0, 2, 3, 1)
    begin = ((t[windows.starts - side] - t[windows.starts]) / width)[:, np.newaxis, np.newaxis]
    angle = inverse[:, 0] + begin * inverse[:, 1] + begin**2 * inverse[:, 2]
    speed = inverse[:, 1] + 2.0 * begin * inverse[:, 2]
    around = Windows(windows.motion, windows.starts - side, rows)
    return Starts(
        around, side - 1, np.where(known, read, 0.0),
        np.stack([inverse[:, 0], inverse[:, 1] / width], axis=1),
        np.stack([angle, speed / width], axis=1),
    )  # fmt: skip


def rows_within(samples: Samples, width: float) -> int:
    """Rows on each side of a start."""
    return max(round(width / float(np.median(np.diff(samples.t)))), _FEWEST)


def widths_of(samples: Samples) -> list[float]:
    """Widths to choose from, s: `WIDEST`, a half of it and so on, while rows are enough."""
    found = [WIDEST]
    while rows_within(samples, 0.5 * found[-1]) > _FEWEST:
        found.append(0.5 * found[-1])
    return found
