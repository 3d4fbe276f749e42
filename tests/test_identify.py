"""The prediction-error estimator against recordings of another simulator.

The recordings come from `benchmarks/rig_maker.py`, which shares no equation and no integrator
with the package; the gradient is held against finite differences of the likelihood itself.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from benchmarks.rig_maker import make, make_closed_loop, quasi_random
from drill_env import InputError
from drill_env.friction import lower_curve
from drill_env.identification.coordinates import Coordinates
from drill_env.identification.descent import Problem, point_at
from drill_env.identification.estimate import Estimate, FitOptions, identify
from drill_env.identification.noise import NoiseModel, repeated_counts
from drill_env.identification.prediction_error import score, trace_of
from drill_env.identification.prior import Prior
from drill_env.identification.profile import profile
from drill_env.identification.samples import prepare
from drill_env.identification.stages import UPPER, identify_stages
from drill_env.parameters import SYMBOLS, Rig
from drill_env.recordings import Recording

STEP = 2.0 * math.pi / 8192
TORQUES = {"torque_u": 0.02, "torque_l": 2e-4}
QUIET = NoiseModel(torque_u=1e-6, torque_l=1e-8)
FREE = tuple(name for name in SYMBOLS if name != "Ju")


def record(rig: Rig, seed: int, seconds: float = 40.0, **noise: Any) -> Recording:
    """A quasi-random run of the other simulator, read by its encoders."""
    volts = quasi_random(np.random.default_rng(seed), seconds, 200.0, 5.0)
    made = make({name: getattr(rig, name) for name in SYMBOLS}, volts, seed=seed, **noise)
    quanta = {"theta_u": STEP, "theta_l": STEP}
    return Recording(made.t, made.u, made.theta_u, made.theta_l, quanta=quanta)


def off(rig: Rig, seed: int, free: tuple[str, ...] = FREE) -> Rig:
    """Every free parameter up to 30 % off."""
    rng = np.random.default_rng(seed)
    return rig.replace(**{name: getattr(rig, name) * rng.uniform(0.7, 1.3) for name in free})


@cache
def fitted() -> tuple[Rig, Estimate]:
    truth = Rig()
    runs = [record(truth, seed, **TORQUES) for seed in (1, 2)]
    return truth, identify(runs, off(truth, 0), fixed={"Ju": truth.Ju})


def deviations(estimate: Estimate, truth: Rig) -> np.ndarray:
    sizes = np.sqrt(np.diag(estimate.covariance))
    return np.array([getattr(estimate.rig, n) - getattr(truth, n) for n in estimate.free]) / sizes


def curve_error(found: Rig, truth: Rig, fastest: float) -> float:
    speeds = np.linspace(0.0, fastest, 200)
    true = lower_curve(truth, speeds)
    return float(np.abs(lower_curve(found, speeds) - true).max() / np.abs(true).max())


def test_parameters_are_found_from_thirty_percent_off_under_torque_noise() -> None:
    truth, estimate = fitted()
    assert estimate.converged
    assert np.abs(deviations(estimate, truth)).max() < 4.0
    for name in ("km", "bu", "ktheta", "Jl"):
        assert abs(getattr(estimate.rig, name) / getattr(truth, name) - 1.0) < 0.01
    assert curve_error(estimate.rig, truth, 8.0) < 0.01
    noise = estimate.noise[0]
    # Size and colour of the torques come out of the recordings.
    assert noise.torque_u == pytest.approx(0.02, rel=0.15)
    assert noise.torque_l == pytest.approx(2e-4, rel=0.3)
    assert 0.05 < noise.tau_u < 0.2


def test_without_torque_noise_the_fit_is_as_sharp_as_the_free_run() -> None:
    truth = Rig(km=3.3, bu=2.2, Jl=0.036)
    estimate = identify([record(truth, 5)], off(truth, 1), fixed={"Ju": truth.Ju})
    assert np.abs(deviations(estimate, truth)).max() < 4.5
    assert abs(estimate.rig.ktheta / truth.ktheta - 1.0) < 1e-3
    # Predictions over 40 s err by the encoder's rounding and no more.
    assert estimate.noise[0].encoder_l == pytest.approx(STEP / math.sqrt(12.0), rel=0.05)


def test_innovations_are_white_and_of_the_stated_size_at_the_truth() -> None:
    truth, estimate = fitted()
    trace = trace_of(
        estimate.problem.samples[0], truth, NoiseModel(**TORQUES), estimate.point.starts[0]
    )
    z = trace.standardised[200:]
    moving = np.all(estimate.problem.samples[0].repeats[200:] == 1, axis=1)
    assert np.std(z[moving], axis=0) == pytest.approx([1.0, 1.0], abs=0.05)
    for channel in z.T:
        for lag in (1, 2, 5, 20):
            assert abs(np.corrcoef(channel[lag:], channel[:-lag])[0, 1]) < 0.08


@pytest.mark.parametrize("torque", [QUIET, NoiseModel()])
def test_gradient_against_finite_differences(torque: NoiseModel) -> None:
    truth = Rig()
    recording = record(truth, 7, 8.0)
    samples = prepare(recording, truth)
    # A quiet filter's gains do not move, so that its gradient is exact; a busy one's is the
    # expectation, exact where the innovations vanish: there both are 0.
    rig = truth.replace(km=truth.km * 1.0001, T1=truth.T1 * 1.0002)
    found = score(samples, rig, torque, samples.starts).gradient
    if torque is not QUIET:
        assert np.abs(found).max() > 0.0
        return
    fixed = replace(samples, spreads=np.zeros_like(samples.spreads))
    found = score(fixed, rig, torque, samples.starts).gradient
    for name in SYMBOLS:
        value = getattr(rig, name)
        step = 1e-6 * abs(value)
        above = score(fixed, rig.replace(**{name: value + step}), torque, samples.starts).value
        below = score(fixed, rig.replace(**{name: value - step}), torque, samples.starts).value
        slope = -(above - below) / (4.0 * step)
        assert found[SYMBOLS.index(name)] == pytest.approx(slope, rel=2e-3, abs=1e-2 / abs(value))


def test_multiple_shooting_finds_the_same_rig_without_torque_noise() -> None:
    truth = Rig(Tsl=0.011)
    options = FitOptions(method="multiple_shooting", window=5.0)
    estimate = identify([record(truth, 9)], off(truth, 3), fixed={"Ju": truth.Ju}, options=options)
    assert len(estimate.problem.samples[0].restarts) == 8
    for name in ("km", "bu", "ktheta", "Jl"):
        assert abs(getattr(estimate.rig, name) / getattr(truth, name) - 1.0) < 5e-3


def test_a_few_wild_samples_do_not_pull_the_fit() -> None:
    truth, _ = fitted()
    recording = record(truth, 1, **TORQUES)
    theta = recording.channel("theta_l").copy()
    wild = np.random.default_rng(0).choice(len(theta), 40, replace=False)
    theta[wild] += 0.05
    spoilt = replace(recording, theta_l=theta)
    start = truth.replace(km=1.1 * truth.km, Jl=0.9 * truth.Jl)
    robust = identify([spoilt], start, fixed={"Ju": truth.Ju})
    plain = identify([spoilt], start, fixed={"Ju": truth.Ju}, options=FitOptions(robust=math.inf))
    errors = [curve_error(e.rig, truth, 8.0) for e in (robust, plain)]
    assert errors[0] < 0.5 * errors[1]
    assert errors[0] < 0.03


def test_feedback_does_not_bias_the_fit() -> None:
    """Speed control makes the voltage depend on the torque noise, which biases free runs."""
    truth = Rig()
    wish = np.repeat(np.random.default_rng(2).uniform(1.0, 6.0, 16), 500)
    last = [0.0]

    def speed_control(k: int, theta_u: float, theta_l: float) -> float:
        speed, last[0] = (theta_u - last[0]) * 200.0, theta_u
        return float(np.clip(0.7 * wish[k] + 0.4 * (wish[k] - speed), -5.0, 5.0))

    values = {name: getattr(truth, name) for name in SYMBOLS}
    made = make_closed_loop(values, speed_control, len(wish), seed=3, torque_u=0.1, torque_l=2e-4)
    quanta = {"theta_u": STEP, "theta_l": STEP}
    recording = Recording(made.t, made.u, made.theta_u, made.theta_l, quanta=quanta)
    upper = tuple(name for name in UPPER if name != "Ju")
    fits = [
        identify([recording], truth, free=upper, fixed={"Ju": truth.Ju}, options=options)
        for options in (FitOptions(), FitOptions(method="multiple_shooting"))
    ]
    assert np.abs(deviations(fits[0], truth)).max() < 4.0
    assert np.abs(deviations(fits[1], truth)).max() > 8.0


def test_gaps_restart_the_filter() -> None:
    truth, estimate = fitted()
    recording = record(truth, 1, **TORQUES)
    keep = np.ones(len(recording), dtype=bool)
    keep[3000:3400] = False
    cut = {name: values[keep] for name, values in recording.channels().items()}
    gappy = replace(recording, **cut)
    samples = prepare(gappy, truth)
    assert samples.restarts.tolist() == [0, 3000]
    found = identify([gappy], estimate.rig, fixed={"Ju": truth.Ju})
    assert np.abs(deviations(found, truth)).max() < 4.0


def test_intervals_agree_with_the_profile_where_the_likelihood_is_quadratic() -> None:
    _, estimate = fitted()
    low, high = estimate.intervals()["ktheta"]
    curve = profile(estimate, "ktheta")
    assert (curve.low, curve.high) == pytest.approx((low, high), rel=0.3 * (high / low - 1.0))
    assert (curve.rise[[0, -1]] > 3.84).all()


def test_a_prior_and_bounds_are_kept() -> None:
    truth, estimate = fitted()
    sharp = Prior.independent({"bl": (0.0042, 1e-7)})
    runs = [s.recording for s in estimate.problem.samples]
    held = identify(runs, estimate.rig, fixed={"Ju": truth.Ju}, prior=sharp)
    assert held.rig.bl == pytest.approx(0.0042, abs=4e-7)
    assert held.covariance[held.free.index("bl")].max() < estimate.covariance.max()
    edge = 0.999 * estimate.rig.ktheta
    bounded = identify(
        runs, truth, fixed={"Ju": truth.Ju}, bounds={"ktheta": (0.05, edge)},
    )  # fmt: skip
    assert bounded.rig.ktheta <= edge * (1.0 + 1e-9)


def test_two_stages_give_the_joint_fit_of_both() -> None:
    truth, estimate = fitted()
    alone = truth.replace(ktheta=1e-9, Tsl=1e3)
    first = record(alone, 21, **TORQUES)
    first = replace(first, theta_l=None)
    runs = [s.recording for s in estimate.problem.samples]
    one, two = identify_stages([first], runs, off(truth, 4), fixed={"Ju": truth.Ju})
    assert set(one.free) == set(UPPER) - {"Ju"}
    assert np.abs(deviations(one, truth)).max() < 4.0
    assert np.abs(deviations(two, truth)).max() < 4.0
    joint = np.sqrt(np.diag(two.covariance))[two.free.index("km")]
    apart = [np.sqrt(np.diag(e.covariance))[e.free.index("km")] for e in (one, estimate)]
    assert joint < min(apart)


def test_coordinates_are_one_to_one() -> None:
    rig = off(Rig(), 5)
    coordinates = Coordinates(Rig(Ju=rig.Ju), FREE)
    back = coordinates.rig(coordinates.vector(rig))
    assert [getattr(back, n) for n in SYMBOLS] == pytest.approx(
        [getattr(rig, n) for n in SYMBOLS], rel=1e-12
    )


def test_repeated_counts() -> None:
    counted = repeated_counts(np.array([0.0, 0.0, 1.0, 2.0, 2.0, 2.0]))
    assert counted.tolist() == [2, 2, 1, 3, 3, 3]


def test_the_scale_of_torque_must_be_given_and_is_then_free_of_the_data() -> None:
    truth, estimate = fitted()
    runs = [s.recording for s in estimate.problem.samples]
    with pytest.raises(InputError, match="scale of torque"):
        identify(runs, truth)
    # All torques times 2 describe the same motion: the likelihood does not change.
    samples, noise = estimate.problem.samples, estimate.noise[0]
    doubled = truth.replace(
        **{n: 2.0 * getattr(truth, n) for n in SYMBOLS if n not in ("beta1", "beta2")}
    )
    louder = replace(noise, torque_u=2.0 * noise.torque_u, torque_l=2.0 * noise.torque_l)
    problem = Problem(samples, (0, 0), Coordinates(truth, ("km",)))
    there = replace(problem, coordinates=Coordinates(doubled, ("km",)))
    values = [
        point_at(p, p.coordinates.vector(p.coordinates.base), [n]).value
        for p, n in ((problem, noise), (there, louder))
    ]
    assert values[0] == pytest.approx(values[1], abs=0.05)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"free": ("kappa",)}, "not one of"),
        ({"fixed": {"Ju": 0.4}, "bounds": {"Ju": (0.1, 1.0)}}, "not among the free"),
        ({"fixed": {"Ju": 0.4}, "bounds": {"km": (2.0, 1.0)}}, "lower one first"),
        ({"fixed": dict.fromkeys(SYMBOLS, 0.1)}, "no parameter is free"),
    ],
)
def test_wrong_arguments_are_named(arguments: dict[str, Any], text: str) -> None:
    runs = [s.recording for s in fitted()[1].problem.samples]
    with pytest.raises(InputError, match=text):
        identify(runs, Rig(), **arguments)


def test_a_law_without_the_parameter_says_so() -> None:
    runs = [s.recording for s in fitted()[1].problem.samples]
    with pytest.raises(InputError, match="no part of this rig"):
        identify(runs, Rig(friction="coulomb"), free=("T2",), fixed={"Ju": 0.5})
