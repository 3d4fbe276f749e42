"""The motion that readings show, whatever is missing from the rig."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from drill_env._types import FloatArray
from drill_env.effects.along import Motion
from drill_env.identification.initial_state import local_fit
from drill_env.identification.known_loads import with_added_inertia
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig

# Between two parabolas, s; a disc hardly moves otherwise in between.
_SPACING = 0.02
_FEWEST = 2


def motion_as_read(samples: Samples, rig: Rig) -> Motion:
    """Angles and speeds by parabolas over the readings around every 20 ms, see `local_fit`.

    What the given rig's own torques do between the readings is taken out of them first where that
    lets the parabolas reach further: the drive's jerks, and friction where the disc turns back.

    Args:
        samples: with the angle of each disc that the rig has.
        rig: with one inertia the lower disc stands still.

    Returns:
        The motion as the encoders read it.
    """
    t, n = samples.t, len(samples.t)
    nothing = np.zeros((n, 2))
    upper = _smooth(samples, 0, [nothing])
    if rig.inertias == 1:
        upper = _smooth(samples, 0, [nothing, _led(samples, rig, upper[:, 1])])
    lower = _smooth(samples, 1, [nothing]) if rig.inertias == 2 else nothing
    states = np.zeros((n, 6))
    states[:, 0], states[:, 3] = upper[:, 0] - lower[:, 0], lower[:, 0]
    states[:, 1], states[:, 2] = upper[:, 1], lower[:, 1]
    states[:, 4:] = np.gradient(states[:, 1:3], t, axis=0)
    return Motion(t, samples.u, states, samples.restarts, samples.recording.fingerprint())


def _led(samples: Samples, rig: Rig, speed: FloatArray) -> FloatArray:
    """Angle and speed to which the rig's torques would bring the upper disc, shape (n, 2).

    Args:
        samples: with the drive.
        rig: as given.
        speed: at which its friction is taken, rad/s, shape (n,).
    """
    dt = np.diff(samples.t)
    # Nothing is known of what happened in a gap, and no parabola reaches across.
    dt[samples.restarts[1:] - 1] = 0.0
    w = 0.5 * (speed[1:] + speed[:-1])
    friction = np.sign(w) * rig.Tsu + np.abs(np.sign(w)) * rig.dTsu + rig.bu * w + rig.dbu * abs(w)
    torque = rig.km * samples.u[:-1] + samples.loads[:-1, 0] - friction
    rate = torque / with_added_inertia(rig, samples.recording).Ju
    gained = np.append(0.0, np.cumsum(rate * dt))
    angle = np.append(0.0, np.cumsum((gained[:-1] + 0.5 * rate * dt) * dt))
    return np.column_stack([angle, gained])


def _smooth(samples: Samples, disc: int, known: Sequence[FloatArray]) -> FloatArray:
    """Angle and speed of a disc at each row, shape (n, 2).

    Args:
        samples: with its angle.
        disc: 0 for the upper one.
        known: angles and speeds of which one is taken out and put back, in each row that which
            leaves the speed least doubt; shape (n, 2) each.
    """
    name = samples.names[disc]
    step = samples.recording.quanta.get(name)
    read, out = samples.angles[:, disc], np.zeros((len(samples.t), 2))
    edges = [*samples.restarts.tolist(), len(samples.t)]
    for a, b in zip(edges, edges[1:], strict=False):
        there = a + np.flatnonzero(np.isfinite(read[a:b]))
        if len(there) < _FEWEST:
            continue
        place = samples.t[there]
        stride = max(1, round(_SPACING / float(np.median(np.diff(place)))))
        rows = np.unique(np.append(np.arange(0, len(there), stride), len(there) - 1)).tolist()
        fits = []
        for part in known:
            left = read[there] - part[there, 0]
            told = np.array([local_fit(place, left, row, step) for row in rows])
            told[:, :2] += part[there[rows]]
            fits.append(told)
        best = np.argmin([told[:, 2] for told in fits], axis=0)
        angle, speed, _ = np.array(fits)[best, np.arange(len(rows))].T
        spline = CubicHermiteSpline(place[rows], angle, speed)
        out[a:b] = np.column_stack([spline(samples.t[a:b]), spline(samples.t[a:b], 1)])
    return out
