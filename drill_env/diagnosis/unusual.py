"""Whether a latent torque is so slow, or so fast, that it may be what is missing, not noise."""

from __future__ import annotations

import math
from dataclasses import replace

from drill_env.diagnosis.extended import value_at
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.rounds import NEEDED
from drill_env.identification.noise import usual_noise

# Powers of the ratio of the times by which a torque's size follows: its power at low frequencies
# stays, its variance stays, its power at high frequencies stays.
_POWERS = (0.5, 0.0, -0.5)


def unusual(setting: Setting, fit: Fit) -> dict[str, float]:
    """Usual sizes and correlation times of the latent torques whose times are unusual.

    A time is unusual where the recordings are less likely under the usual one, with the torque's
    size free to follow, by as much as speaks for an effect of one number.

    Args:
        setting: recordings and free parameters.
        fit: whose noise is asked.

    Returns:
        Values as `NoiseModel` names them; nothing where both times are usual.
    """
    usual, found = usual_noise(setting.coordinates.base), {}
    for disc in ("u", "l"):
        if _worse(setting, fit, disc, NEEDED + math.log(max(fit.count, 2))):
            names = (f"torque_{disc}", f"tau_{disc}")
            found |= {name: getattr(usual, name) for name in names}
    return found


def _worse(setting: Setting, fit: Fit, disc: str, by: float) -> bool:
    """Whether minus twice the log likelihood rises by more under a torque's usual time."""
    usual = getattr(usual_noise(setting.coordinates.base), f"tau_{disc}")
    size, time = getattr(fit.noise, f"torque_{disc}"), getattr(fit.noise, f"tau_{disc}")
    tried = (
        replace(fit.noise, **{f"tau_{disc}": usual, f"torque_{disc}": size * (usual / time) ** -p})
        for p in _POWERS
    )
    at = (fit.starts, fit.motions)
    return all(value_at(setting, fit.vector, fit.terms, n, *at) > fit.value + by for n in tried)
