"""A rig of any size is fitted alike: units of torque and voltage are conventions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.grids import grid_of
from drill_env.diagnosis.linearised import linearised_at
from drill_env.effects import LIBRARY
from drill_env.identification.noise import usual_noise
from drill_env.identification.samples import prepare
from tests.made_recordings import FREE, made

TORQUES = ("km", "Ju", "Tsu", "dTsu", "bu", "dbu", "Jl", "ktheta", "Tsl", "T1", "T2", "bl")


def times(rig: Rig, factor: float) -> Rig:
    """The same motion in another unit of torque."""
    return rig.replace(**{name: factor * getattr(rig, name) for name in TORQUES})


@pytest.mark.parametrize("factor", [1e-3, 5e3])
def test_the_rig_alone_is_as_likely_in_any_unit_of_torque(factor):
    given = Rig().replace(Jl=1.04 * Rig().Jl, ktheta=0.97 * Rig().ktheta)
    recording = made(Rig(), (), (5,))
    fits = [
        base_fit([prepare(recording, rig)], rig, FREE)[1] for rig in (given, times(given, factor))
    ]
    one, other = fits
    assert other.value == pytest.approx(one.value, abs=0.5)
    assert other.rig.Jl == pytest.approx(factor * one.rig.Jl, rel=1e-4)
    for name in ("torque_u", "torque_l"):
        ratio = getattr(other.noise, name) / getattr(one.noise, name)
        assert ratio == pytest.approx(factor, rel=0.02)


def test_usual_noise_accelerates_discs_alike():
    rig = times(Rig(), 700.0)
    paper, other = usual_noise(Rig()), usual_noise(rig)
    assert other.torque_u / rig.Ju == pytest.approx(paper.torque_u / Rig().Ju)
    assert other.torque_l / rig.Jl == pytest.approx(paper.torque_l / Rig().Jl)


@pytest.mark.parametrize("name", ["amplifier_saturation", "slew_limit", "soft_saturation"])
@pytest.mark.parametrize("factor", [0.05, 200.0])
def test_voltages_are_searched_where_the_recordings_are(name, factor):
    recording = made(Rig(), (), (5,))
    points = []
    # Far from the voltages that the grids were declared for, which stay as they are.
    for scale in (50.0, factor * 50.0):
        rig = Rig().replace(km=Rig().km / scale)
        one = prepare(replace(recording, u=scale * recording.u), rig)
        points.append(np.array(grid_of(LIBRARY[name], linearised_at(*base_fit([one], rig, FREE)))))
    own = [p.unit.startswith("V") for p in LIBRARY[name].parameters]
    assert points[1][:, own] == pytest.approx(factor * points[0][:, own])
    assert points[1][:, ~np.array(own)] == pytest.approx(points[0][:, ~np.array(own)])
