"""Velocities in place of angles and a torque in place of the voltage, from file to diagnosis.

Where parameters are recovered the recordings come from `benchmarks/rig_maker.py`, which shares no
equation and no integrator with the package.
"""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from benchmarks.rig_maker import make, quasi_random
from drill_env import InputError, Rig
from drill_env.cli.main import obey
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.offered import offered_effects
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.identification.estimate import identify
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import path_of, value_of
from drill_env.identification.replay import replay
from drill_env.identification.samples import prepare
from drill_env.identification.screening import findings
from drill_env.identification.smoothing import slopes_of, smoothed
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording, RecordingWarning, parse_map, read_folder, read_recording
from tests.made_recordings import played as run_played

STEP, RATE = 2.0 * math.pi / 8192, 200.0
NOISE = NoiseModel(torque_u=0.05, torque_l=5e-3, speed_u=0.03, speed_l=0.04)
SPEEDS, MIXED = ("omega_u", "omega_l"), ("omega_u", "theta_l")


def read(names, t, u, angles, speeds, *, km=None, sigma=0.02, seed=0):
    """What sensors of these channels make of a motion; driven by a torque where km is given."""
    rng = np.random.default_rng([seed, 7])
    channels, quanta = {}, {}
    for disc, letter in enumerate("ul"):
        if f"theta_{letter}" in names:
            channels[f"theta_{letter}"] = np.round(angles[:, disc] / STEP) * STEP
            quanta[f"theta_{letter}"] = STEP
        if f"omega_{letter}" in names:
            noise = rng.normal(0.0, sigma, len(t))
            channels[f"omega_{letter}"] = speeds[:, disc] + noise
    drive = {} if km is None else {"drive": "torque"}
    return Recording(
        t, u * (km or 1.0), quanta=quanta, source=f"run-{seed}", **drive, **channels
    )  # fmt: skip


def record(names, seed, seconds=40.0, *, km=None, sigma=0.02, rig=None, limit=5.0, **noise):
    """A quasi-random run of the other simulator."""
    values = {name: getattr(rig or Rig(), name) for name in SYMBOLS}
    u = quasi_random(np.random.default_rng(seed), seconds, RATE, limit)
    made = make(values, u, RATE, seed=seed, **noise)
    angles, speeds = made.truth[:, [0, 2]], made.truth[:, [1, 3]]
    return read(names, made.t, made.u, angles, speeds, km=km, sigma=sigma, seed=seed)


def off(rig, seed, free):
    rng = np.random.default_rng(seed)
    return rig.replace(**{name: getattr(rig, name) * rng.uniform(0.7, 1.3) for name in free})


@pytest.mark.parametrize(
    ("names", "torque", "sigma"),
    [(SPEEDS, False, 0.2), (MIXED, False, 0.02), (SPEEDS, True, 0.02)],
)
def test_parameters_are_found_from_thirty_percent_off(names, torque, sigma):
    truth, given = Rig(), "km" if torque else "Ju"
    runs = [
        record(names, k, km=truth.km if torque else None, sigma=sigma, torque_u=0.02, torque_l=2e-4)
        for k in (1, 2)
    ]
    free = tuple(name for name in SYMBOLS if name != given)
    fixed = {} if torque else {"Ju": truth.Ju}
    found = identify(runs, off(truth, 0, free), fixed=fixed)
    assert found.converged and found.free == free
    assert found.rig.km == 1.0 if torque else found.rig.Ju == truth.Ju
    sizes = np.sqrt(np.diag(found.covariance))
    misses = np.array([getattr(found.rig, n) - getattr(truth, n) for n in free]) / sizes
    assert np.abs(misses).max() < 4.0 and np.mean(np.abs(misses) < 1.96) > 0.7
    for name in {"km", "Ju", "bu", "ktheta", "Jl"} & set(free):
        assert abs(getattr(found.rig, name) / getattr(truth, name) - 1.0) < 0.01
    assert found.noise[0].speed_u == pytest.approx(sigma, rel=0.05)


