"""The paper's two stages: the upper disc alone, then the whole rig."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, TypeAlias

import numpy as np

from drill_env._errors import InputError
from drill_env.identification.coordinates import inverse
from drill_env.identification.estimate import Estimate, FitOptions, Progress, identify
from drill_env.identification.prior import Prior
from drill_env.parameters import Rig
from drill_env.parameters.rig import UPPER
from drill_env.recordings import Recording

StageLink: TypeAlias = Literal["fixed", "prior", "free"]
"""How stage 2 takes stage 1: as it is, with its covariance, or as a first guess only."""


def identify_stages(
    stage1: Sequence[Recording],
    stage2: Sequence[Recording],
    rig: Rig,
    *,
    fixed: Mapping[str, float],
    link: StageLink = "prior",
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> tuple[Estimate, Estimate]:
    """Identify the upper disc without the string, then the whole rig; section 2.3 of the paper.

    With ``link="prior"`` the second stage weighs the first one's estimates and their correlations
    against its own recordings, which is the joint fit of both.

    Args:
        stage1: recordings of the upper disc alone, with u and theta_u.
        stage2: recordings of the whole rig.
        rig: where to start, the whole rig.
        fixed: parameters given; km, Ju or another upper one sets the scale of torque.
        link: how stage 2 takes stage 1.
        options: how to fit.
        progress: called with (start, iteration, minus twice the log likelihood).

    Returns:
        The estimates of both stages.

    Raises:
        InputError: an argument is out of range or a channel is missing.
    """
    upper_fixed = {name: value for name, value in fixed.items() if name in UPPER}
    alone = Rig.one_inertia(**{name: getattr(rig, name) for name in UPPER})
    first = identify(stage1, alone, fixed=upper_fixed, options=options, progress=progress)
    found = {name: getattr(first.rig, name) for name in UPPER}
    begun = rig.replace(**found)
    if link == "fixed":
        second = identify(
            stage2, begun, fixed={**fixed, **found}, options=options, progress=progress
        )
        return first, second
    if link not in ("prior", "free"):
        raise InputError(f"link is {link!r}: give fixed, prior or free")
    prior = None
    if link == "prior":
        means = np.array([found[name] for name in first.free])
        precision = inverse(first.covariance)
        prior = Prior(first.free, means, precision)
    second = identify(stage2, begun, fixed=fixed, prior=prior, options=options, progress=progress)
    return first, second
