"""A motor whose bridge is off coasts: no current drives it, and none brakes it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.rig_maker import quasi_random
from drill_env import Rig
from drill_env._errors import InputError
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.identification.coasting import left_out_of_search
from drill_env.identification.estimate import identify
from drill_env.identification.one_inertia import identify_one_inertia
from drill_env.identification.replay import replay
from drill_env.identification.samples import prepare
from drill_env.recordings import (
    Recording,
    RecordingWarning,
    parse_map,
    read_folder,
    read_recording,
)

RATE = 200.0
AXIS = Rig.one_inertia(km=0.5, Ju=0.02, Tsu=0.0, bu=0.05)
KE, RIG_KE = 0.06, 0.3
RIG = Rig.paper().replace(friction="coulomb", Tsl=0.01)
STEP = 2.0 * math.pi / 65536


def coasting(ke):
    return {"id": "coasting", "back_emf": ke}


def switched(rng, rows):
    """A bridge that is off for a third of the time, in stretches of half a second and more."""
    return np.repeat((rng.random(rows // 100 + 1) > 0.35).astype(float), 100)[:rows]


@cache
def axis_run(seed, seconds=10.0):
    """An axis that drives, brakes at 0 V and coasts, by SciPy from the formulas."""
    rng, t = np.random.default_rng(seed), np.arange(int(seconds * RATE)) / RATE
    u, bridge = 1.5 * quasi_random(rng, seconds, RATE, 2.0), switched(rng, len(t))
    u[::7] = 0.0

    def rates(now, y):
        row = min(int(now * RATE + 1e-9), len(t) - 1)
        current = u[row] - KE * y[1] if bridge[row] else 0.0
        return [y[1], (AXIS.km * current - (AXIS.bu - AXIS.km * KE) * y[1]) / AXIS.Ju]

    theta = solved(rates, t, 2)[0]
    return Recording(t, u, theta, bridge=bridge, source=f"axis {seed}")


@cache
def rig_run(seed, seconds=20.0):
    rng, t = np.random.default_rng(seed), np.arange(int(seconds * RATE)) / RATE
    u, bridge = 5.0 + 1.2 * quasi_random(rng, seconds, RATE, 2.0), switched(rng, len(t))
    bridge[:100], p = 1.0, RIG

    def rates(now, y):
        row = min(int(now * RATE + 1e-9), len(t) - 1)
        current = u[row] - RIG_KE * y[2] if bridge[row] else 0.0
        twist = p.ktheta * (y[0] - y[1])
        held = (p.Tsu + p.dTsu) * np.tanh(y[2] / 1e-4)
        above = p.km * current - twist - (p.bu + p.dbu - p.km * RIG_KE) * y[2] - held
        below = twist - p.bl * y[3] - p.Tsl * np.tanh(y[3] / 1e-4)
        return [y[2], y[3], above / p.Ju, below / p.Jl]

    y = solved(rates, t, 4)
    return Recording(t, u, y[0], y[1], bridge=bridge, source=f"rig {seed}")


def solved(rates, t, states):
    run = solve_ivp(
        rates, (0.0, t[-1]), np.zeros(states), t_eval=t, max_step=1.0 / RATE, rtol=1e-9,
        atol=1e-11, method="LSODA",
    )  # fmt: skip
    return run.y


def read(recording, seed=0):
    """As encoders read it."""
    noise = np.random.default_rng(seed).normal(0.0, 2e-4, (2, len(recording)))
    angles = {
        name: STEP * np.round((angle + n) / STEP)
        for (name, angle), n in zip(recording.angles().items(), noise, strict=False)
    }
    return replace(recording, **angles, quanta=dict.fromkeys(angles, STEP))


def off(recording, rig):
    """Largest error of a replay from rest, rad."""
    found = replay(recording, rig, initial=np.zeros(4))
    return max(e.rms for e in found.errors.values()), [note.code for note in found.notes]


@pytest.mark.parametrize(
    ("run", "rig", "ke", "least"), [(axis_run, AXIS, KE, 1e-5), (rig_run, RIG, RIG_KE, 1e-3)]
)
def test_a_replay_coasts_where_the_bridge_is_off(run, rig, ke, least):
    error, notes = off(run(1), rig.replace(effects=(coasting(ke),)))
    assert error < least and "coasting" not in notes
    error, notes = off(replace(run(1), effects=(coasting(ke),)), rig)
    assert error < least and "coasting" not in notes
    error, notes = off(run(1), rig)
    assert error > 1.0 and "coasting" in notes


def test_identify_takes_the_stated_back_emf_for_known():
    given = AXIS.replace(km=0.97 * AXIS.km, bu=1.04 * AXIS.bu)
    fixed = {"Tsu": 0.0, "dTsu": 0.0, "dbu": 0.0, "Ju": AXIS.Ju}
    runs = [read(axis_run(n)) for n in (1, 2)]
    told = [replace(run, effects=(coasting(KE),)) for run in runs]
    found = identify(told, given, fixed=fixed).rig
    assert found.km == pytest.approx(AXIS.km, rel=1e-3)
    assert found.bu == pytest.approx(AXIS.bu, rel=1e-3)
    balance = identify_one_inertia(told, AXIS.km).estimates
    assert balance["M"] == pytest.approx(AXIS.Ju, rel=0.03)
    assert balance["Fv"] == pytest.approx(AXIS.bu, rel=0.03)
    for call in (lambda: identify(runs, given), lambda: identify_one_inertia(runs, AXIS.km)):
        with pytest.raises(InputError, match="axis 1: the bridge is off"):
            call()


def test_diagnose_of_an_axis_finds_the_back_emf_that_nobody_stated():
    given = AXIS.replace(km=0.98 * AXIS.km, bu=1.02 * AXIS.bu)
    runs = [read(axis_run(n), n) for n in (1, 2, 3, 4)]
    options = DiagnosisOptions(given_rig=True, most=1, leave_out=("gear_backlash",))
    found = diagnose(runs[:2], given, runs[2:], options=options).result
    assert [e.id for e in found.effects] == ["coasting"]
    ke = found.effects[0].parameters["back_emf"]
    assert ke.low < KE < ke.high and ke.high - ke.low < 0.2 * KE


def test_diagnose_of_a_rig_corrects_the_back_emf_of_its_file():
    given = RIG.replace(km=0.97 * RIG.km, effects=(coasting(0.93 * RIG_KE),))
    samples = [prepare(read(rig_run(n)), given) for n in (1, 2)]
    found = base_fit(samples, given, free_parameters(given))[1].rig
    assert found.km == pytest.approx(RIG.km, rel=2e-3)
    assert found.effects[0]["back_emf"] == pytest.approx(RIG_KE, rel=5e-3)


def test_a_bridge_is_read_and_off_is_another_thing_than_zero_volts(tmp_path):
    t = np.arange(50) / 100.0
    rows = np.column_stack([t, np.where(t < 0.2, 1.0, 0.0), 0.1 * t, t < 0.3])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header="t,u,theta_u,bridge", comments="")
    found = read_recording(tmp_path / "a.csv")
    assert found.coasts() and (found.u[t < 0.2] == 1.0).all()
    assert (0.0 < found.u[(t >= 0.2) & (t < 0.3)]).all() and (found.u[t >= 0.3] == 0.0).all()
    assert found.part(0, 30).coasts() is False
    free = read_recording(tmp_path / "a.csv", parse_map(["u=0", "bridge=0"]))
    assert (free.u == 0.0).all() and free.coasts()


def test_a_row_within_which_the_bridge_is_switched_is_left_out(tmp_path):
    t, clock = np.arange(50) / 100.0, np.arange(-2, 30) / 50.0 + 0.005
    for name, columns in {
        "u": (t, t + 1.0),
        "theta_u": (t, t),
        "bridge": (clock, clock < 0.2),
    }.items():
        rows = np.column_stack(columns)
        np.savetxt(tmp_path / f"{name}.csv", rows, delimiter=",", header=f"t,{name}", comments="")
    (tmp_path / "recordings.toml").write_text(
        '[[recording]]\nfiles = { u = "u.csv", theta_u = "theta_u.csv", bridge = "bridge.csv" }\n'
    )
    with pytest.warns(RecordingWarning, match="not known in 1 rows; left out"):
        (found,) = read_folder(tmp_path).fit
    # It is switched at 0.205 s.
    assert len(found) == 49 and 0.2 not in found.t
    assert (found.bridge == (found.t < 0.2)).all() and (found.u[found.t > 0.2] == 0.0).all()


@pytest.mark.parametrize(
    ("bridge", "more", "told"),
    [
        (0.5, {}, "bridge is 0.5 in 50 rows; give 1"),
        (math.nan, {}, "bridge is nan"),
        (0.0, {"drive": "torque"}, "leave bridge out"),
    ],
)
def test_a_bridge_that_cannot_be_is_one_clear_error(bridge, more, told):
    t = np.arange(50) / 100.0
    with pytest.raises(InputError, match=told):
        Recording(**({"t": t, "u": t, "theta_u": t, "bridge": np.full(50, bridge)} | more))


def test_nobody_is_offered_coasting_whose_bridge_is_never_off():
    assert "coasting" in LIBRARY
    assert left_out_of_search([axis_run(1)]) == ()
    on = replace(axis_run(1), bridge=np.ones(len(axis_run(1))))
    assert left_out_of_search([on]) == ("coasting",)
    # Where nothing tells, the bridge may be off in the rows of no voltage.
    unstated = replace(axis_run(1), bridge=None)
    assert left_out_of_search([on, unstated]) == ()
    assert left_out_of_search([replace(unstated, drive="torque")]) == ("coasting",)
    assert left_out_of_search([replace(unstated, u=np.where(on.u == 0.0, 0.1, on.u))]) == (
        "coasting",
    )
