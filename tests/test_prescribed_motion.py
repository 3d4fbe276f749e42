"""An upper disc that is moved by something unknown: its measured motion is the input."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import make_smoothing_spline
from typer.testing import CliRunner

from drill_env import Rig, save_rig
from drill_env._errors import InputError
from drill_env.cli.main import app, obey
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.identification.estimate import identify
from drill_env.identification.known_loads import tells_scale
from drill_env.identification.laws import compare_laws
from drill_env.identification.one_inertia import identify_one_inertia
from drill_env.identification.prescribed_motion import followed_motion
from drill_env.identification.replay import replay
from drill_env.identification.screening import findings
from drill_env.recordings import Recording, parse_map, read_folder, read_recording
from drill_env.recordings.prescribed import _reinsch, held_acceleration

RATE, STEP = 100.0, 2.0 * math.pi / 8192
JL, KTHETA, TSL, BL = 0.0326, 0.078, 0.02, 0.004
# What stands there of the drive and the upper disc is nonsense.
RIG = Rig(
    km=9.0, Ju=77.0, Tsu=3.0, dTsu=0.1, bu=0.5, dbu=0.2, Jl=JL, ktheta=KTHETA, Tsl=TSL, T1=0.0,
    T2=0.0, beta1=1.0, beta2=1.0, bl=BL, friction="coulomb",
)  # fmt: skip
UPPER = ("km", "Ju", "Tsu", "dTsu", "bu", "dbu")
# Those that a short recording has to tell apart, and none that takes long.
KEPT = {"quadratic_drag", "unbalance", "lower_disturbance", "string_hardening"}
FEW = tuple(set(LIBRARY) - KEPT)


def turning(shift=0.0):
    """A top that never stands: angle as a function of time."""
    return lambda t: 6.0 * t + 3.5 * np.sin(0.6 * t + shift) + 0.4 * np.sin(2.1 * t + 2.0 * shift)


def swinging(t):
    return 3.0 * np.sin(0.5 * t) + 0.5 * np.sin(1.3 * t)


def lower_disc(top, seconds, start, extra=lambda s, angle, speed: 0.0):
    """Angles of both discs by SciPy alone; each slip and stick of the lower one is located."""
    t = np.arange(int(seconds * RATE)) / RATE
    now, (angle, speed), theta, sticks = 0.0, start, np.full(len(t), math.nan), 0
    while now < t[-1]:
        way = math.copysign(1.0, speed or top(now) - angle)

        def rates(s, x, way=way):
            torque = KTHETA * (top(s) - x[0]) - way * TSL - BL * x[1] + extra(s, *x)
            return [x[1], torque / JL]

        def stops(s, x):
            return x[1]

        def pulls(s, x):
            return abs(KTHETA * (top(s) - x[0])) - TSL

        free = abs(KTHETA * (top(now) - angle)) >= TSL * (1.0 - 1e-9) or speed != 0.0
        event = stops if free else pulls
        event.terminal = True
        event.direction = -way if free else 1.0
        run = solve_ivp(
            rates if free else lambda s, x: [0.0, 0.0], (now, t[-1]), [angle, speed],
            events=event, rtol=1e-10, atol=1e-12, max_step=0.02, dense_output=True,
        )  # fmt: skip
        there = (t >= now) & (t <= run.t[-1])
        theta[there] = run.sol(t[there])[0]
        now, (angle, speed) = float(run.t[-1]), run.y[:, -1]
        if free and run.t_events[0].size:
            speed, sticks = 0.0, sticks + 1
    return t, top(t), theta, sticks


def made(top, seconds=25.0, start=None, extra=lambda s, angle, speed: 0.0, **more):
    """A recording of a run; its lower disc begins behind the top, and turns."""
    start = (float(top(0.0)) - 0.6, 5.0) if start is None else start
    t, upper, lower, _ = lower_disc(top, seconds, start, extra)
    return Recording(t, None, upper, lower, drive="motion", source="made", **more)


def counted(recording, seed, noise=3e-4):
    """The same through encoders."""
    rng = np.random.default_rng(seed)
    read = {
        name: STEP * np.round((theta + rng.normal(0.0, noise, len(theta))) / STEP)
        for name, theta in recording.angles().items()
    }
    return replace(recording, u=None, quanta=dict.fromkeys(read, STEP), **read)


def test_the_spline_is_scipys():
    rng = np.random.default_rng(0)
    t = np.sort(np.arange(300) / 100.0 + rng.uniform(-1e-3, 1e-3, 300))
    values = np.sin(3.0 * t) + rng.normal(0.0, 1e-2, 300)
    spline, bend = _reinsch(t, values, 1e-5)
    known = make_smoothing_spline(t, values, lam=1e-5)
    assert np.abs(spline - known(t)).max() < 1e-10
    assert np.abs(bend - known(t, 2)).max() < 1e-6


@pytest.mark.parametrize("noise", [0.0, 1e-3, 1e-2])
def test_the_acceleration_leads_along_the_motion_and_leaves_the_noise(noise):
    top, t = turning(), np.arange(3000) / RATE
    read = top(t) + np.random.default_rng(1).normal(0.0, noise, len(t))
    read[400:420] = math.nan
    run = Recording(t, None, read, np.zeros(len(t)), drive="motion")
    angle, velocity = followed_motion(run)
    inner = slice(50, -50)
    assert np.sqrt(np.mean((angle - top(t))[inner] ** 2)) < max(0.4 * noise, 1e-5)
    speed = 6.0 + 2.1 * np.cos(0.6 * t) + 0.84 * np.cos(2.1 * t)
    assert np.sqrt(np.mean((velocity - speed)[inner] ** 2)) < max(3.0 * noise, 1e-4)
    if noise:
        left = (read - angle)[np.isfinite(read)]
        assert np.std(left) == pytest.approx(noise, rel=0.06)


def test_a_replay_follows_a_disc_that_slides_and_one_that_sticks():
    run = made(turning())
    truth = np.array([0.6, followed_motion(run)[1][0], 5.0, run.theta_l[0]])
    assert replay(run, RIG, initial=truth).errors["theta_l"].rms < 1e-4
    t, upper, lower, sticks = lower_disc(swinging, 30.0, (0.0, 0.0))
    assert sticks > 3
    run = Recording(t, None, upper, lower, drive="motion")
    found = replay(run, RIG)
    assert found.rig == RIG
    assert found.errors["theta_l"].rms < 2e-4 and found.errors["theta_u"].rms < 1e-5
    assert found.prediction_errors["theta_l"].rms < 1e-3
    # The errors of 8192 counts, and not of a wrong input.
    assert replay(counted(run, 1), RIG).errors["theta_l"].rms < 3e-3


def test_a_measured_velocity_of_the_top_is_enough():
    top = turning()
    run = made(top)
    speed = 6.0 + 2.1 * np.cos(0.6 * run.t) + 0.84 * np.cos(2.1 * run.t)
    only = Recording(run.t, None, None, run.theta_l, omega_u=speed, drive="motion")
    truth = np.array([0.6, speed[0], 5.0, run.theta_l[0]])
    assert replay(only, RIG, initial=truth).errors["theta_l"].rms < 1e-3


def test_identify_finds_string_and_lower_disc_and_leaves_the_rest_as_it_was():
    t, upper, lower, _ = lower_disc(swinging, 30.0, (0.0, 0.0))
    run = counted(Recording(t, None, upper, lower, drive="motion"), 2)
    start = RIG.replace(ktheta=0.09, Tsl=0.025, bl=0.003)
    found = identify([run], start, fixed={"Jl": JL})
    assert found.free == ("ktheta", "Tsl", "bl")
    assert found.rig.ktheta == pytest.approx(KTHETA, rel=1e-3)
    assert found.rig.Tsl == pytest.approx(TSL, rel=5e-3)
    assert found.rig.bl == pytest.approx(BL, rel=1e-2)
    assert all(getattr(found.rig, name) == getattr(RIG, name) for name in UPPER)


@pytest.mark.parametrize(
    ("extra", "name", "number", "value"),
    [
        (lambda s, angle, speed: -2e-4 * speed * abs(speed), "quadratic_drag", "coefficient", 2e-4),
        (lambda s, angle, speed: 0.003 * math.cos(angle + 0.5), "unbalance", "torque", 0.003),
        (lambda s, angle, speed: 0.0, None, "", 0.0),
    ],
)
def test_diagnose_names_what_acts_on_the_lower_disc_and_nothing_on_the_upper(
    extra, name, number, value
):
    runs = [counted(made(turning(p), extra=extra), seed) for seed, p in enumerate((0.0, 2.0))]
    ripple = {"id": "torque_ripple", "torque": 0.2, "phase": 0.0, "order": 7.0}
    given = RIG.replace(ktheta=0.0785, effects=(ripple,))
    options = DiagnosisOptions(given_rig=True, most=1, leave_out=FEW)
    found = diagnose(runs[:1], given, runs[1:], options=options)
    assert [e.id for e in found.result.effects] == ([] if name is None else [name])
    if name is None:
        assert found.result.verdict in ("consistent", "parameters")
    else:
        told = found.result.effects[0].parameters[number].value
        assert told == pytest.approx(value, rel=0.03)
    assert set(found.result.parameters_changed) == {"ktheta", "Tsl", "bl"}
    assert all(getattr(found.rig, one) == getattr(given, one) for one in UPPER)
    assert found.rig.effects[0]["id"] == "torque_ripple"
    assert "theta_u" not in found.result.fit["holdout"]
    tried = {scored.term.id for one in found.found.rounds for scored in one.scores}
    assert tried and not any("upper" in one or one.startswith("error_u") for one in tried)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (lambda run: {"theta_l": None}, "map theta_l or omega_l"),
        (lambda run: {"u": np.zeros(len(run))}, "leave u out"),
    ],
)
def test_what_was_not_measured_is_named(change, told):
    run = made(turning(), seconds=8.0)
    with pytest.raises(InputError, match=told):
        replay(replace(run, **change(run)), RIG)


def test_what_nothing_is_known_of_is_refused_with_the_remedy():
    run = made(turning(), seconds=8.0)
    with pytest.raises(InputError, match="map theta_u or omega_u"):
        Recording(run.t, None, None, run.theta_l, drive="motion")
    axis = Rig.one_inertia(km=1.0, Ju=1.0, Tsu=0.1, bu=0.1)
    for call in (lambda: replay(run, axis), lambda: identify_one_inertia([run], 1.0),
                 lambda: identify([run], axis, fixed={"Ju": 1.0}),
                 lambda: diagnose([run], axis)):  # fmt: skip
        with pytest.raises(InputError, match="map its drive u or torque"):
            call()
    other = replace(run, u=np.ones(len(run)), drive="voltage", source="volts")
    for call in (lambda: identify([run, other], RIG, fixed={"Jl": JL}),
                 lambda: diagnose([run], RIG, [other])):  # fmt: skip
        with pytest.raises(InputError, match="volts is driven by a voltage and made by an unknown"):
            call()
    with pytest.raises(InputError, match="--fix Jl=VALUE"):
        identify([run], RIG)
    with pytest.raises(InputError, match="nothing is told of km"):
        identify([run], RIG, free=["km", "ktheta"], fixed={"Jl": JL})
    with pytest.raises(InputError, match="there is none"):
        compare_laws([run], RIG, fixed={"Jl": JL})
    gain = {"id": "encoder_eccentricity_upper", "amplitude": 0.01, "phase": 0.0}
    with pytest.raises(InputError, match="correct theta_u"):
        replay(run, RIG.replace(effects=(gain,)))


def test_what_acts_on_the_upper_disc_tells_no_scale_and_what_acts_on_the_lower_one_does():
    run = made(turning(), seconds=8.0)
    load = np.ones(len(run))
    assert not tells_scale([replace(run, load_u=load), replace(run, added_inertia_u=1.0)])
    assert tells_scale([replace(run, load_l=load)])
    assert tells_scale([run, replace(run, added_inertia_l=0.01)])
    assert not findings(run)
    pulled = replay(replace(run, load_u=1e3 * load, added_inertia_u=5.0), RIG)
    plain = replay(run, RIG)
    assert np.abs(pulled.simulated["theta_l"] - plain.simulated["theta_l"]).max() < 1e-9


def test_an_inertia_that_was_added_to_the_lower_disc_frees_its_own():
    def made_with(added, seed):
        scale = JL / (JL + added)
        top = turning(seed)
        t = np.arange(int(20.0 * RATE)) / RATE
        run = solve_ivp(
            lambda s, x: [x[1], scale * (KTHETA * (top(s) - x[0]) - TSL - BL * x[1]) / JL],
            (0.0, t[-1]), [float(top(0.0)) - 0.6, 5.0], t_eval=t, rtol=1e-10, atol=1e-12,
        )  # fmt: skip
        assert run.y[1].min() > 0.0
        read = Recording(t, None, top(t), run.y[0], drive="motion", added_inertia_l=added)
        return counted(read, seed)

    runs = [made_with(0.0, 0), made_with(0.02, 1)]
    found = identify(runs, RIG.replace(Jl=0.036, ktheta=0.083))
    assert found.rig.Jl == pytest.approx(JL, rel=5e-3)
    assert found.rig.ktheta == pytest.approx(KTHETA, rel=5e-3)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("motion")
    run = counted(made(turning(), seconds=12.0), 3)
    table = np.column_stack([run.t, run.theta_u, run.theta_l])
    head = {"delimiter": ",", "comments": ""}
    np.savetxt(folder / "run.csv", table, header="t,theta_u,theta_l", **head)
    np.savetxt(folder / "top.csv", table[:, :2], header="t,theta_u", **head)
    np.savetxt(folder / "bit.csv", table[:, ::2], header="t,a", **head)
    save_rig(RIG, folder / "rig.toml")
    return folder


def test_files_say_that_the_drive_is_unknown(files, tmp_path):
    run = read_recording(files / "run.csv", parse_map(["u=unknown"]), need=("u",))
    assert run.drive == "motion"
    assert np.array_equal(run.u, held_acceleration(run.t, run.theta_u, None, ""))
    late = read_recording(files / "run.csv", parse_map(["u=unknown", "theta_u=theta_u@0.02"]))
    assert np.nanmax(np.abs(late.theta_u[:-2] - run.theta_u[2:])) < 1e-12
    assert np.abs(late.u[100:-102] - run.u[102:-100]).max() < 0.05 * np.abs(run.u).max()
    for name in ("run.csv", "top.csv", "bit.csv"):
        (tmp_path / name).write_text((files / name).read_text())
    (tmp_path / "recordings.toml").write_text(
        '[defaults]\ncolumns = { u = "unknown" }\n[[recording]]\nfile = "run.csv"\n[[recording]]\n'
        'files = { theta_u = "top.csv", theta_l = "bit.csv" }\n'
        'columns = { theta_l = "a" }\nrole = "holdout"\n'
    )
    found = read_folder(tmp_path)
    assert [r.drive for r in (*found.fit, *found.holdout)] == ["motion", "motion"]
    assert np.allclose(found.holdout[0].u, run.u)
    with pytest.raises(InputError, match="no delay|no column"):
        read_recording(files / "run.csv", parse_map(["u=unknown@0.1"]))


def test_every_command_takes_it_or_says_why_not(files):
    runner, rig = CliRunner(), ["--rig", str(files / "rig.toml")]
    run = [str(files / "run.csv"), "--map", "u=unknown"]
    shown = json.loads(runner.invoke(app, ["check", *run, *rig, "--json"]).stdout)[0]
    assert shown["channels"]["acceleration_u"]["unit"] == "rad/s^2"
    replayed = json.loads(runner.invoke(app, ["replay", *run, *rig, "--json"]).stdout)
    assert replayed["errors"]["theta_l"]["rms"] < 0.02
    out = str(files / "out.csv")
    done = runner.invoke(
        app, ["simulate", "--input", run[0], *run[1:], *rig, "--out", out, "--json"]
    )
    assert done.exit_code == 0
    made_again = np.genfromtxt(out, delimiter=",", names=True)
    read = np.genfromtxt(run[0], delimiter=",", names=True)
    assert np.abs(made_again["theta_u"] - read["theta_u"]).max() < 5e-3


REFUSED = {
    "scale": (["identify"], "--fix Jl=VALUE"),
    "axis": (["identify", "--one-inertia", "--gain=1"], "map its drive"),
    "stage1": (["identify", "--fix", f"Jl={JL}", "--stage1", "top.csv"], "map its drive"),
    "laws": (["identify", "--fix", f"Jl={JL}", "--laws"], "there is none"),
    "design": (["design-experiment", "--recordings"], "what is planned is one"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_makes_no_sense_of_it_is_one_line_and_exit_status_2(name, files, monkeypatch, capsys):
    command, told = REFUSED[name]
    monkeypatch.chdir(files)
    monkeypatch.setattr(sys, "argv", ["drill-env", *command, "run.csv", "--map", "u=unknown"])
    with pytest.raises(SystemExit) as ended:
        obey()
    assert ended.value.code == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines[-1].startswith("error: ") and told in lines[-1]
