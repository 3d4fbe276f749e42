"""The motion that readings show by themselves, without a model of the rig."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from drill_env._types import FloatArray
from drill_env.effects.along import Motion
from drill_env.identification.initial_state import local_fit
from drill_env.identification.samples import Samples
from drill_env.parameters import Rig

# Between two parabolas, s; a disc hardly moves otherwise in between.
_SPACING = 0.02
_FEWEST = 2


def motion_as_read(samples: Samples, rig: Rig) -> Motion:
    """Angles and speeds by parabolas over the readings around every 20 ms, see `local_fit`.

    Args:
        samples: with the angle of each disc that the rig has.
        rig: with one inertia the lower disc stands still.

    Returns:
        The motion as the encoders read it.
    """
    t, n = samples.t, len(samples.t)
    upper = _smooth(samples, 0)
    lower = _smooth(samples, 1) if rig.inertias == 2 else np.zeros((n, 2))
    states = np.zeros((n, 6))
    states[:, 0], states[:, 3] = upper[:, 0] - lower[:, 0], lower[:, 0]
    states[:, 1], states[:, 2] = upper[:, 1], lower[:, 1]
    states[:, 4:] = np.gradient(states[:, 1:3], t, axis=0)
    return Motion(t, samples.u, states, samples.restarts, samples.recording.fingerprint())


def _smooth(samples: Samples, disc: int) -> FloatArray:
    """Angle and speed of a disc at each row, shape (n, 2)."""
    name = samples.names[disc]
    step = samples.recording.quanta.get(name)
    read, out = samples.angles[:, disc], np.zeros((len(samples.t), 2))
    edges = [*samples.restarts.tolist(), len(samples.t)]
    for a, b in zip(edges, edges[1:], strict=False):
        t, known = samples.t[a:b], np.flatnonzero(np.isfinite(read[a:b]))
        if len(known) < _FEWEST:
            continue
        place, angles = t[known], read[a:b][known]
        stride = max(1, round(_SPACING / float(np.median(np.diff(place)))))
        rows = np.unique(np.append(np.arange(0, len(known), stride), len(known) - 1))
        fits = np.array([local_fit(place, angles, row, step) for row in rows.tolist()])
        spline = CubicHermiteSpline(place[rows], fits[:, 0], fits[:, 1])
        out[a:b] = np.column_stack([spline(t), spline(t, 1)])
    return out
