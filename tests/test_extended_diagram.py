"""Bifurcation diagrams of rigs with effects."""

from __future__ import annotations

import json

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from drill_env import InputError, Rig
from drill_env.cli.main import app
from drill_env.continuation import PeriodMap, extended_diagram, hopf_points, settled_cycle
from drill_env.continuation.branch import Corrector
from drill_env.continuation.extended_diagram import extended_table
from drill_env.continuation.extended_equilibria import (
    equilibria,
    extended_branch,
    extended_hopf_points,
)
from drill_env.continuation.sweep import swept
from drill_env.effects import LIBRARY
from drill_env.effects.steady import unsteady
from drill_env.integrator import simulate, vector_field
from drill_env.parameters import save_rig

RIG = Rig()
SPEEDS = np.unique(np.concatenate([np.geomspace(1e-3, 40.0, 150), np.linspace(1e-3, 40.0, 300)]))
DAMPED = RIG.replace(effects=({"id": "string_damping", "damping": 5e-4},))


def hopf_of(rig):
    return extended_hopf_points(rig, extended_branch(rig, SPEEDS), 20.0)


def test_without_effects_the_hopf_points_are_the_analytic_ones():
    ours, exact = hopf_of(RIG), hopf_points(RIG, 20.0)
    assert len(ours) == len(exact) == 2
    for point, truth in zip(ours, exact, strict=True):
        assert point.voltage == pytest.approx(truth.voltage, abs=1e-6)
        assert point.frequency == pytest.approx(truth.frequency, abs=1e-6)
        assert point.lyapunov == pytest.approx(truth.lyapunov, rel=1e-3)
        assert point.crossing == pytest.approx(truth.crossing, rel=1e-3)
        np.testing.assert_allclose(point.mode, truth.mode, atol=1e-6)


def test_an_effect_that_is_a_parameter_moves_the_hopf_points_as_the_parameter_does():
    as_effect = RIG.replace(effects=({"id": "upper_viscous", "damping": 0.4},))
    moved = hopf_points(RIG.replace(bu=RIG.bu + 0.4), 20.0)
    assert [p.voltage for p in hopf_of(as_effect)] == pytest.approx([p.voltage for p in moved])
    assert abs(moved[0].voltage - hopf_points(RIG, 20.0)[0].voltage) > 0.05


@pytest.mark.parametrize("entry", [
    {"id": "quadratic_drag", "coefficient": 3e-4},
    {"id": "string_hardening", "coefficient": 1e-4},
    {"id": "supply_sag", "sag": 0.02},
    {"id": "table", "component": "lower", "depends_on": "omega_l", "sort": "torque",
     "knots": [0.0, 10.0, 40.0], "values": [0.0, -0.01, -0.02]},
])  # fmt: skip
def test_an_equilibrium_stays_where_it_is_simulated(entry):
    rig = RIG.replace(effects=(entry,))
    volts, states = equilibria(rig, np.array([30.0]))
    np.testing.assert_allclose(vector_field(rig, volts, states), 0.0, atol=1e-9)
    assert_stays(rig, float(volts[0]), states[0])


def assert_stays(rig, volts, state):
    run = simulate(
        rig, volts, 2.0, initial=np.append(state[:3], 0.0), modes=np.array([1, 1, 0]),
        inner=state[3:],
    )  # fmt: skip
    np.testing.assert_allclose(run.state[:, :3], np.tile(state[:3], (len(run.state), 1)), atol=1e-6)
    np.testing.assert_allclose(run.inner, np.tile(state[3:], (len(run.state), 1)), atol=1e-6)


@pytest.mark.parametrize("name", ["string_creep", "friction_lag", "rate_state", "motor_heating",
                                  "presliding", "friction_heating", "gear_compliance",
                                  "string_inertia", "actuator_lag"])  # fmt: skip