def test_a_run_that_begins_in_motion_tells_its_own_twist():
    whole = record(SPEEDS, 3, 20.0)
    begin = 1510
    truth = make(
        {n: getattr(Rig(), n) for n in SYMBOLS},
        quasi_random(np.random.default_rng(3), 20.0, RATE, 5.0), RATE, seed=3,
    ).truth  # fmt: skip
    twist = truth[begin, 0] - truth[begin, 2]
    assert abs(twist) > 0.5
    found = identify([whole.part(begin, len(whole))], Rig(), free=["km"], fixed={"Ju": Rig().Ju})
    start = found.point.starts[0][0]
    assert start[0] + start[4] == pytest.approx(twist, abs=0.05)


@pytest.fixture(scope="module")
def samples():
    run = record(("theta_u", *SPEEDS), 5, 12.0, torque_u=0.02, torque_l=2e-4, limit=4.0)
    return prepare(run, Rig())


def log_likelihood(samples, loads=0.0, readings=0.0):
    moved = replace(samples, loads=samples.loads + loads, angles=samples.angles - readings)
    return -0.5 * value_of(moved, Rig(), NOISE, samples.starts)


def test_the_backward_pass_is_the_slope_of_the_likelihood(samples):
    path = path_of(samples, Rig(), NOISE, samples.starts)
    smooth = smoothed(samples, NOISE, path)
    for row, column in ((900, 0), (1500, 2), (1700, 3)):
        error = np.zeros_like(samples.angles)
        error[row, column] = 1e-5
        slope = log_likelihood(samples, 0.0, error) - log_likelihood(samples, 0.0, -error)
        assert smooth.misread[row, column] == pytest.approx(slope / 2e-5, rel=0.02, abs=1.0)
    rng = np.random.default_rng(0)
    loads, errors = (rng.normal(size=(len(samples.t), 2, 3)) for _ in range(2))
    columns = slopes_of(samples, NOISE, path, loads, errors)
    forward = np.einsum("ke,kec->c", path.rows["white"], columns)
    backward = np.einsum("ke,kec->c", smooth.pull, loads)
    backward += np.einsum("ke,kec->c", smooth.misread, samples.misread(errors))
    np.testing.assert_allclose(forward, backward, rtol=1e-9)


def test_velocities_that_are_all_missing_change_nothing():
    angles = record(("theta_u", "theta_l"), 6, 8.0)
    nothing = np.full(len(angles), math.nan)
    nothing[-1] = 0.0
    both = prepare(replace(angles, omega_u=nothing), Rig())
    both.angles[-1, 2] = math.nan
    plain = prepare(angles, Rig())
    values = [value_of(s, Rig(), NOISE, plain.starts) for s in (plain, both)]
    # Each kind of recording has its own compiled filter, with its own rounding.
    assert values[0] == pytest.approx(values[1], rel=1e-12)


def played(effects, names, count=3, *, km=None, sigma=0.02):
    rig = Rig().replace(bu=2.03, ktheta=0.0765, Tsl=0.0096, effects=effects)
    runs = []
    for seed in range(count):
        u = quasi_random(np.random.default_rng([seed, 1]), 20.0, RATE, 5.0)
        t = np.arange(len(u)) / RATE
        state, angles = run_played(rig, t, u, np.zeros(4))
        runs.append(read(names, t, u, angles, state[:, 1:3], km=km, sigma=sigma, seed=seed))
    return runs


def few(*kept):
    """A library that is scored fast."""
    return tuple(sorted(set(LIBRARY) - {*kept, "string_hardening", "unbalance", "lower_asymmetry"}))


@pytest.mark.parametrize(
    ("effect", "names", "km"),
    [
        ({"id": "string_damping", "damping": 0.003}, SPEEDS, None),
        ({"id": "lower_asymmetry", "asymmetry": 0.01}, MIXED, Rig().km),
    ],
)
def test_a_concealed_effect_is_named(effect, names, km):
    *fit, held = played((effect,), names, km=km)
    options = DiagnosisOptions(most=1, leave_out=few("string_damping"))
    result = diagnose(fit, Rig(), [held], options=options).result
    assert [e.id for e in result.effects] == [effect["id"]]
    (number,) = result.effects[0].parameters.values()
    size = next(value for key, value in effect.items() if key != "id")
    assert number.low < size < number.high
    assert set(result.fit["holdout"]) == {*names, "log_likelihood"}
    errors = result.fit["five_second_prediction"][names[1]]
    assert errors["after_rms"] < 0.5 * errors["before_rms"]


