"""Parameters that a rig lacks are found as effects; EMPS with one term left out in turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.emps_left_out import CASES, FILES, diagnosed, read_emps
from drill_env import Rig
from drill_env.diagnosis.declare import extended_rig
from drill_env.diagnosis.force_error import force_error
from drill_env.diagnosis.offered import free_parameters, offered_effects, repeats
from drill_env.diagnosis.shapes import free_shapes
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion
from drill_env.identification.samples import prepare
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording
from tests.test_one_inertia import AXIS, EMPS, both_ways

# At 500 Hz, and with the drive, clock and sensor left out, the searches take half of the time.
EVERY = 2
# By the round of the search that names it: the asymmetry's torque is small beside what follows
# each reversal.
NAMED = {"Coulomb term": 1, "viscous term": 1, "asymmetry": 3}

needs_emps = pytest.mark.skipif(
    not all((EMPS / name).is_file() for name in FILES),
    reason="no EMPS recordings beside the checkout",
)

WITHOUT = {
    "upper_coulomb": ({"Tsu": 0.0, "dTsu": 0.0}, {"torque": AXIS.Tsu}),
    "upper_viscous": ({"bu": 0.0, "dbu": 0.0}, {"damping": AXIS.bu}),
    "upper_offset": ({"dTsu": 0.0}, {"torque": AXIS.dTsu}),
    "upper_asymmetry": ({"dbu": 0.0}, {"damping": AXIS.dbu}),
}


@pytest.mark.parametrize("name", WITHOUT)
def test_a_parameter_as_an_effect_equals_the_rig_that_has_it(name):
    """Through reversals and a rest; the truth is the exact integrator."""
    zero, values = WITHOUT[name]
    without = AXIS.replace(**zero)
    rig = AXIS.replace(**(zero | {LIBRARY[name].stands_for: next(iter(values.values()))}))
    t = np.arange(6001) * 1e-3
    drive = sampled_voltage(t, np.where(t < 4.0, both_ways(t), 0.02))
    truth = simulate(rig, drive, t[-1], t_eval=t)
    ours = simulate(without.replace(effects=({"id": name, **values},)), drive, t[-1], t_eval=t)
    assert np.abs(truth.omega_u[-500:]).max() < 0.2
    np.testing.assert_allclose(ours.state, truth.state, atol=2e-3)
    term = Term(Named(LIBRARY[name]), np.array(list(values.values())))
    assert extended_rig(without, [term]) == rig


def test_an_asymmetry_of_nothing_stays_an_effect():
    rig = AXIS.replace(Tsu=0.0, dTsu=0.0)
    term = Term(Named(LIBRARY["upper_offset"]), np.array([0.1]))
    assert [e["id"] for e in extended_rig(rig, [term]).effects] == ["upper_offset"]


def test_the_paper_rig_is_offered_what_it_was():
    """Its own parameters are free, so none of them is offered as an effect."""
    rig = Rig.paper()
    free = free_parameters(rig)
    assert set(free) == {"km", "Tsu", "dTsu", "bu", "dbu", "Jl", "ktheta", "Tsl", "T1", "T2",
                         "beta1", "beta2", "bl"}  # fmt: skip
    ids = {e.id for e in offered_effects(rig, free, ())}
    assert ids == {n for n, e in LIBRARY.items() if not e.stands_for and not e.axis_only}


@pytest.mark.parametrize("way", [0.3, 40.0])
def test_only_what_turns_is_offered_what_repeats_with_a_turn(way):
    t = np.arange(4001) * 1e-3
    theta = 0.5 * way * (1.0 - np.cos(3.0 * t))
    samples = [prepare(Recording(t=t, u=np.sin(t), theta_u=theta), AXIS)]
    effects = offered_effects(AXIS, free_parameters(AXIS), samples)
    assert any(repeats(e) for e in effects) == (way > 2.0 * np.pi)
    states = np.zeros((len(t), 6))
    states[:, 0], states[:, 1] = theta, np.gradient(theta, t)
    motion = Motion(t, np.sin(t), states, np.array([0]))
    shape = next(s for s in free_shapes([motion], 1) if s.id == "upper_torque_of_theta_u")
    assert shape.knots[-1] == pytest.approx(2.0 * np.pi * 15 / 16 if way > 7.0 else way, rel=1e-6)


@pytest.fixture(scope="module")
def emps():
    return [coarser(recording) for recording in read_emps(EMPS)]


def coarser(recording):
    """Every other position, with the mean of the two voltages that were held between."""
    rows = len(recording) // EVERY * EVERY
    u = recording.u[:rows].reshape(-1, EVERY).mean(axis=1)
    picked = recording.part(0, rows)
    return replace(picked, t=picked.t[::EVERY], u=u, theta_u=picked.theta_u[::EVERY], extra={})


def searched(emps, name, most):
    """The case with fewer rivals than the benchmark has: those of other places."""
    case = CASES[name]
    places = [n for n, e in LIBRARY.items() if e.component in ("actuator", "sensor")]
    drive = ("gear_backlash", "gear_compliance", "friction_warmup")
    return diagnosed(*emps, replace(case, leave_out=(*case.leave_out, *places, *drive)), most)


@needs_emps
@pytest.mark.parametrize("name", NAMED)
def test_a_term_left_out_of_the_axis_is_named(name, emps):
    held, told = emps[1], searched(emps, name, NAMED[name])
    result, search = told.result, told.found
    assert result.verdict == "missing_physics"
    assert result.effects[0].id == CASES[name].effect
    assert result.located.angle_order is None
    # It becomes the rig's own parameter, and the force of the held-out pulses is explained.
    assert getattr(told.rig, LIBRARY[CASES[name].effect].stands_for) != 0.0
    before = force_error(held, search.base, told.before[0].motion)
    after = force_error(held, search.final, told.after[0].motion)
    assert after < 0.7 * before


@needs_emps
def test_a_missing_offset_is_told_with_its_other_name(emps):
    """Most of the published offset is an asymmetry of the viscous term: both are told."""
    told = searched(emps, "offset", 3)
    result = told.result
    assert result.effects[0].id in ("upper_asymmetry", "upper_offset")
    seen = {e.id for e in result.effects} | {a.id for a in result.alternatives}
    assert {"upper_asymmetry", "upper_offset"} <= seen


@needs_emps
def test_the_whole_axis_shows_no_angle_and_no_known_term(emps):
    """With every term in, what is left is where the axis turns round."""
    told = searched(emps, "nothing", 2)
    result = told.result
    assert result.verdict in ("missing_physics", "unexplained")
    assert not any(LIBRARY[e.id].stands_for or repeats(LIBRARY[e.id]) for e in result.effects)
    assert result.located.component == "upper"
    assert result.located.angle_order is None
    chances = [e.probability for e in result.effects] + [a.probability for a in result.alternatives]
    assert all(0.0 <= chance <= 1.0 for chance in chances)
