"""Replay: a rig's own recording leaves nothing, another rig's leaves what it should."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import typer
from typer.testing import CliRunner

from drill_env import InputError, Rig, save_rig
from drill_env.cli.recording_commands import register
from drill_env.identification.initial_state import local_fit
from drill_env.identification.replay import replay
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording, read_recording
from drill_env.report.replay_picture import save_replay_picture

PRACTICE = Path(__file__).resolve().parents[2] / "shared" / "recordings" / "practice"
needs_practice = pytest.mark.skipif(
    not PRACTICE.is_dir(), reason="no practice recordings beside the checkout"
)
STEP = 2 * np.pi / 8192


def random_voltage(t):
    return 2.0 * np.sin(0.6 * t) + 1.5 * np.sin(1.7 * t + 1) + np.sin(4.3 * t + 2)


def recorded(rig, seconds=30.0, rate=200.0, start=None, volts=random_voltage):
    t = np.arange(round(seconds * rate)) / rate
    u = volts(t)
    run = simulate(rig, sampled_voltage(t, u), seconds, t_eval=t, initial=start)
    return Recording(t=t + 7.0, u=u, theta_u=run.theta_u, theta_l=run.theta_l)


@pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")
@pytest.mark.parametrize("volts", [random_voltage, lambda t: np.full_like(t, 3.5)])
def test_a_rig_explains_its_own_recording(volts):
    """From rest, of which the recording says nothing but its angles."""
    result = replay(recorded(Rig.paper(), volts=volts), Rig.paper())
    for error in result.errors.values():
        assert error.max < 1e-6
    for error in result.prediction_errors.values():
        assert error.rms < 2e-3


def test_a_moving_start_is_measured_from_the_first_samples():
    start = np.array([2.0, 1.5, -3.0, 0.7])
    recording = recorded(Rig.paper(), start=start)
    result = replay(recording, Rig.paper())
    np.testing.assert_allclose(result.initial, start, atol=5e-3)
    exact = replay(recording, Rig.paper(), initial=start)
    assert max(e.max for e in exact.errors.values()) < 1e-8


def test_one_inertia_replays_by_its_upper_disc():
    rig = Rig.one_inertia(km=3.5, Ju=0.45, Tsu=0.32, bu=1.9)
    result = replay(recorded(rig), rig)
    assert list(result.errors) == ["theta_u"]
    assert result.errors["theta_u"].max < 1e-6
    assert result.force_error is not None
    assert result.force_error < 0.03


def test_error_grows_with_the_rig_s_error():
    recording = recorded(Rig.paper())
    errors = [
        replay(recording, Rig.paper().replace(bu=1.9833 * scale)).errors["theta_u"].percent
        for scale in (1.0, 1.01, 1.05)
    ]
    assert errors[0] < 1e-4 < errors[1] < errors[2]


def test_velocity_fit_balances_noise_and_curvature():
    """About the best that a fixed window could do, without knowing which."""
    t = np.arange(4000) / 200
    for frequency in (0.2, 2.0, 10.0):
        theta = np.sin(frequency * t)
        for grid in (STEP, 1e-6):
            counted = np.round(theta / grid) * grid
            found = [local_fit(t, counted, row, grid)[1] for row in range(300, 3700, 40)]
            truth = frequency * np.cos(frequency * t[300:3700:40])
            margin = 0.03 if grid == STEP else 2e-3
            assert np.sqrt(np.mean((found - truth) ** 2)) < margin * max(1.0, frequency)


def test_what_is_hidden_or_offset_is_said():
    recording = recorded(Rig.paper())
    surface = Recording(t=recording.t, u=recording.u, theta_u=recording.theta_u)
    result = replay(surface, Rig.paper())
    assert [n.code for n in result.notes] == ["hidden_state"]
    assert dict(result.prediction_errors) == {}
    shifted = Recording(
        t=recording.t, u=recording.u, theta_u=recording.theta_u + 2 * np.pi,
        theta_l=recording.theta_l,
    )  # fmt: skip
    assert [n.code for n in replay(shifted, Rig.paper()).notes] == ["twist_offset"]
    with pytest.raises(InputError, match="no column u"):
        replay(Recording(t=recording.t, theta_l=recording.theta_l), Rig.paper())
    with pytest.raises(InputError, match="horizon"):
        replay(recording, Rig.paper(), horizon=0.0)


@needs_practice
@pytest.mark.filterwarnings("ignore::drill_env.recordings.RecordingWarning")
def test_practice_sets_replay_as_their_answers_say():
    """Another maker's simulator: its own rig explains it, ours a few % off does not."""
    answers = json.loads((PRACTICE / "answers.json").read_text())["practice-1"]["rig"]
    names = {"kth": "ktheta", "b1": "beta1", "b2": "beta2"}
    true = Rig(**{names.get(k, k): v for k, v in answers.items()})
    for path in sorted((PRACTICE / "practice-1").glob("*.csv.gz")):
        recording = read_recording(path)
        own, ours = replay(recording, true), replay(recording, Rig.paper())
        for name in ("theta_u", "theta_l"):
            assert own.errors[name].percent < 0.1
            assert own.prediction_errors[name].rms < 0.02
            assert 1.0 < ours.errors[name].percent < 20.0
            assert own.errors[name].rms < 0.05 * ours.errors[name].rms
        assert own.notes == ()


@pytest.fixture
def invoke():
    app = typer.Typer()
    register(app)

    def call(*args):
        return CliRunner().invoke(app, [str(a) for a in args])

    return call


def test_replay_command(invoke, tmp_path):
    recording, rig = recorded(Rig.paper(), seconds=8.0), tmp_path / "rig.toml"
    save_rig(Rig.paper().replace(km=3.6), rig)
    path, picture = tmp_path / "run.csv", tmp_path / "run.png"
    columns = {"time": recording.t, "u": 1e3 * recording.u, "theta_u": recording.theta_u}
    pd.DataFrame({**columns, "theta_l": recording.theta_l}).to_csv(path, index=False)
    args = ("replay", path, "--rig", rig, "--map", "t=time", "--map", "u=u:mV", "--out", picture)
    result = invoke(*args, "--json")
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    direct = replay(recording, Rig.paper().replace(km=3.6))
    assert document["errors"]["theta_l"]["rms"] == pytest.approx(direct.errors["theta_l"].rms)
    assert document["prediction"]["horizon_s"] == 5.0
    assert picture.read_bytes().startswith(b"\x89PNG")
    shown = invoke(*args)
    assert shown.exit_code == 0
    assert "theta_l, free run" in shown.stdout


def test_warnings_go_to_stderr_and_not_into_the_document(invoke, tmp_path):
    recording = recorded(Rig.paper(), seconds=8.0, volts=lambda t: np.full_like(t, 3.5))
    path = tmp_path / "run.csv"
    columns = {"t": recording.t, "u": recording.u, "theta_u": recording.theta_u}
    pd.DataFrame({**columns, "theta_l": recording.theta_l}).to_csv(path, index=False)
    result = invoke("replay", path, "--json")
    assert [n["code"] for n in json.loads(result.stdout)["notes"]] == ["constant"]
    assert "warning: " in result.stderr
    assert "u is constant at 3.5 V" in result.stderr


def test_pictures_of_unknown_kind_are_refused(tmp_path):
    result = replay(recorded(Rig.paper(), seconds=4.0), Rig.paper())
    with pytest.raises(InputError, match="unknown kind; end the name in .png"):
        save_replay_picture(result, tmp_path / "run.docx")
    assert list(tmp_path.iterdir()) == []