def test_nothing_before_a_measured_torque_is_offered():
    """An amplifier's limits are in the torque that was read; its ripple over the angle is not."""
    asked = {effect.id for effect in offered_effects(Rig(), ("km",), amplifier=False)}
    assert not asked & {"current_limit", "input_delay", "supply_sag", "amplifier_saturation"}
    assert {"torque_ripple", "commutation_ripple", "gear_compliance", "unbalance"} <= asked
    every = {effect.id for effect in offered_effects(Rig(), ("km",))}
    assert {"current_limit", "input_delay", "supply_sag", "amplifier_saturation"} <= every


def test_nothing_is_missing_from_a_rig_driven_by_a_torque():
    *fit, held = played((), SPEEDS, km=Rig().km)
    result = diagnose(fit, Rig(), [held]).result
    assert result.verdict == "consistent" and result.effects == []
    change = result.parameters_changed["Ju"]
    assert "km" not in result.parameters_changed and change.low < Rig().Ju < change.high
    assert result.noise["speed_l"] == pytest.approx(0.02, rel=0.05)


@pytest.fixture
def folder(tmp_path):
    """Two runs with other names and units than the package's, and their manifest."""
    for seed, name in enumerate(("fit.csv", "hold.csv")):
        run = record(MIXED, seed, 20.0, km=Rig().km)
        table = {
            "ms": 1e3 * run.t, "mNm": 1e3 * run.u, "top": run.omega_u * 30.0 / math.pi,
            "bit": np.round(run.theta_l / STEP).astype(int), "u": 0.0 * run.t,
        }  # fmt: skip
        pd.DataFrame(table).to_csv(tmp_path / name, index=False)
    (tmp_path / "recordings.toml").write_text(MANIFEST)
    return tmp_path


MANIFEST = """
[defaults]
columns = { t = "ms", torque = "mNm", omega_u = "top", theta_l = "bit" }
units = { t = "ms", torque = "mNm", omega_u = "rpm", theta_l = "counts" }
counts_per_rev = 8192
[[recording]]
file = "fit.csv"
[[recording]]
file = "hold.csv"
role = "holdout"
"""
MAP = ["t=ms:ms", "torque=mNm:mNm", "omega_u=top:rpm", "theta_l=bit:counts/8192"]


def test_manifest_and_map_read_the_same(folder):
    truth = record(MIXED, 0, 20.0, km=Rig().km)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        listed = read_folder(folder).fit[0]
        mapped = read_recording(folder / "fit.csv", parse_map(MAP), need=("u",))
    for found in (listed, mapped):
        assert found.drive == "torque" and set(found.readings()) == set(MIXED)
        for name, values in truth.channels().items():
            np.testing.assert_allclose(found.channel(name), values, atol=1e-9)


def test_a_velocity_beside_an_angle_is_taken_where_it_is_named(tmp_path):
    run = record(("theta_u", "theta_l", *SPEEDS), 1, 5.0)
    table = {**run.channels(), "torque": run.u}
    pd.DataFrame(table).to_csv(tmp_path / "all.csv", index=False)
    # What stands beside angles under these names is often computed from them.
    with pytest.warns(RecordingWarning, match="holds both u and torque"):
        found = read_recording(tmp_path / "all.csv")
    assert set(found.readings()) == {"theta_u", "theta_l"} and found.drive == "voltage"
    found = read_recording(tmp_path / "all.csv", parse_map(["omega_l=omega_l", "torque=torque"]))
    assert set(found.readings()) == {"theta_u", "theta_l", "omega_l"} and found.drive == "torque"
    pd.DataFrame(table)[["t", "torque", *SPEEDS]].to_csv(tmp_path / "few.csv", index=False)
    found = read_recording(tmp_path / "few.csv", need=("u",))
    assert set(found.readings()) == set(SPEEDS) and found.drive == "torque"


