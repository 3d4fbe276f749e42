"""A reading that is off by less than a sampling interval is its clock's."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drill_env.diagnosis.rounds import Attempt
from drill_env.diagnosis.row_times import of_row_times
from drill_env.diagnosis.shapes import free_shapes
from drill_env.diagnosis.terms import Term
from drill_env.parameters import Rig

RIG = Rig.paper()
SAMPLES: Any = [SimpleNamespace(recording=SimpleNamespace(interval=0.005))]


def shapes() -> dict[str, Any]:
    t = np.linspace(0.0, 20.0, 2001)
    states = np.zeros((len(t), 6))
    states[:, 1], states[:, 2] = 3.0 * np.sin(t), 4.0 * np.sin(0.7 * t)
    motion: Any = SimpleNamespace(t=t, u=2.0 * np.cos(1.3 * t), states=states)
    return {s.id: s for s in free_shapes([motion])}


SHAPES = shapes()
DRIVEN = RIG.km / RIG.Ju


def attempt(shape: Any, error: Any, gain: float) -> Attempt:
    fit: Any = SimpleNamespace(rig=RIG)
    return Attempt(fit, Term(shape, error(np.array(shape.knots))), gain, gain)


@pytest.mark.parametrize(
    ("name", "error", "told"),
    [
        ("error_u_of_omega_u", lambda w: 1e-4 * w, True),
        ("error_l_of_omega_l", lambda w: -4e-3 * w, True),
        # A late encoder is late by more than one row.
        ("error_u_of_omega_u", lambda w: 0.02 * w, False),
        # A reading that follows the speed's size is none of a time.
        ("error_l_of_omega_l", lambda w: 1e-4 * np.abs(w), False),
        ("error_u_of_voltage", lambda u: 0.2 * 0.005**2 * DRIVEN * u, True),
        # A cable that picks the voltage up may show more.
        ("error_u_of_voltage", lambda u: 2.0 * 0.005**2 * DRIVEN * u, False),
        ("error_u_of_theta_u", lambda x: 1e-4 * np.sin(x), False),
        ("upper_torque_of_voltage", lambda u: 1e-4 * u, False),
    ],
)
def test_what_a_shift_within_an_interval_makes_of_a_reading(name: str, error: Any, told: bool):
    shape = SHAPES[name]
    assert of_row_times(attempt(shape, error, 1000.0), SAMPLES) is told


@pytest.mark.parametrize(("gain", "told"), [(60.0, True), (600.0, False)])
def test_what_is_left_beside_the_line_may_be_asked_for(gain: float, told: bool):
    """Of an encoder's play, a step where it turns, a line through it explains most."""
    shape = SHAPES["error_l_of_omega_l"]
    assert of_row_times(attempt(shape, lambda w: 0.005 * np.sign(w), gain), SAMPLES) is told
