"""Fits of a friction law to recordings that were fitted with another one: starts and descent."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from drill_env._types import FrictionLaw
from drill_env.friction import lower_curve
from drill_env.identification.coordinates import Coordinates, free_names
from drill_env.identification.descent import Problem, descend, point_at
from drill_env.identification.drive import with_known_scale
from drill_env.identification.estimate import Estimate, FitOptions, identify
from drill_env.identification.knowledge import typical_noise
from drill_env.identification.known_loads import tells_scale
from drill_env.identification.noise_of_recording import estimated_noise
from drill_env.identification.prediction_error import score
from drill_env.identification.samples import prepare
from drill_env.identification.sandwich import sandwich_covariance
from drill_env.parameters import Rig
from drill_env.recordings import Recording

_SPEEDS = 200
# Candidates: stiction and size over the present curve's peak, share of the stiction that is
# lost with speed, and how often by e up to the top speed.
_LEVELS, _FACTORS = (0.25, 0.4, 0.6, 0.8), (0.5, 0.75, 1.0, 1.5)
_DROPS, _PACES = (0.3, 0.8), (1.0, 4.0)
_SCREENED = 20.0
_SCREEN_ROUNDS = 5


def _candidates(rig: Rig, law: FrictionLaw, top: float) -> list[Rig]:
    """Rigs with another law whose curves pass near the present one, up to `top` rad/s."""
    speeds = np.linspace(0.01, 1.0, _SPEEDS) * top
    wanted = lower_curve(rig, speeds)
    size = float(np.abs(wanted).max())
    if law == "humped":
        shape = Rig.paper()
        scale = size / float(lower_curve(shape, np.linspace(0.0, 15.0, _SPEEDS)).max())
        parts = {n: scale * getattr(shape, n) for n in ("Tsl", "T1", "T2", "bl")}
        betas = {"beta1": shape.beta1, "beta2": shape.beta2}
        sizes = [{n: f * v for n, v in parts.items()} for f in _FACTORS]
        return [rig.replace(friction=law, **values, **betas) for values in sizes]
    drops = [(0.0, 1.0)] if law == "coulomb" else [(d, p / top) for d in _DROPS for p in _PACES]
    found = []
    for level in _LEVELS:
        for drop, beta1 in drops:
            flat = rig.replace(
                friction=law, Tsl=level * size, T1=-drop * level * size, beta1=beta1, bl=0.0
            )
            left = wanted - lower_curve(flat, speeds)
            found.append(flat.replace(bl=float(speeds @ left / (speeds @ speeds))))
    return found


def law_starts(
    law: FrictionLaw, rig: Rig, plain: Rig | None, recording: Recording, top: float
) -> list[Rig]:
    """Where to start a law: the likeliest candidates on a short part, and the law it contains.

    The curve nearest to the present one is a bad start: a little too much stiction holds the
    disc where it should slip, and the descent then explains everything by noise.

    Args:
        law: wanted.
        rig: fitted, with a law of its own.
        plain: fitted with the Coulomb law, if it was.
        recording: to screen on.
        top: see `top_speed`.
    """
    if law == rig.friction:
        return [rig]
    part = recording.part(0, min(len(recording), round(_SCREENED * recording.rate)))
    samples = prepare(part, rig)

    def value(candidate: Rig) -> float:
        noise, starts = estimated_noise(samples, candidate, rounds=_SCREEN_ROUNDS)
        return score(samples, candidate, noise, starts).value

    ranked = sorted(_candidates(rig, law, top), key=value)
    second = next((c for c in ranked if c.Tsl != ranked[0].Tsl), ranked[0])
    starts = [ranked[0], second]
    if law == "stribeck" and plain is not None:
        starts.append(plain.replace(friction=law, T1=-_DROPS[0] * plain.Tsl, beta1=1.0 / top))
    return starts


def fit_from(
    recordings: Sequence[Recording],
    start: Rig,
    fixed: Mapping[str, float],
    options: FitOptions,
    report: Callable[[int, float], None] | None,
    *,
    warm: bool,
) -> Estimate:
    """Fit the law of a rig.

    Args:
        recordings: to fit.
        start: where to begin.
        fixed: parameters given.
        options: how to fit.
        report: called with iteration and minus twice the log likelihood.
        warm: begin with the noise that suits the start. `identify` begins with noise for a
            rig 30 % off; a law that never fits then wanders off until noise explains all.
    """
    if not warm or options.method != "prediction_error":
        progress = (lambda _, i, v: report(i, v)) if report else None
        return identify(recordings, start, fixed=fixed, options=options, progress=progress)
    fixed = with_known_scale(recordings, fixed)
    base = start.replace(**fixed)
    samples = tuple(prepare(r, base, offset=options.offset) for r in recordings)
    fits = [estimated_noise(sample, base) for sample in samples]
    models = [noise for noise, _ in fits]
    each = options.noise == "each"
    free = free_names(None, base, fixed, scaled=tells_scale(recordings))
    problem = Problem(
        samples=samples, groups=tuple(range(len(samples))) if each else (0,) * len(samples),
        coordinates=Coordinates(base, free), doubt=options.doubt,
        robust=options.robust,
    )  # fmt: skip
    noise = models if each else [typical_noise(models)]
    starts = [begun for _, begun in fits]
    here = point_at(problem, problem.coordinates.vector(base), noise, starts)
    here, ended, steps = descend(problem, here, limit=options.limit, report=report)
    return Estimate(
        rig=here.rig, free=problem.coordinates.free, problem=problem, point=here, options=options,
        coordinate_covariance=sandwich_covariance(problem, here), converged=ended,
        iterations=steps, start_values=np.array([here.value]),
    )  # fmt: skip


def top_speed(recordings: Sequence[Recording]) -> float:
    """A speed (rad/s) that the lower disc reaches, above most others."""
    speeds = []
    for recording in recordings:
        omega = recording.velocities().get("omega_l")
        if recording.theta_l is None and omega is not None:
            speeds.append(np.abs(omega[np.isfinite(omega)]))
            continue
        theta = recording.channel("theta_l")
        stride = min(max(1, round(0.1 * recording.rate)), len(recording) - 1)
        spans = recording.t[stride:] - recording.t[:-stride]
        speeds.append(np.abs(theta[stride:] - theta[:-stride]) / spans)
    return max(float(np.quantile(np.concatenate(speeds), 0.98)), 0.1)
