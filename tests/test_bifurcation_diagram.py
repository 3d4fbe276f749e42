"""The whole diagram: the issue's points, maps, properties over random rigs."""

from __future__ import annotations

import functools
import math
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from test_integrator_robust import rigs

from drill_env import Engine, InputError, Rig
from drill_env._types import FrictionLaw
from drill_env.continuation import (
    Diagram,
    StepRule,
    bifurcation_diagram,
    hopf_map,
    parameter_diagram,
    vibration_map,
)
from drill_env.continuation.tables import diagram_table, point_documents

RIG = Rig()
COARSE = StepRule(first=0.02, largest=0.3, turn=0.5)
POINTS = [
    ("A", "break-away", 0.0952848, 5e-8),
    ("B", "hopf", 0.565729, 5e-7),
    ("", "grazing", 1.8136730, 1e-6),
    ("", "reversal", 1.8807277, 1e-6),
    ("", "last stick", 2.1081950, 1e-6),
    ("D", "hopf", 13.183694, 5e-7),
    ("", "last stick", 13.4792959, 1e-6),
    ("", "reversal", 13.5097, 5e-5),
    ("", "grazing", 13.5196807, 1e-6),
    ("C", "fold", 14.1692825, 1e-6),
]


@functools.cache
def paper() -> Diagram:
    return bifurcation_diagram(RIG, 20.0)


def test_every_special_point_of_the_paper_and_no_other():
    found = [(p.name, p.kind) for p in paper().points]
    assert found == [(name, kind) for name, kind, _, _ in POINTS]
    for point, (_, _, volts, bound) in zip(paper().points, POINTS, strict=True):
        assert point.parameter == pytest.approx(volts, abs=bound)
        assert 0.0 <= point.error < 1e-8
    fold = paper().points[-1]
    assert (fold.min, fold.max) == pytest.approx((0.73895, 50.35439), abs=5e-6)
    assert fold.period == pytest.approx(4.0483632, abs=5e-8)
    # At the fold a second multiplier is 1.
    assert abs(fold.multipliers[0] - 1.0) < 1e-4


def test_one_branch_from_b_over_c_to_d_without_retracing():
    (branch,) = paper().branches
    assert paper().failures == ()
    assert "0.565729" in branch.start and branch.end == "shrank into the Hopf point at 13.1837 V"
    assert len(branch.points) >= 150
    volts = np.array([p.cycle.parameter for p in branch.points])
    stable = np.array([p.cycle.stable for p in branch.points])
    turn = int(volts.argmax())
    assert (np.diff(volts[: turn + 1]) > 0).all() and (np.diff(volts[turn:]) < 0).all()
    assert stable[:turn].all() and not stable[turn + 1 :].any()
    assert max(p.cycle.steps for p in branch.points) <= 5
    assert max(abs(p.cycle.trivial - 1.0) for p in branch.points) < 1e-5


def test_points_do_not_depend_on_the_steps_beyond_their_error():
    other = bifurcation_diagram(RIG, 15.0, StepRule(largest=0.05, turn=0.15))
    for a, b in zip(paper().points, other.points, strict=True):
        assert abs(a.parameter - b.parameter) <= a.error + b.error


def test_tables_name_the_papers_branches():
    table = diagram_table(paper())
    assert table.branch.drop_duplicates().tolist() == ["e1", "e2", "e3", "e4", "p1", "p2"]
    stable = table.groupby("branch").stable.first()
    assert stable.to_dict() == {
        "e1": True, "e2": True, "e3": False, "e4": True, "p1": True, "p2": False,
    }  # fmt: skip
    documents = point_documents(paper().points)
    assert all(math.isfinite(d["parameter"]) and d["how"] for d in documents)


