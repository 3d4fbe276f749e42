"""Predictions follow the rig's parameters through terms that are made of them too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env._types import FloatArray
from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.extended import evaluate, motion_of, whitened
from drill_env.diagnosis.fit import Setting
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.rig_coordinates import RigCoordinates
from drill_env.diagnosis.shapes import free_shapes
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion
from drill_env.identification.coordinates import Coordinates
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import Path, path_of
from drill_env.identification.samples import Samples, prepare
from tests.made_recordings import FREE, made

RIG = Rig()
SAMPLES = prepare(made(RIG, (), (5,)), RIG)
NOISE = NoiseModel()
PLACES = RigCoordinates(Coordinates(RIG, tuple(FREE)))


def read(rig: Rig, term: Term, motion: Motion, *, slopes: bool = False) -> tuple[Samples, Path]:
    given = with_terms(SAMPLES, (term,), rig, motion)
    return given, path_of(given, rig, NOISE, SAMPLES.starts, slopes=slopes)


def by_differences(place: int, term: Term, motion: Motion) -> FloatArray:
    """How the innovations follow a coordinate of the rig, from two more passes."""
    here, step = PLACES.vector(RIG), np.zeros(len(FREE))
    step[place] = 1e-4 * max(abs(here[place]), 1e-2)
    there, back = (
        read(PLACES.rig(here + sign * step), term, motion)[1].rows["white"] for sign in (1, -1)
    )
    return (back - there) / (2.0 * step[place])


def a_term(name: str, q: list[float], motion: Motion) -> Term:
    if name in LIBRARY:
        return Term(Named(LIBRARY[name]), np.array(q))
    shape = next(s for s in free_shapes([motion]) if s.id == name)
    return Term(shape, q[0] * np.cos(np.arange(shape.size)))


@pytest.mark.parametrize(
    ("name", "q", "parameter"),
    [
        ("supply_sag", [0.1], "km"),
        ("gear_eccentricity", [0.6, 1.0], "km"),
        ("upper_drive_of_theta_u", [0.6], "km"),
        ("friction_warmup", [1.0, 10.0], "Tsu"),
        ("friction_warmup", [1.0, 10.0], "bu"),
        ("brake_runout", [0.5, 0.3, 1.0], "T1"),
        ("lower_friction_of_theta_l", [0.5], "T1"),
        ("friction_step", [0.5, 10.0], "Tsl"),
    ],
)
def test_slopes_agree_with_differences(name: str, q: list[float], parameter: str):
    path = path_of(SAMPLES, RIG, NOISE, SAMPLES.starts)
    motion = motion_of(SAMPLES, NOISE, path)
    term, place = a_term(name, q, motion), FREE.index(parameter)
    given, path = read(RIG, term, motion, slopes=True)
    setting = Setting((SAMPLES,), PLACES, 0.05)
    jacobian = PLACES.jacobian(PLACES.vector(RIG))
    told = whitened(
        given, setting, RIG, jacobian, (term,), NOISE, SAMPLES.starts, path, motion
    )[:, :, place]  # fmt: skip
    true = by_differences(place, term, motion)
    disc = int(np.argmax(np.abs(true).sum(axis=0)))
    # Where a disc stops or starts elsewhere, differences are those of events.
    gap = np.abs(told - true)[:, disc]
    assert np.median(gap) < 0.03 * np.median(np.abs(true)[:, disc])


def test_a_lag_is_found_from_a_rig_that_was_bent_to_do_without_it():
    """Gain, friction and lag follow each other along a narrow valley."""
    lag = Hidden("actuator_lag", {"tau": 0.15})
    samples = tuple(prepare(made(RIG, (lag,), (seed,)), RIG) for seed in (1, 2))
    setting = Setting(samples, PLACES, 0.05)
    bent = PLACES.vector(RIG.replace(km=0.7 * RIG.km, bu=0.7 * RIG.bu))
    starts = [s.starts for s in samples]
    term = Term(Named(LIBRARY["actuator_lag"]), np.array([0.1]))
    noise = replace(NOISE, torque_u=0.3, tau_u=1.0)
    motions = [motion_of(s, noise, path_of(s, RIG, noise, s.starts)) for s in samples]
    here = evaluate(setting, bent, (term,), noise, starts, motions)
    there = descend_jointly(setting, here, limit=25, enough=0.5, only=None)
    assert there.terms[0].q[0] == pytest.approx(0.15, rel=0.02)
    assert there.rig.km == pytest.approx(RIG.km, rel=0.02)
