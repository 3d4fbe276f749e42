"""Maps, basins and parameter diagrams of rigs with effects."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import InputError, Rig
from drill_env.continuation import (
    PeriodMap,
    hopf_map,
    hopf_points,
    parameter_diagram,
    vibration_map,
)
from drill_env.continuation.basins import basins, fate
from drill_env.continuation.extended_equilibria import turning_at
from drill_env.continuation.extended_flow import ExtendedFlow
from drill_env.continuation.extended_tracer import ExtendedTracer
from drill_env.effects import LIBRARY
from drill_env.effects.steady import lasting
from drill_env.integrator import simulate, vector_field

RIG = Rig()
BOX = (1.0, 15.0, 15.0)
SIZED = [
    name for name, effect in LIBRARY.items()
    if not effect.senses and any(p.role == "amplitude" for p in effect.parameters)
]  # fmt: skip

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")


def sized(name: str, size: float) -> dict:
    values = {p.name: p.grid[len(p.grid) // 2] for p in LIBRARY[name].parameters}
    return {"id": name} | values | {
        p.name: size for p in LIBRARY[name].parameters if p.role == "amplitude"
    }  # fmt: skip


@pytest.mark.parametrize("name", SIZED)
def test_an_effect_of_no_size_moves_nothing(name):
    """What is proportional to 0 may be left out of a diagram: the whole motion is the plain one."""
    rig = RIG.replace(effects=(sized(name, 0.0),))
    assert lasting(rig).effects == ()
    start = np.array([1.0, 3.0, 4.0, 0.0])
    runs = [simulate(r, 3.0, 4.0, initial=start) for r in (rig, RIG)]
    np.testing.assert_allclose(runs[0].state, runs[1].state, rtol=1e-9, atol=1e-9)


def test_an_effect_of_no_size_gives_the_plain_map_and_basin_bit_for_bit():
    none = RIG.replace(effects=(sized("friction_heating", 0.0), sized("unbalance", 0.0)))
    values = np.array([-0.291, -0.2])
    assert vibration_map(none, "T2", values, 15.0).equals(vibration_map(RIG, "T2", values, 15.0))
    assert hopf_map(none, "T2", values, 15.0).equals(hopf_map(RIG, "T2", values, 15.0))
    assert basins(none, 13.6, BOX, 40).starts.equals(basins(RIG, 13.6, BOX, 40).starts)


def test_an_effect_that_is_a_parameter_has_the_map_and_the_curve_of_that_parameter():
    """More viscous friction of the motor, as an effect and in the rig's own damping.

    The plain rig's continuation shares neither the effects nor the derivatives.
    """
    ours, truth = (
        RIG.replace(effects=({"id": "upper_viscous", "damping": 0.2},)),
        RIG.replace(bu=RIG.bu + 0.2),
    )
    found, plain = (vibration_map(rig, "T2", np.array([-0.24]), 14.0) for rig in (ours, truth))
    assert found.failures.tolist() == [""] and plain.fold.notna().all()
    numbers = ["hopf_low", "hopf_high", "fold", "vibration_from", "vibration_to"]
    np.testing.assert_allclose(found[numbers], plain[numbers], atol=1e-6)
    found, plain = (parameter_diagram(rig, "ktheta", 3.5, 0.07, 0.08) for rig in (ours, truth))
    assert found.failures == () and len(found.branches) == 2
    cycles = [p.cycle for b in found.branches for p in b.points]
    same = PeriodMap(truth, "ktheta", 3.5)
    for cycle in cycles[::4]:
        shot = same.shoot(cycle.state, cycle.period, cycle.parameter)
        np.testing.assert_allclose(shot.end, cycle.state, atol=1e-7)
    np.testing.assert_allclose(found.equilibria.omega, plain.equilibria.omega.iloc[0], rtol=1e-9)
    assert not found.equilibria.stable.any() and not plain.equilibria.stable.any()


def test_a_number_of_an_effect_is_mapped_and_lag_moves_the_hopf_point_as_theory_says():
    """As the brake's slope d becomes d/(1 + tau s) the Hopf voltage is that of i w, see Nyquist."""
    from scipy.optimize import fsolve

    from drill_env.dynamics import equilibrium_voltage
    from drill_env.friction import lower_curve_slope

    rig = RIG.replace(effects=({"id": "friction_lag", "time_constant": 0.02},))
    curve = hopf_map(rig, "friction_lag.time_constant", np.array([0.01, 0.05]), 15.0)
    assert list(curve["index"]) == [0, 1, 0, 1]
    for row in curve.itertuples():

        def characteristic(z, tau=row.value):
            s, d = 1j * z[1], float(lower_curve_slope(RIG, z[0]))
            upper = RIG.Ju * s * s + (RIG.bu + RIG.dbu) * s + RIG.ktheta
            value = upper * (RIG.Jl * s * s + d * s / (1.0 + tau * s) + RIG.ktheta) - RIG.ktheta**2
            return [value.real, value.imag]

        omega, _ = fsolve(characteristic, [row.omega, 1.55], xtol=1e-13)
        assert row.voltage == pytest.approx(float(equilibrium_voltage(RIG, omega)), rel=1e-6)


