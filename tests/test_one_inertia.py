"""Inverse dynamics of one inertia: the published EMPS figures and known rigs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import typer
from typer.testing import CliRunner

from drill_env import InputError, Rig, load_rig
from drill_env.cli.recording_commands import register
from drill_env.identification.inverse_dynamics import InverseOptions, rig_force_error
from drill_env.identification.one_inertia import identify_one_inertia
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording, parse_map, read_recording

EMPS = Path(__file__).resolve().parents[2] / "shared" / "recordings" / "emps"
needs_emps = pytest.mark.skipif(not EMPS.is_dir(), reason="no EMPS recordings beside the checkout")
MAPS = ["u=vir", "theta_u=qm:m"]
AXIS = Rig.one_inertia(km=3.5, Ju=0.45, Tsu=0.32, dTsu=0.05, bu=1.9, dbu=-0.2)


@pytest.fixture(scope="module")
def emps():
    columns = parse_map(MAPS)
    names = ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")
    return [read_recording(EMPS / name, columns) for name in names]


def recorded(rig, u_of, seconds=20.0, rate=1000.0):
    t = np.arange(round(seconds * rate)) / rate
    u = u_of(t)
    voltage = sampled_voltage(t, u)
    run = simulate(rig, voltage, seconds, t_eval=t)
    return Recording(t=t, u=u, theta_u=run.theta_u)


def both_ways(t):
    return 3.0 * np.sin(1.3 * t) + 1.5 * np.sin(4.1 * t + 1.0)


@needs_emps
def test_emps_gives_the_published_figures(emps):
    """Janot, Gautier and Brunot (2019), to all printed digits."""
    fit, pulses = emps
    result = identify_one_inertia([fit], fit.constant("gtau"), holdout=[pulses])
    found = [result.estimates[name] for name in ("M", "Fv", "Fc", "offset")]
    assert found == pytest.approx([95.1089, 203.5034, 20.3935, -3.1648], abs=6e-5)
    assert 100 * result.fit_error == pytest.approx(4.083, abs=6e-4)
    assert 100 * result.holdout_errors[pulses.source] == pytest.approx(5.982, abs=6e-4)
    assert rig_force_error(pulses, result.rig) == pytest.approx(
        result.holdout_errors[pulses.source], rel=1e-9
    )


@needs_emps
def test_emps_with_asymmetric_friction(emps):
    fit, pulses = emps
    result = identify_one_inertia([fit], fit.constant("gtau"), holdout=[pulses], asymmetric=True)
    assert 100 * result.fit_error == pytest.approx(3.112, abs=6e-4)
    assert result.holdout_errors[pulses.source] < 0.0598
    assert rig_force_error(fit, result.rig) == pytest.approx(result.fit_error, rel=1e-9)


@needs_emps
def test_emps_figures_hang_on_the_stated_procedure(emps):
    """Without anti-alias decimation the pulses' error is another one, so no digit is luck."""
    fit, pulses = emps
    plain = identify_one_inertia(
        [fit], fit.constant("gtau"), holdout=[pulses], options=InverseOptions(decimation=1)
    )
    assert plain.holdout_errors[pulses.source] > 0.07


@needs_emps
def test_emps_voltage_is_held(emps):
    """The half sample that the published procedure leaves out shows in the pulses."""
    fit, pulses = emps
    result = identify_one_inertia(
        [fit], fit.constant("gtau"), holdout=[pulses], options=InverseOptions(centre_hold=True)
    )
    assert 100 * result.fit_error < 4.02
    assert 100 * result.holdout_errors[pulses.source] < 4.6


@pytest.mark.parametrize("rate", [1000.0, 200.0])
def test_a_simulated_axis_is_found_again(rate):
    run = recorded(AXIS, both_ways, rate=rate)
    options = InverseOptions(centre_hold=True)
    found = identify_one_inertia([run], AXIS.km, asymmetric=True, options=options).rig
    assert found.Ju == pytest.approx(AXIS.Ju, rel=0.005)
    assert found.bu == pytest.approx(AXIS.bu, rel=0.002)
    assert found.Tsu == pytest.approx(AXIS.Tsu, rel=0.01)
    assert found.dbu == pytest.approx(AXIS.dbu, abs=0.001)
    assert found.dTsu == pytest.approx(AXIS.dTsu, abs=0.006)


