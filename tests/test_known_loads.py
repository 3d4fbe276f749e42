"""Loads that were measured beside the drive act on the rig, and are no missing physics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env._errors import InputError
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.diagnose import _scale, diagnose
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.identification.closed_loop import simulate_closed_loop
from drill_env.identification.known_loads import loaded, mean_loads
from drill_env.identification.noise import NoiseModel
from drill_env.identification.one_inertia import identify_one_inertia
from drill_env.identification.position_law import PositionLaw
from drill_env.identification.prediction_error import path_of
from drill_env.identification.replay import replay
from drill_env.identification.samples import prepare
from drill_env.identification.smoothing import smoothed
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording, RecordingWarning, parse_map, read_recording

RATE = 200.0
AXIS = Rig.one_inertia(km=0.5, Ju=0.02, Tsu=0.0, bu=0.05)


def shaken(t):
    """A load that is no function of the motion or the drive."""
    return 0.3 * np.sin(1.9 * t) + 0.2 * np.sin(5.3 * t + 1.0)


def turned(seconds, coulomb=0.0, drive=0.8, phase=0.0):
    """An axis under drive and load, by SciPy alone; friction's sign is steep where it turns."""
    t = np.arange(int(seconds * RATE)) / RATE
    u = drive * np.sin(1.1 * t + phase) + drive * np.sin(3.7 * t)
    load = shaken(t + phase)

    def rates(now, state):
        row = min(int(now * RATE + 1e-9), len(t) - 1)
        torque = AXIS.km * u[row] + np.interp(now, t, load) - AXIS.bu * state[1]
        return [state[1], (torque - coulomb * math.tanh(state[1] / 1e-3)) / AXIS.Ju]

    run = solve_ivp(
        rates, (0.0, t[-1]), [0.0, 0.0], t_eval=t, max_step=1.0 / RATE, rtol=1e-8, atol=1e-10,
        method="LSODA",
    )  # fmt: skip
    return Recording(t, u, run.y[0], load_u=load, source="axis")


def test_a_replay_knows_the_load():
    run = turned(10.0)
    assert replay(run, AXIS).errors["theta_u"].rms < 1e-4
    without = replay(replace(run, load_u=None), AXIS)
    assert without.errors["theta_u"].rms > 0.1


def test_the_torque_balance_of_an_axis_holds_the_load():
    run = turned(30.0)
    found = identify_one_inertia([run], AXIS.km).rig
    assert found.Ju == pytest.approx(AXIS.Ju, rel=0.02)
    assert found.bu == pytest.approx(AXIS.bu, rel=0.02)
    without = identify_one_inertia([replace(run, load_u=None)], AXIS.km).rig
    assert abs(without.bu / AXIS.bu - 1.0) > 0.1


def test_a_measured_load_is_nothing_that_is_missing_and_hides_nothing():
    options = DiagnosisOptions(given_rig=True, most=1, leave_out=("gear_backlash",))
    plain = [turned(15.0, phase=p) for p in (0.0, 2.0)]
    noise = np.random.default_rng(5)
    plain = [
        replace(r, theta_u=r.theta_u + noise.normal(0.0, 1e-3, len(r))) for r in plain
    ]  # fmt: skip
    told = diagnose(plain[:1], AXIS, plain[1:], options=options).result
    assert not told.effects and told.verdict in ("consistent", "parameters")
    rough = [turned(15.0, coulomb=0.12, phase=p) for p in (0.0, 2.0)]
    told = diagnose(rough[:1], AXIS, rough[1:], options=options).result
    assert [e.id for e in told.effects] == ["upper_coulomb"]
    assert told.effects[0].parameters["torque"].value == pytest.approx(0.12, rel=0.05)


@pytest.mark.parametrize(("name", "size"), [("load_u", 3.0), ("load_l", 0.05)])
def test_the_filter_takes_a_load_for_known(name, size):
    rig = Rig.paper().replace(friction="coulomb", Tsl=0.02)
    t = np.arange(int(20 * RATE)) / RATE
    known = Recording(t, np.full(len(t), 3.0), source="rig", **{name: size * shaken(t)})
    run = simulate(loaded(rig, known), sampled_voltage(t, known.u), float(t[-1]), t_eval=t)
    made = replace(known, theta_u=run.theta_u, theta_l=run.theta_l)
    noise = NoiseModel(1.0, 0.05, 0.5, 0.5, 1e-4, 1e-4)

    def latent(recording):
        samples = prepare(recording, rig)
        return smoothed(samples, noise, path_of(samples, rig, noise, samples.starts)).states[:, 4:]

    place = ("load_u", "load_l").index(name)
    load = mean_loads(made)[:, place]
    with_it, without = latent(made), latent(replace(made, **{name: None}))
    later = t > 2.0
    assert np.sqrt(np.mean(with_it[later] ** 2)) < 0.05 * load.std()
    assert np.corrcoef(without[later, place], load[later])[0, 1] > 0.9


def test_a_measured_load_tells_the_scale_of_torque():
    """A voltage alone leaves it open, so that Ju has to be held."""
    rig, step = Rig.paper(), 2.0 * math.pi / 8192
    given = rig.replace(Ju=1.04 * rig.Ju, km=0.97 * rig.km)
    t, samples = np.arange(int(30 * RATE)) / RATE, []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        u = 3.0 + 1.5 * quasi_random(rng, 30.0, RATE, 2.0)
        loads = {"load_u": 1.5 * shaken(t + seed), "load_l": 0.03 * shaken(t - seed)}
        known = Recording(t, u, source="rig", **loads)
        run = simulate(loaded(rig, known), sampled_voltage(t, u), float(t[-1]), t_eval=t)
        read = step * np.round((run.readings + rng.normal(0.0, 4e-4, run.readings.shape)) / step)
        read = replace(known, theta_u=read[:, 0], theta_l=read[:, 1])
        samples.append(prepare(replace(read, quanta={"theta_u": step, "theta_l": step}), given))
    assert "Ju" not in free_parameters(given)
    found = base_fit(samples, given, free_parameters(given, scale=_scale(samples, {})))[1].rig
    assert found.Ju == pytest.approx(rig.Ju, rel=1e-3)
    assert found.km == pytest.approx(rig.km, rel=1e-3)


def test_loads_are_read_with_their_units_and_delays(tmp_path):
    path = tmp_path / "run.csv"
    t = np.arange(50) / 100.0
    rows = np.column_stack([t, np.ones(50), 0.1 * t, 1000.0 * t])
    np.savetxt(path, rows, delimiter=",", header="t,u,theta_u,cell", comments="")
    mapped = parse_map(["load_u=cell:mNm", "load_l=0.25"])
    found = read_recording(path, mapped)
    assert np.allclose(found.load_u, t) and np.allclose(found.load_l, 0.25)
    with pytest.warns(RecordingWarning, match="a load is not known in 6 rows; left out"):
        late = read_recording(path, parse_map(["load_u=cell:mNm@0.055"]))
    # What stands at 0.455 s was so 0.055 s before; in between it is straight.
    assert np.interp(0.3, late.t, late.load_u) == pytest.approx(0.355)


def test_a_closed_loop_with_a_load_is_refused():
    law = PositionLaw(1.0, 1.0, "goal")
    with pytest.raises(InputError, match="measured load"):
        simulate_closed_loop(turned(2.0), AXIS, law)