def test_a_branch_that_is_stable_nowhere_is_reached_from_its_hopf_point():
    tiny = RIG.replace(effects=({"id": "string_damping", "damping": 1e-12},))
    found = ExtendedTracer(ExtendedFlow(tiny), 13.0, 13.6)
    found.from_hopf_points(hopf_points(RIG, 15.0)[1:])
    assert found.failures == []
    (branch,) = found.branches
    assert not any(point.cycle.stable for point in branch.points)
    last = branch.points[-1].cycle
    assert last.parameter == pytest.approx(13.6)
    shot = PeriodMap(RIG).shoot(last.state, last.period, last.parameter)
    np.testing.assert_allclose(shot.end, last.state, atol=1e-7)
    plain = np.linalg.eigvals(shot.jacobian[:, :3])
    assert np.abs(plain).max() == pytest.approx(np.abs(last.multipliers).max(), rel=1e-5)


@pytest.mark.parametrize("entry", [
    {"id": "friction_lag", "time_constant": 0.02}, {"id": "string_damping", "damping": 1e-4},
])  # fmt: skip
def test_simulation_from_a_grid_of_starts_agrees_with_the_verdicts(entry):
    """At 13.2 to 14 V both motions are stable; 1500 s on each start is where it belongs."""
    rig = RIG.replace(effects=(entry,))
    volts = 13.6
    (state, stable), *_ = turning_at(rig, volts)
    assert stable
    np.testing.assert_allclose(vector_field(rig, np.array([volts]), state[None]), 0.0, atol=1e-9)
    fates = set()
    for twist in (-1.0, 1.0):
        for omega_l in (-24.0, -8.0, 8.0):
            start = np.append(state[:3] + [twist, 0.0, omega_l], 0.0)
            told = fate(rig, volts, start, state, None)
            run = simulate(rig, volts, 1500.0, initial=start, rate=10.0, rtol=1e-8)
            swing = float(np.ptp(run.omega_l[-200:]))
            assert told == ("equilibrium" if swing < 5.0 else "limit cycle"), (twist, omega_l)
            assert not 5.0 < swing < 40.0
            fates.add(told)
    assert fates == {"equilibrium", "limit cycle"}


def test_a_rig_that_an_effect_holds_comes_to_rest_beside_its_equilibrium():
    """Friction that falls with speed: from rest 0.5 V does not move it, once moving it turns."""
    sticky = {"id": "upper_stribeck", "torque": 4.0, "velocity": 0.1}
    rig, volts = RIG.replace(effects=(sticky,)), 0.5
    assert rig.km * volts < RIG.Tsu + 4.0
    found = basins(rig, volts, (3.0, 1.0, 1.0), 12).starts
    assert set(found.fate) == {"equilibrium", "rest"}
    for row in found.itertuples():
        start = np.array([row.twist, row.omega_u, row.omega_l, 0.0])
        end = simulate(rig, volts, 600.0, initial=start).state[-1, 1:3]
        assert (np.abs(end).max() < 1e-9) == (row.fate == "rest")


def test_a_motor_that_warms_leaves_the_equilibrium_that_it_first_came_to():
    """At 14.5 V no cycle is left of the cold rig; warm, the motor feels 12.8 V, below D."""
    warming = {"id": "motor_heating", "loss": 0.005, "time_constant": 60.0}
    rig, volts = RIG.replace(effects=(warming,)), 14.5
    (state, stable), *_ = turning_at(rig, volts)
    assert not stable and volts * (1.0 - 0.005 * state[3]) == pytest.approx(12.806, abs=1e-3)
    (plain,) = basins(RIG, volts, (0.0, 0.0, 15.0), 1).starts.fate
    assert plain == "equilibrium"
    start = np.append(state[:3] + [0.0, 0.0, -15.0], 0.0)
    assert fate(rig, volts, start, state, None) == "limit cycle"
    run = simulate(rig, volts, 2000.0, initial=start, rate=10.0, rtol=1e-8)
    assert np.ptp(run.omega_l[-200:]) > 40.0


@pytest.mark.parametrize("name", ["unbalance", "friction_drift", "string_hysteresis"])
def test_what_never_comes_back_is_refused_with_the_reason(name):
    rig = RIG.replace(effects=(sized(name, 0.01),))
    for ask in (
        lambda: vibration_map(rig, "T2", np.array([-0.2]), 5.0),
        lambda: hopf_map(rig, "T2", np.array([-0.2]), 5.0),
        lambda: basins(rig, 5.0, BOX, 5),
        lambda: parameter_diagram(rig, "T2", 3.5, -0.3, -0.2),
    ):
        with pytest.raises(InputError, match=f"{name} follow.* never forget"):
            ask()
    with pytest.raises(InputError, match="string_damping.damping"):
        hopf_map(RIG.replace(effects=(sized("string_damping", 1e-4),)), "x", np.array([1.0]), 5.0)