def test_encoder_steps_are_no_obstacle():
    run = recorded(AXIS, both_ways)
    step = 2 * np.pi / 8192
    counted = Recording(t=run.t, u=run.u, theta_u=np.round(run.theta_u / step) * step)
    found = identify_one_inertia(
        [counted], AXIS.km, asymmetric=True, options=InverseOptions(cutoff=30.0)
    ).rig
    assert found.Ju == pytest.approx(AXIS.Ju, rel=0.03)
    assert found.Tsu == pytest.approx(AXIS.Tsu, rel=0.03)


def test_only_ratios_show():
    run = recorded(AXIS, both_ways, seconds=5.0)
    one, two = (identify_one_inertia([run], gain) for gain in (3.5, 7.0))
    for name, value in one.estimates.items():
        assert two.estimates[name] == pytest.approx(2 * value, rel=1e-9)
    with pytest.raises(InputError, match="shows only ratios.*--gain KM"):
        identify_one_inertia([run], None)


def test_what_cannot_be_identified_is_refused():
    one_way = recorded(AXIS, lambda t: 2.0 + np.sin(2 * t), seconds=5.0)
    with pytest.raises(InputError, match="cannot be told apart.*moves both ways"):
        identify_one_inertia([one_way], 3.5)
    with pytest.raises(InputError, match="Fv_minus cannot be identified"):
        identify_one_inertia([one_way.part(50, 5000)], 3.5, asymmetric=True)
    run = recorded(AXIS, both_ways, seconds=5.0)
    with pytest.raises(InputError, match="cutoff is 600 Hz.*between 0 and 500"):
        identify_one_inertia([run], 3.5, options=InverseOptions(cutoff=600.0))
    with pytest.raises(InputError, match="too few for cutoff"):
        identify_one_inertia([run.part(0, 100)], 3.5)
    backwards = Recording(t=run.t, u=-run.u, theta_u=run.theta_u)
    with pytest.raises(InputError, match="the estimates make no rig.*u=COLUMN:-1"):
        _ = identify_one_inertia([backwards], 3.5).rig


@pytest.fixture
def invoke():
    app = typer.Typer()
    register(app)

    def call(*args):
        return CliRunner().invoke(app, [str(a) for a in args])

    return call


@pytest.fixture
def files(tmp_path):
    paths = []
    for name, phase in (("a", 0.0), ("b", 1.0), ("c", 2.0)):
        run = recorded(AXIS, lambda t, p=phase: both_ways(t + p), seconds=8.0)
        paths.append(tmp_path / f"{name}.csv")
        columns = {"t": run.t, "u": run.u, "pos": run.theta_u, "km": 3.5}
        pd.DataFrame(columns).to_csv(paths[-1], index=False)
    return paths


def test_identify_command_prints_one_document_and_writes_the_rig(invoke, files, tmp_path):
    out = tmp_path / "rig.toml"
    result = invoke(
        "identify", files[0], "--one-inertia", "--gain-column", "km", "--map", "theta_u=pos",
        "--holdout", files[1], files[2], "--asymmetric", "--out", out, "--json",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert list(document["fit_errors"]) == [str(files[0])]
    assert list(document["holdout_errors"]) == [str(files[1]), str(files[2])]
    assert load_rig(out).inertias == 1
    assert load_rig(out).Ju == document["rig"]["Ju"] == document["estimates"]["M"]


def test_identify_command_says_what_it_cannot_do(invoke, files):
    for args, message in [
        ((files[0], "--one-inertia", "--map", "theta_u=pos"), "shows only ratios"),
        ((files[0], "--one-inertia", "--gain", "3"), "no column theta_u; found: t, u, pos, km"),
    ]:
        error = invoke("identify", *args).exception
        assert isinstance(error, InputError)
        assert message in str(error)
