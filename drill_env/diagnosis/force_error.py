"""How much of the force of a lone axis a fit leaves over, by inverse dynamics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drill_env.diagnosis.declare import extended_rig
from drill_env.diagnosis.fit import Fit
from drill_env.effects.along import Motion
from drill_env.identification.inverse_dynamics import (
    InverseOptions,
    force_balance,
    relative_error,
)
from drill_env.recordings import Recording


def force_error(
    recording: Recording, fit: Fit, motion: Motion, options: InverseOptions | None = None
) -> float:
    """Relative force error of a fit of one inertia with its terms, as a share of 1.

    The procedure is that of `rig_force_error`; what the terms add goes through its filters too.

    Args:
        recording: with u and theta_u and no gaps.
        fit: the rig with its terms.
        motion: the recording's, along which the terms are evaluated.
        options: filter and decimation.

    Raises:
        InputError: the recording does not fit.
    """
    options = options or InverseOptions()
    rig = extended_rig(fit.rig, fit.terms).replace(effects=())
    regressors, force, _ = force_balance(recording, rig.km, True, options)
    values = np.array(
        [rig.Ju, rig.bu + rig.dbu, rig.bu - rig.dbu, rig.Tsu + rig.dTsu, rig.Tsu - rig.dTsu]
    )
    added = np.zeros(len(motion.t))
    for term in fit.terms:
        own = getattr(getattr(term.source, "effect", None), "stands_for", "")
        if not own or getattr(fit.rig, own) == getattr(rig, own):
            added += term.source.response(term.q, fit.rig, motion)[0][:, 0]
    # The terms' force takes the voltage's place to be filtered and decimated as it is.
    moved = replace(recording, u=added / rig.km)
    return relative_error(
        force, regressors @ values - force_balance(moved, rig.km, True, options)[1]
    )
