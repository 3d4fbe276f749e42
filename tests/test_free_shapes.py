"""A free shape is nothing that the rig's own parameters can do."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env.diagnosis.attempts import attempted
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.fit_changes import added
from drill_env.diagnosis.joint import descend_jointly, polished
from drill_env.diagnosis.shapes import free_shapes
from drill_env.diagnosis.terms import Named, Shape, Term
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion
from drill_env.identification.samples import prepare
from tests.made_recordings import FREE, made


@pytest.fixture(scope="module")
def motion() -> Motion:
    rng, n = np.random.default_rng(1), 4000
    states = rng.uniform(-1.0, 1.0, (n, 4)) * [6.0, 8.0, 14.0, 30.0]
    # Both ends of a step are alike, so that its middle is where it is.
    states = np.repeat(states, 2, axis=0)
    t = np.arange(2 * n) / 200.0
    u = np.repeat(rng.uniform(-5.0, 5.0, n), 2)
    return Motion(t, u, np.hstack([states, np.zeros((2 * n, 2))]), np.array([0]))


def torques(rig: Rig, motion: Motion) -> np.ndarray:
    """Torques on both discs by equations (1) to (7) of the paper, Nm, shape (n, 2)."""
    twist, w_u, w_l, _ = motion.states[:, :4].T
    side = np.sign(w_u)
    upper = rig.km * motion.u - rig.ktheta * twist
    upper -= side * rig.Tsu + rig.dTsu + rig.bu * w_u + rig.dbu * np.abs(w_u)
    hump = [
        height * (1.0 - 2.0 / (1.0 + np.exp(steep * np.abs(w_l))))
        for height, steep in ((rig.T1, rig.beta1), (rig.T2, rig.beta2))
    ]
    lower = rig.ktheta * twist
    lower -= np.sign(w_l) * (rig.Tsl + hump[0] + hump[1] + rig.bl * np.abs(w_l))
    return np.column_stack([upper, lower])


OWN = [
    ("upper_torque_of_time", "dTsu", 0), ("upper_torque_of_voltage", "km", 0),
    ("upper_torque_of_omega_u", "bu", 0), ("upper_torque_of_omega_u", "dbu", 0),
    ("upper_torque_of_twist", "ktheta", 0), ("upper_drive_of_theta_u", "km", 0),
    ("drive_of_time", "km", 0), ("upper_friction_of_time", "Tsu", 0),
    ("upper_damping_of_theta_u", "bu", 0), ("string_torque_of_twist", "ktheta", 1),
    ("string_stiffness_of_omega_u", "ktheta", 1),
]  # fmt: skip


@pytest.mark.parametrize(("name", "parameter", "disc"), OWN)
def test_no_shape_is_what_a_free_parameter_does(motion, name, parameter, disc):
    rig = Rig.paper()
    step = 1e-4 * max(abs(getattr(rig, parameter)), 1.0)
    there = rig.replace(**{parameter: getattr(rig, parameter) + step})
    moved = (torques(there, motion) - torques(rig, motion))[:, disc] / step

    def told(free) -> float:
        """Share of the parameter's torque that the shape can be, but for the last row's middle."""
        shape = next(s for s in free_shapes([motion], free) if s.id == name)
        columns = shape.slopes(rig, motion)[0][::2, disc]
        left = moved[::2] - columns @ np.linalg.lstsq(columns, moved[::2], rcond=1e-8)[0]
        return 1.0 - float(left @ left) / float(moved[::2] @ moved[::2])

    assert told(()) > 0.98
    # The speed or voltage that multiplies a function weighs the rows a little differently.
    assert told((parameter,)) < 0.01


def test_numbers_of_a_shape_have_no_share_in_what_the_rig_does(motion):
    shape = next(s for s in free_shapes([motion], FREE) if s.id == "upper_damping_of_time")
    q = np.arange(shape.size, dtype=float)
    left = shape.bounded(q)
    assert np.ptp(q - left) < 1e-9
    constant = shape.response(np.ones(shape.size), Rig(), motion)[0]
    assert np.abs(constant).max() < 1e-12


def test_a_shape_does_not_outdo_the_truth_by_cancelling_the_rig():
    """Along the smoothed motion a damping that bu takes back predicted better than any name."""
    hidden = Hidden("friction_warmup", {"excess": 0.004, "tau": 10.0})
    recordings = [prepare(made(Rig(), (hidden,), (n,), seconds=60.0), Rig()) for n in (1, 2)]
    setting, base = base_fit(recordings, Rig(), FREE)

    def criterion(source: Named | Shape, q: np.ndarray) -> float:
        start = added(setting, base, Term(source, q))
        there = descend_jointly(setting, start, limit=15, enough=2.0, only=None)
        return attempted(base, polished(setting, there)).criterion

    shapes = free_shapes(base.motions, setting.coordinates.free)
    shape = next(s for s in shapes if s.id == "upper_damping_of_time")
    name = criterion(Named(LIBRARY["friction_warmup"]), np.array([0.004, 10.0]))
    assert name > 25.0
    assert criterion(shape, np.zeros(shape.size)) < name