def test_effects_with_inner_states_have_equilibria_too(name):
    entry = {p.name: p.grid[len(p.grid) // 2] for p in LIBRARY[name].parameters}
    if name == "motor_heating":
        # With the middle of its grid no voltage keeps this speed.
        entry["loss"] = 0.02
    rig = RIG.replace(effects=({"id": name, **entry},))
    volts, states = equilibria(rig, np.array([10.0]))
    assert_stays(rig, float(volts[0]), states[0])


def test_lagged_friction_moves_the_hopf_point_as_its_transfer_function_says():
    """The slope d becomes d/(1 + tau s): Hopf where the characteristic function is 0 at i w."""
    from scipy.optimize import fsolve

    from drill_env.friction import lower_curve_slope

    tau = 0.05
    rig = RIG.replace(effects=({"id": "friction_lag", "time_constant": tau},))

    def characteristic(z):
        omega, w = z
        s, d = 1j * w, float(lower_curve_slope(RIG, omega))
        upper = RIG.Ju * s * s + (RIG.bu + RIG.dbu) * s + RIG.ktheta
        lower = RIG.Jl * s * s + d * s / (1.0 + tau * s) + RIG.ktheta
        value = upper * lower - RIG.ktheta**2
        return [value.real, value.imag]

    for point in hopf_of(rig):
        omega, w = fsolve(characteristic, [point.omega, point.frequency], xtol=1e-13)
        assert (point.omega, point.frequency) == pytest.approx((omega, w), rel=1e-5)
    assert len(hopf_of(rig)) == 2


def test_the_sweep_finds_both_attractors_between_the_fold_and_the_hopf_point():
    """D lies at 13.18 V and C at 14.17 V: between them vibration and steady turning coexist."""
    found = swept(DAMPED.replace(effects=({"id": "string_damping", "damping": 1e-12},)),
                  np.array([0.05, 3.0, 8.0, 12.0, 14.0, 15.0]))  # fmt: skip
    up, down = (found[found.direction == way].sort_values("voltage") for way in ("up", "down"))
    vibrates = ["cycle"] * 3
    assert list(up.kind) == ["rest", *vibrates, "cycle", "equilibrium"]
    assert list(down.kind) == ["rest", *vibrates, "equilibrium", "equilibrium"]
    guess = settled_cycle(PeriodMap(RIG), 3.0)
    assert guess is not None
    corrector = Corrector(PeriodMap(RIG), np.array([6.0, 14.0, 19.0, 4.0, 1.0]))
    cycle = corrector.at_parameter(guess, 3.0).cycle
    row = up.iloc[1]
    assert (row["min"], row["max"]) == pytest.approx((cycle.min, cycle.max), abs=1e-3)
    assert row.period == pytest.approx(cycle.period, rel=1e-3)


def test_linearisation_and_sweep_agree_on_where_vibration_begins():
    hopf = hopf_of(DAMPED)[0]
    assert hopf.supercritical and hopf.voltage > hopf_points(RIG, 20.0)[0].voltage + 0.005
    found = swept(DAMPED, np.array([hopf.voltage - 0.02, hopf.voltage + 0.02]))
    assert list(found.kind) == ["equilibrium", "cycle", "cycle", "equilibrium"]


def test_effects_that_follow_an_angle_are_swept_alone():
    rig = RIG.replace(effects=({"id": "unbalance", "torque": 0.01, "phase": 0.0},))
    found = extended_diagram(rig, 4.0, step=2.0)
    assert found.equilibria is None and not found.hopf and "unbalance" in found.remarks[0]
    assert list(found.attractors.kind[:3]) == ["rest", "cycle", "cycle"]
    assert set(extended_table(found).branch) == {"up", "down"}


MOVING = [n for n, e in LIBRARY.items() if not e.senses]


@pytest.mark.parametrize("name", MOVING)
def test_autonomous_is_what_moves_alike_at_any_time_and_angle(name):
    effect = LIBRARY[name]
    q = {p.name: p.grid[len(p.grid) // 2] for p in effect.parameters}
    rig = RIG.replace(effects=({"id": name, **q},))
    if "time" in q:
        rig = RIG.replace(effects=({"id": name, **q, "time": 3.0},))
    start, times = np.array([1.0, 3.0, 4.0, 0.0]), np.arange(41) * 0.1
    runs = [
        simulate(rig, 3.0, 4.0, t_start=t, t_eval=t + times, initial=start + [0, 0, 0, angle])
        for t, angle in ((0.0, 0.0), (2.3, 1.0))
    ]
    gap = np.abs(runs[0].state[:, :3] - runs[1].state[:, :3]).max()
    # These two forget nothing, and begin anew with each run.
    if effect.autonomous or name in ("wear", "string_hysteresis"):
        assert gap < 1e-7
        assert effect.autonomous == (unsteady(rig) == [])
    else:
        assert gap > 1e-6


def test_the_command_draws_it_and_says_what_it_does_not(tmp_path):
    save_rig(DAMPED, tmp_path / "rig.toml")
    args = ["bifurcation", "--rig", str(tmp_path / "rig.toml"), "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, [*args, "--to", "1"])
    assert done.exit_code == 0, done.output
    points = json.loads((tmp_path / "out/points.json").read_text("utf-8"))
    assert [p["kind"] for p in points] == ["hopf"]
    table = pd.read_csv(tmp_path / "out/diagram.csv")
    stable = table[(table.branch == "equilibria") & (table.stable.astype(bool))]
    assert stable.parameter.max() == pytest.approx(points[0]["parameter"], abs=0.02)
    assert (tmp_path / "out/diagram.png").stat().st_size > 10_000
    unbalanced = DAMPED.replace(effects=({"id": "unbalance", "torque": 0.01, "phase": 0.0},))
    save_rig(unbalanced, tmp_path / "rig.toml")
    refused = CliRunner().invoke(app, [*args, "--map", "bl", "--range", "0.003,0.005,3"])
    assert isinstance(refused.exception, InputError)
    assert "unbalance follow time or an angle" in str(refused.exception)


def test_the_command_draws_maps_and_basins_of_it(tmp_path):
    save_rig(DAMPED, tmp_path / "rig.toml")
    args = ["bifurcation", "--rig", str(tmp_path / "rig.toml"), "--out", str(tmp_path), "--jobs=1"]
    name = "string_damping.damping"
    done = CliRunner().invoke(app, [*args, "--map", name, "--range", "0,0.0005,2", "--to", "1"])
    assert done.exit_code == 0, done.output
    rows = pd.read_csv(tmp_path / f"map-{name}.csv")
    assert rows.hopf_low.tolist() == pytest.approx([0.56572927, 0.57372948], abs=1e-7)
    done = CliRunner().invoke(app, [*args, "--basin", "1,1,1", "--volts", "1", "--starts", "5"])
    assert done.exit_code == 0, done.output
    assert set(pd.read_csv(tmp_path / "basin.csv").fate) == {"limit cycle"}
