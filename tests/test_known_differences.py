"""What was bolted on a machine for one run is known there, and tells the scale of torque."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env._errors import InputError
from drill_env.cli.main import app
from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.diagnose import _scale, diagnose
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.identification.estimate import identify
from drill_env.identification.inverse_dynamics import InverseOptions
from drill_env.identification.known_loads import known_effects, tells_scale
from drill_env.identification.noise import NoiseModel
from drill_env.identification.one_inertia import identify_one_inertia
from drill_env.identification.prediction_error import trace_of
from drill_env.identification.replay import replay
from drill_env.identification.samples import prepare
from drill_env.parameters import save_rig
from drill_env.prediction.motion import motion_as_read
from drill_env.recordings import Recording, parse_map, read_folder, read_recording

RATE = 200.0
AXIS = Rig.one_inertia(km=0.5, Ju=0.02, Tsu=0.0, bu=0.05)
RIG = Rig.paper().replace(friction="coulomb", Tsl=0.01)
STEP = 2.0 * math.pi / 65536


def solved(rates, t, states):
    run = solve_ivp(
        rates, (0.0, t[-1]), np.zeros(states), t_eval=t, max_step=1.0 / RATE, rtol=1e-9,
        atol=1e-11, method="LSODA",
    )  # fmt: skip
    return run.y


def held(u):
    return lambda now: u[min(int(now * RATE + 1e-9), len(u) - 1)]


@cache
def axis_run(seed, seconds=10.0, added=0.0, weight=0.0):
    """An axis that turns to and fro, by SciPy from the formulas."""
    t = np.arange(int(seconds * RATE)) / RATE
    u = 1.5 * quasi_random(np.random.default_rng(seed), seconds, RATE, 2.0)
    volts = held(u)

    def rates(now, y):
        torque = AXIS.km * volts(now) - AXIS.bu * y[1]
        torque += weight * math.cos(y[0] + 0.4)
        return [y[1], torque / (AXIS.Ju + added)]

    theta = solved(rates, t, 2)[0]
    effects = ({"id": "upper_unbalance", "torque": weight, "phase": 0.4},) if weight else ()
    return Recording(t, u, theta, added_inertia_u=added, effects=effects, source=f"axis {seed}")


@cache
def rig_run(seed, seconds=20.0, upper=0.0, lower=0.0, lever=0.0):
    """A whole rig that turns forward all the time, by SciPy from the formulas."""
    t = np.arange(int(seconds * RATE)) / RATE
    u = 3.5 + 1.2 * quasi_random(np.random.default_rng(seed), seconds, RATE, 2.0)
    u[: int(0.5 * RATE)] = 6.0
    volts, p = held(u), RIG

    def rates(now, y):
        twist = p.ktheta * (y[0] - y[1])
        above = p.km * volts(now) - twist - (p.bu + p.dbu) * y[2] - (p.Tsu + p.dTsu) * (y[2] >= 0)
        below = twist - p.bl * y[3] - p.Tsl * np.tanh(y[3] / 1e-4) - lever * math.cos(y[1])
        return [y[2], y[3], above / (p.Ju + upper), below / (p.Jl + lower)]

    y = solved(rates, t, 4)
    effects = ({"id": "unbalance", "torque": lever, "phase": math.pi},) if lever else ()
    return Recording(
        t, u, y[0], y[1], added_inertia_u=upper, added_inertia_l=lower, effects=effects,
        source=f"rig {seed}",
    )  # fmt: skip


def read(recording, seed=0):
    """As encoders read it."""
    noise = np.random.default_rng(seed).normal(0.0, 2e-4, (2, len(recording)))
    names = [name for name in ("theta_u", "theta_l") if getattr(recording, name) is not None]
    angles = {
        name: STEP * np.round((getattr(recording, name) + n) / STEP)
        for name, n in zip(names, noise, strict=False)
    }
    return replace(recording, **angles, quanta=dict.fromkeys(names, STEP))


def off(recording, rig, **more):
    return max(e.rms for e in replay(recording, rig, **more).errors.values())


def bare(recording):
    return replace(recording, added_inertia_u=0.0, added_inertia_l=0.0, effects=())


@pytest.mark.parametrize("known", [{"added": 0.01}, {"weight": 0.25}])
def test_a_replay_of_an_axis_knows_what_was_bolted_on(known):
    run = axis_run(1, **known)
    assert off(run, AXIS) < 1e-5
    assert off(bare(run), AXIS) > 0.05


@pytest.mark.parametrize("known", [{"upper": 0.1}, {"lower": 0.01}, {"lever": 0.03}])
def test_a_replay_of_a_rig_knows_what_was_bolted_on(known):
    run = rig_run(1, **known)
    assert off(run, RIG) < 2e-3
    assert off(bare(run), RIG) > 0.02


def test_the_torque_balance_of_an_axis_knows_what_was_bolted_on():
    runs = [axis_run(1), axis_run(2, added=0.02), axis_run(2, weight=0.25)]
    options = InverseOptions(centre_hold=True)
    found = identify_one_inertia(runs, AXIS.km, options=options)
    assert found.estimates["M"] == pytest.approx(AXIS.Ju, rel=0.01)
    assert found.estimates["Fv"] == pytest.approx(AXIS.bu, rel=0.01)
    without = identify_one_inertia([bare(run) for run in runs], AXIS.km, options=options)
    assert found.fit_error < 0.06 and without.fit_error > 0.2


@pytest.mark.parametrize("known", [{"added": 0.02}, {"weight": 0.25}])
def test_identify_finds_the_scale_of_torque_of_an_axis(known):
    runs = [read(axis_run(1)), read(axis_run(2, **known))]
    given = AXIS.replace(Ju=1.04 * AXIS.Ju, km=0.96 * AXIS.km)
    fixed = {"Tsu": 0.0, "dTsu": 0.0, "dbu": 0.0}
    found = identify(runs, given, fixed=fixed)
    for name in ("km", "Ju", "bu"):
        assert getattr(found.rig, name) == pytest.approx(getattr(AXIS, name), rel=2e-3)
        low, high = found.intervals()[name]
        assert high - low < 0.01 * getattr(AXIS, name)
    with pytest.raises(InputError, match="scale of torque"):
        identify([bare(run) for run in runs], given)


@pytest.mark.parametrize("known", [{"upper": 0.1}, {"lower": 0.01}, {"lever": 0.03}])
def test_diagnose_finds_the_scale_of_torque_of_a_rig(known):
    given = RIG.replace(Ju=1.04 * RIG.Ju, km=0.96 * RIG.km)
    runs = [read(rig_run(1)), read(rig_run(2, **known))]
    samples = [prepare(run, given) for run in runs]
    found = base_fit(samples, given, free_parameters(given, scale=_scale(samples, {})))[1].rig
    assert found.Ju == pytest.approx(RIG.Ju, rel=3e-3)
    assert found.km == pytest.approx(RIG.km, rel=3e-3)
    assert not tells_scale([bare(run) for run in runs])


def test_a_known_disc_is_nothing_that_is_missing_from_an_axis():
    given = AXIS.replace(Ju=1.04 * AXIS.Ju, km=0.96 * AXIS.km)
    runs = [read(axis_run(n, added=0.02 * (n % 2)), n + 10) for n in (1, 2, 3, 4)]
    options = DiagnosisOptions(given_rig=True, most=1, leave_out=("gear_backlash",))
    found = diagnose(runs[:2], given, runs[2:], options=options)
    assert not found.result.effects and found.result.verdict in ("consistent", "parameters")
    assert found.rig.Ju == pytest.approx(AXIS.Ju, rel=5e-3)
    assert found.rig.km == pytest.approx(AXIS.km, rel=5e-3)


GEAR = {
    "id": "gear_compliance", "frequency": 6.0, "motor_share": 0.25, "friction_share": 0.5,
    "damping": 0.07,
}  # fmt: skip


@cache
def geared_run(added, seconds=6.0):
    """An axis whose motor sits behind a spring, with more inertia on the disc."""
    motor, disc = 0.25 * AXIS.Ju, 0.75 * AXIS.Ju
    reduced = motor * disc / (motor + disc)
    pace = 2.0 * math.pi * GEAR["frequency"]
    t = np.arange(int(seconds * RATE)) / RATE
    u = 1.5 * quasi_random(np.random.default_rng(1), seconds, RATE, 2.0)
    volts = held(u)

    def rates(now, y):
        torque = pace**2 * reduced * (y[0] - y[1]) + 0.14 * pace * reduced * (y[2] - y[3])
        return [
            y[2], y[3], (AXIS.km * volts(now) - torque - 0.5 * AXIS.bu * y[2]) / motor,
            (torque - 0.5 * AXIS.bu * y[3]) / (disc + added),
        ]  # fmt: skip

    return Recording(t, u, solved(rates, t, 4)[1], added_inertia_u=added, source="geared")


# The same numbers would be another motor's on a disc that has all that inertia by itself.
KNOWN, OTHER = AXIS.replace(effects=(GEAR,)), AXIS.replace(Ju=0.05, effects=(GEAR,))


def test_a_gear_is_the_same_behind_a_heavier_disc():
    run = geared_run(0.03)
    assert off(run, KNOWN, initial=np.zeros(4)) < 1e-5
    assert off(bare(run), OTHER, initial=np.zeros(4)) > 1e-3


@pytest.mark.parametrize(
    "name",
    ["upper_resonator", "lower_resonator", "upper_viscous_damper", "lower_viscous_damper"],
)
def test_a_body_at_a_disc_keeps_its_inertia_and_its_pace(name):
    effect = LIBRARY[name]
    names = [p.name for p in effect.parameters]
    numbers = np.linspace(0.3, 0.7, len(names))
    assert effect.heavier is not None
    there = dict(zip(names, effect.heavier(numbers, 2.5), strict=True))
    here = dict(zip(names, numbers, strict=True))
    assert 2.5 * there.pop("share") == pytest.approx(here.pop("share"))
    assert there == here


def test_the_filter_takes_the_gear_for_the_same_too():
    noise = NoiseModel(2e-4, 2e-4, 0.1, 0.1, 2e-4, 2e-4)

    def error(run, rig):
        samples = prepare(run, rig)
        given = with_terms(samples, (), rig, motion_as_read(samples, rig))
        return np.std(trace_of(given, rig, noise, samples.starts).standardised[200:, 0])

    run = read(geared_run(0.03))
    assert error(run, KNOWN) < 1.05
    assert error(bare(run), OTHER) > 1.5


def table(path, **columns):
    np.savetxt(
        path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns),
        comments="",
    )  # fmt: skip


def test_manifests_maps_and_columns_state_what_was_bolted_on(tmp_path):
    t = np.arange(50) / 100.0
    columns = {"t": t, "u": np.sin(t), "theta_u": 0.1 * t, "theta_l": 0.1 * t}
    table(tmp_path / "a.csv", **columns)
    table(tmp_path / "b.csv", **columns, disc=np.full(50, 5.0))
    (tmp_path / "recordings.toml").write_text(
        "[defaults]\nadded_inertia_u = 0.05\n"
        '[[recording]]\nfile = "a.csv"\n'
        'effects = [{ id = "unbalance", torque = 0.1, phase = 0.0 }]\n'
        '[[recording]]\nfile = "b.csv"\nadded_inertia_u = 0\n'
        'columns = { added_inertia_l = "disc" }\nunits = { added_inertia_l = "gm2" }\n'
    )
    first, second = read_folder(tmp_path).fit
    assert (first.added_inertia_u, first.added_inertia_l) == (0.05, 0.0)
    assert [e["id"] for e in first.effects] == ["unbalance"]
    assert (second.added_inertia_u, second.added_inertia_l) == (0.0, pytest.approx(0.005))
    mapped = read_recording(tmp_path / "a.csv", parse_map(["added_inertia_l=10:gm2"]))
    assert mapped.added_inertia_l == pytest.approx(0.01)
    assert mapped.part(5, 40).added_inertia_l == mapped.added_inertia_l


@pytest.mark.parametrize(
    ("entry", "told"),
    [
        ("added_inertia_l=-1", "write the rig without it"),
        ("added_inertia_l=1e8", "beyond 1e.07 kg m.2"),
        ("added_inertia_u=theta_u", "not one number but 50"),
        ("added_inertia_u=theta_u@0.1", "no delay here"),
    ],
)
def test_an_impossible_addition_is_one_clear_error(tmp_path, entry, told):
    t = np.arange(50) / 100.0
    table(tmp_path / "a.csv", t=t, u=np.sin(t), theta_u=0.1 * t)
    with pytest.raises(InputError, match=told):
        read_recording(tmp_path / "a.csv", parse_map([entry]))


@pytest.mark.parametrize(
    ("effect", "told"),
    [
        ({"id": "nonsense"}, "a.csv: effect 1: id is 'nonsense'"),
        ({"id": "unbalance", "torque": 0.1}, "missing parameter phase"),
        ({"id": "upper_disturbance", "torque": 1, "phase": 0, "frequency": 1}, "load_u or load_l"),
        ({"id": "encoder_eccentricity_upper", "amplitude": 1, "phase": 0}, "in the rig file"),
        ({"id": "input_delay", "delay": 0.1}, "give that of u"),
        ("unbalance", "give a list of tables"),
    ],
)
def test_a_known_effect_that_is_wrong_is_one_clear_error(effect, told):
    t = np.arange(50) / 100.0
    with pytest.raises(InputError, match=told):
        known_effects(RIG, Recording(t, t, t, t, effects=(effect,), source="a.csv"))


def test_the_command_line_takes_and_checks_what_was_bolted_on(tmp_path):
    run = axis_run(1, 6.0, added=0.02)
    table(tmp_path / "a.csv", t=run.t, u=run.u, theta_u=run.theta_u)
    save_rig(AXIS, tmp_path / "axis.toml")
    files = [str(tmp_path / "a.csv"), "--rig", str(tmp_path / "axis.toml"), "--json"]
    call = [*files, "--map", "added_inertia_u=0.02"]
    shown = json.loads(CliRunner().invoke(app, ["check", *call]).stdout)[0]
    assert shown["added_inertia"] == {"u": 0.02, "l": 0.0}
    replayed = json.loads(CliRunner().invoke(app, ["replay", *call]).stdout)
    assert replayed["errors"]["theta_u"]["rms"] < 1e-4