def test_the_diagram_over_a_parameter_meets_the_one_over_the_voltage():
    """Both pass through 3.5 V with the printed stiffness, and both lose contact with 0."""
    found = parameter_diagram(RIG, "ktheta", 3.5, 0.06, 0.10)
    assert found.failures == ()
    (near, *_) = sorted(
        (p for b in found.branches for p in b.points), key=lambda p: abs(p.z[4] - RIG.ktheta)
    )
    rig = RIG.replace(ktheta=float(near.z[4]))
    same = bifurcation_diagram(rig, 4.0)
    points = [p.cycle for b in same.branches for p in b.points]
    by_volts = sorted((c.parameter, c.max, c.period) for c in points)
    volts, high, period = np.array(by_volts).T
    assert near.cycle.max == pytest.approx(np.interp(3.5, volts, high), abs=2e-3)
    assert near.cycle.period == pytest.approx(np.interp(3.5, volts, period), abs=2e-4)
    assert found.equilibria.stable.eq(False).all()


def test_maps_repeat_the_diagrams_points():
    table = vibration_map(RIG, "T2", np.array([-0.291, -0.2]), 15.0, engine=Engine(jobs=2))
    row = table.iloc[0]
    assert (row.hopf_low, row.hopf_high) == pytest.approx((0.565729270, 13.183693585), abs=1e-8)
    assert row.fold == pytest.approx(14.1692825, abs=1e-6)
    assert (row.vibration_from, row.vibration_to) == pytest.approx((0.565729, 14.169283), abs=1e-5)
    assert (table.failures == "").all()
    curve = hopf_map(RIG, "T2", np.array([-0.291, -0.2, 0.0]), 15.0)
    assert curve.voltage.iloc[:2].tolist() == [row.hopf_low, row.hopf_high]
    assert not (curve.value == 0.0).any()


@st.composite
def kin(draw: st.DrawFn) -> Rig:
    """A rig like the paper's, of any law; most of these vibrate."""
    law = draw(st.sampled_from(get_args(FrictionLaw)))
    factor = st.floats(-0.3, 0.3).map(lambda x: float(10.0**x))
    names = ("Ju", "Jl", "ktheta", "Tsl", "bu", "beta1", "beta2", "bl", "T2")
    changes: dict[str, Any] = {name: getattr(RIG, name) * draw(factor) for name in names}
    if law == "stribeck":
        changes |= {"Tsl": 0.2 * draw(factor), "beta1": draw(factor)}
        changes["T1"] = -changes["Tsl"] * draw(st.floats(0.2, 0.95))
    return RIG.replace(friction=law, clamp=draw(st.booleans()), **changes)


@given(st.one_of(kin(), kin(), rigs(stiff=False)), st.floats(1.2, 40.0))
@settings(
    max_examples=30, deadline=None, derandomize=True, database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)  # fmt: skip
def test_any_rig_converges_or_says_what_failed(rig, factor):
    try:
        # A coarse rule: what is tested here is that nothing is left unsaid.
        diagram = bifurcation_diagram(rig, factor * max(rig.breakaway_voltage, 0.05), COARSE)
    except InputError as error:
        assert str(error)
        return
    for branch in diagram.branches:
        assert branch.start and branch.end
        for point in branch.points:
            assert point.cycle.residual < 1e-6 * (1.0 + point.cycle.max)
    assert all(text.startswith(("cycles from", "special points")) for text in diagram.failures)
    for document in point_documents(diagram.points):
        assert math.isfinite(document["parameter"])
    assert len(diagram_table(diagram)) > 0


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(InputError, match="break-away"):
        bifurcation_diagram(RIG, 0.05)
    with pytest.raises(InputError, match="two inertias"):
        bifurcation_diagram(Rig.one_inertia(km=1.0, Ju=1.0, Tsu=0.1, bu=0.1), 5.0)
    with pytest.raises(InputError, match="id is 'x'"):
        bifurcation_diagram(RIG.replace(effects=({"id": "x"},)), 5.0)
    with pytest.raises(InputError, match="parameter is"):
        parameter_diagram(RIG, "mass", 3.5, 0.1, 0.2)
    with pytest.raises(InputError, match="smaller value first"):
        parameter_diagram(RIG, "ktheta", 3.5, 0.2, 0.1)
