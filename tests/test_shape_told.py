"""A free shape over an angle is reported where the disc was."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.answer_by_prediction import _shape
from drill_env.effects.along import Motion
from drill_env.prediction.candidate import scales_of
from drill_env.prediction.shapes import free_shapes


def test_a_way_of_less_than_a_turn_is_told_with_its_own_angles():
    """The table that is simulated keeps them within a period, from 0 on."""
    t = np.arange(2000) / 100.0
    angle = 0.1 + 0.6 * np.sin(t)
    states = np.column_stack([angle, 0.6 * np.cos(t), *np.zeros((4, len(t)))])
    motion = Motion(t, np.sin(t), states, np.array([0]))
    axis = Rig.one_inertia(km=1.0, Ju=0.1, Tsu=0.0, bu=0.1)
    scales = [scales_of(axis, [motion], 0)]
    shape = next(
        s for s in free_shapes(axis, [motion], scales, amplifier=True)
        if s.id == "upper_torque_of_theta_u"
    )  # fmt: skip
    numbers = np.arange(shape.size, dtype=float)
    whole = SimpleNamespace(
        numbers=(numbers,),
        setting=SimpleNamespace(cuts=[SimpleNamespace(windows=SimpleNamespace(motion=motion))]),
    )
    told = _shape(SimpleNamespace(candidate=shape), whole)
    assert told.knots == sorted(told.knots)
    assert (told.knots[0], told.knots[-1]) == pytest.approx((-0.5, 0.7), abs=0.01)
    # The values go with their angles.
    there = np.mod(told.knots, shape.table["period"])
    kept = dict(
        zip(np.round(shape.table["knots"], 9).tolist(), numbers * shape.usual[0][0], strict=True)
    )
    assert told.values == pytest.approx([kept[round(float(x), 9)] for x in there])