def test_the_commands_take_the_folder(folder, capsys, monkeypatch):
    def ran(*words):
        monkeypatch.setattr("sys.argv", ["drill-env", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            obey()
        assert ended.value.code in (0, None)
        return json.loads(capsys.readouterr().out)

    found = ran("identify", folder, "--free", "Ju,bu", "--report", folder / "r", "--json")
    assert found["rig"]["km"] == 1.0
    assert found["rig"]["Ju"] == pytest.approx(Rig().Ju, rel=0.01)
    assert set(found["holdout"][0]["errors"]) == set(MIXED)
    maps = [word for entry in MAP for word in ("--map", entry)]
    shown = ran("replay", folder / "hold.csv", *maps, "--out", folder / "r.png", "--json")
    assert shown["errors"]["omega_u"]["rms"] < 0.03 and (folder / "r.png").is_file()


def test_screening_names_the_velocity():
    run = record(SPEEDS, 2, 30.0)
    assert findings(run) == ()
    (wrong,) = findings(replace(run, omega_l=run.channel("omega_l") * 180.0 / math.pi))
    assert wrong.code == "encoder_units" and "--map omega_l=omega_l:deg/s" in str(wrong)
    (swapped,) = findings(replace(run, omega_u=run.omega_l, omega_l=run.omega_u))
    assert swapped.code == "swapped_encoders"


def test_replay_of_a_torque_takes_km_as_one():
    run = record(("theta_u", "theta_l"), 4, 10.0, km=Rig().km)
    assert replay(run, Rig()).errors["theta_u"].rms < STEP


@pytest.mark.parametrize(
    ("maps", "named"),
    [
        (["u=mNm", "torque=mNm"], "u and torque are both mapped"),
        (["torque=mNm:V"], "unknown unit 'V'; known: Nm"),
        (["torque=mNm:mNm", "omega_u=top:rad"], "unknown unit 'rad'; known: rad/s"),
        (["torque=mNm:mNm", "omega_u=top_rpm"], "named as if in rpm.*omega_u=top_rpm:rpm"),
    ],
)
def test_bad_maps_are_named(folder, maps, named):
    table = pd.read_csv(folder / "fit.csv")
    table["top_rpm"] = table["top"]
    table.to_csv(folder / "fit.csv", index=False)
    with pytest.raises(InputError, match=named):
        read_recording(folder / "fit.csv", parse_map(["t=ms:ms", *maps]))


@pytest.mark.parametrize(
    ("manifest", "named"),
    [
        (
            MANIFEST.replace('"rpm"', '"counts"'),
            "unknown unit 'counts' of omega_u; known: rad/s.*counts/s",
        ),
        (MANIFEST.replace('"rpm"', '"counts/s"').replace("counts_per_rev = 8192", ""), "counts/s"),
        (
            '[[recording]]\nfile = "fit.csv"\ncolumns = { t = "ms", torque = "mNm" }\n'
            'units = { t = "ms" }',
            "neither theta_u nor theta_l, nor a velocity omega_u or omega_l",
        ),
    ],
)
def test_bad_manifests_are_named(folder, manifest, named):
    (folder / "recordings.toml").write_text(manifest)
    with pytest.raises(InputError, match=named):
        read_folder(folder)


@pytest.mark.parametrize("start", [identify, diagnose])
def test_drives_do_not_mix_and_km_is_known(start):
    torque, voltage = record(SPEEDS, 0, 5.0, km=3.0), record(SPEEDS, 1, 5.0)
    with pytest.raises(InputError, match="run-1 is driven by a voltage and run-0 by a torque"):
        start([torque, voltage], Rig())
    fixed = {"km": 2.0}
    given = {"fixed": fixed} if start is identify else {"options": DiagnosisOptions(fixed=fixed)}
    with pytest.raises(InputError, match="km is 1"):
        start([torque], Rig(), **given)
