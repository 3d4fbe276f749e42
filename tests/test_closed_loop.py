"""One inertia in its position loop: an exact loop, no bias, and the EMPS figures."""

from __future__ import annotations

import json
import math
from functools import cache

import numpy as np
import pandas as pd
import pytest
import typer
from typer.testing import CliRunner

from drill_env import InputError, Rig
from drill_env.cli.recording_commands import register
from drill_env.identification.asymmetry import compare_asymmetry, split_offset
from drill_env.identification.closed_loop import (
    ASYMMETRIC,
    OFFSET,
    closed_loop_error,
    identify_closed_loop,
    simulate_closed_loop,
)
from drill_env.identification.estimate import identify
from drill_env.identification.inverse_dynamics import InverseOptions
from drill_env.identification.one_inertia import identify_one_inertia
from drill_env.identification.position_law import PositionLaw, find_position_law
from drill_env.recordings import Recording, RecordingWarning
from tests.test_one_inertia import EMPS, emps, needs_emps

__all__ = ["emps"]

AXIS = Rig.one_inertia(km=35.0, Ju=95.0, Tsu=20.0, dTsu=-0.5, bu=210.0, dbu=-35.0)
LAW = PositionLaw(160.0, 240.0, "asked")
DT = 1e-3


def asked(seconds=10.0, phase=0.0):
    """Strokes of several speeds both ways, with stops between them."""
    t = np.arange(round(seconds / DT)) * DT + phase
    return 0.06 * np.tanh(4.0 * np.sin(1.1 * t)) + 0.05 * np.sin(0.37 * t)


def held(rig, x, v, force, left):
    """Exact motion under a constant force over `left` s, from its exponentials."""
    while left > 0.0:
        side = math.copysign(1.0, v or force - rig.dTsu)
        if v == 0.0 and abs(force - rig.dTsu) <= rig.Tsu:
            return x, 0.0
        b = rig.bu + side * rig.dbu
        end, tau, t = (force - rig.dTsu - side * rig.Tsu) / b, rig.Ju / b, left
        if v != 0.0 and side * end < 0.0:
            t = min(left, tau * math.log(1.0 - v / end))
        share = math.exp(-t / tau)
        x += end * t + (v - end) * tau * (1.0 - share)
        v = end + (v - end) * share if t == left else 0.0
        left -= t
    return x, v


def loop(rig, law, wanted, torque=None, step=0.0, added=None):
    """A recording of the closed loop that shares nothing with the package's integrator."""
    rows = len(wanted)
    torque = np.zeros(rows) if torque is None else torque
    added = np.zeros(rows) if added is None else added
    y, u, x, v = np.zeros(rows), np.zeros(rows), float(wanted[0]), 0.0
    for k in range(rows):
        y[k] = round(x / step) * step if step else x
        now = k - law.delay
        if now >= law.span:
            speed = (y[now] - y[now - law.span]) / (law.span * DT)
            u[k] = law.kv * (law.kp * (wanted[now] - y[now]) - speed) + added[k]
            u[k] = min(max(u[k], -law.limit), law.limit)
        x, v = held(rig, x, v, rig.km * u[k] + torque[k], DT)
    extra = {"asked": wanted} | ({"pulses": added} if added.any() else {})
    return Recording(
        t=np.arange(rows) * DT, u=u, theta_u=y, extra=extra, source=f"run of {rows} rows",
        quanta={"theta_u": step} if step else {},
    )  # fmt: skip


def coloured(seed, rows, size=2.0, tau=0.1):
    rng = np.random.default_rng(seed)
    share = math.exp(-DT / tau)
    noise = rng.normal(size=rows) * size * math.sqrt(1.0 - share**2)
    values = np.zeros(rows)
    for k in range(1, rows):
        values[k] = share * values[k - 1] + noise[k]
    return values


@cache
def noisy(seed, seconds=10.0):
    wanted = asked(seconds, phase=0.3 * seed)
    return loop(AXIS, LAW, wanted, coloured(seed, len(wanted)), step=1e-7)


@pytest.mark.parametrize("law", [LAW, PositionLaw(90.0, 150.0, "asked", 1, 1, limit=3.0)])
def test_simulated_loop_is_the_exact_one(law):
    pulses = np.where(np.arange(10_000) // 700 % 3 == 1, 1.5, 0.0)
    truth = loop(AXIS, law, asked(), added=pulses)
    law = PositionLaw(law.kp, law.kv, "asked", law.span, law.delay, "pulses", limit=law.limit)
    run = simulate_closed_loop(truth, AXIS, law, speed=0.0)
    assert np.diff(truth.theta_u)[2000:].min() < 0 < np.diff(truth.theta_u)[2000:].max()
    assert (np.diff(truth.theta_u) == 0.0).sum() > 100, "the axis should stick"
    assert run.theta_u == pytest.approx(truth.theta_u, abs=1e-9)
    assert run.u == pytest.approx(truth.u, abs=1e-4)


def test_sensitivities_are_those_of_the_exact_loop():
    truth = loop(AXIS, LAW, asked())
    slopes = simulate_closed_loop(truth, AXIS, LAW, speed=0.0, slopes=True).slopes
    for column, name in enumerate(("km", "Ju", "Tsu", "dTsu", "bu", "dbu")):
        move = 1e-4 * max(abs(getattr(AXIS, name)), 1.0)
        above, below = (
            loop(AXIS.replace(**{name: getattr(AXIS, name) + s * move}), LAW, asked()).u
            for s in (1, -1)
        )
        moved = (above - below) / (2.0 * move)
        left = np.linalg.norm(slopes[:, column] - moved) / np.linalg.norm(moved)
        assert left < 1e-4, name


@pytest.mark.parametrize("span, delay", [(1, 0), (2, 0), (3, 1), (2, 2)])
def test_the_position_law_is_found_in_the_recording(span, delay):
    pulses = np.where(np.arange(5000) // 500 % 2 == 1, 2.0, 0.0)
    made = PositionLaw(80.0, 120.0, "asked", span, delay)
    run = loop(AXIS, made, asked(5.0), coloured(0, 5000), added=0.7 * pulses)
    run.extra["pulses"] = pulses
    law = find_position_law([run], "asked", "pulses")
    assert (law.span, law.delay) == (span, delay)
    assert [law.kp, law.kv, law.disturbance_gain] == pytest.approx([80.0, 120.0, 0.7], rel=1e-6)


def test_a_saturated_loop_is_found_with_its_limit():
    run = loop(AXIS, PositionLaw(160.0, 240.0, "asked", limit=2.0), asked())
    note = RecordingWarning("saturated", "voltage at its limit")
    run = Recording(t=run.t, u=run.u, theta_u=run.theta_u, extra=run.extra, notes=(note,))
    law = find_position_law([run], "asked")
    assert [law.kp, law.kv, law.limit] == pytest.approx([160.0, 240.0, 2.0], rel=1e-6)
    assert closed_loop_error(run, AXIS, law) < 1e-3


def test_what_no_position_law_made_is_refused():
    run = loop(AXIS, LAW, asked(5.0))
    with pytest.raises(InputError, match="no column wish for the reference.*: asked"):
        find_position_law([run], "wish")
    with pytest.raises(InputError, match="unexplained.*reference asked:mm or its unit"):
        find_position_law([run], "asked:mm")
    wrong = PositionLaw(160.0, 2400.0, "asked", delay=2)
    with pytest.raises(InputError, match="loop is unstable with kp = 160"):
        simulate_closed_loop(run, AXIS, wrong)
    with pytest.raises(InputError, match="needs a one-inertia rig"):
        simulate_closed_loop(run, Rig.paper(), LAW)
    with pytest.raises(InputError, match="free is Jl: give names among Ju"):
        identify_closed_loop([run], AXIS.km, LAW, free=["Jl"])


def test_torque_noise_in_the_loop_does_not_bias_the_estimate():
    """The mean of 12 trials lies at the truth, and they scatter as much as they say."""
    found = [identify_closed_loop([noisy(seed)], AXIS.km, LAW) for seed in range(12)]
    for name in ASYMMETRIC:
        misses = np.array([getattr(one.rig, name) - getattr(AXIS, name) for one in found])
        spread = misses.std(ddof=1)
        assert abs(misses.mean()) < 3.5 * spread / math.sqrt(len(misses)), name
        told = np.median([one.standard_errors[name] for one in found])
        assert 0.5 < told / spread < 2.0, name


def test_prediction_errors_find_the_same_axis_in_closed_loop():
    estimate = identify([noisy(0), noisy(1)], AXIS.replace(Ju=70.0, bu=280.0), fixed={"km": 35.0})
    errors = np.sqrt(np.diag(estimate.covariance))
    for name, error in zip(estimate.free, errors, strict=True):
        assert abs(getattr(estimate.rig, name) - getattr(AXIS, name)) < 3.5 * error, name


def test_a_far_start_ends_in_the_same_place():
    far = AXIS.replace(Ju=50.0, Tsu=45.0, dTsu=3.0, bu=90.0, dbu=10.0)
    near, other = (
        identify_closed_loop([noisy(0)], AXIS.km, LAW, start=start).rig for start in (AXIS, far)
    )
    for name in ASYMMETRIC:
        assert getattr(other, name) == pytest.approx(getattr(near, name), rel=1e-3, abs=1e-3)


def test_a_constant_force_is_the_same_as_an_asymmetric_coulomb_level():
    plain = AXIS.replace(dTsu=0.0)
    pushed = loop(plain, LAW, asked(), torque=np.full(10_000, 0.5))
    uneven = loop(plain.replace(dTsu=-0.5), LAW, asked())
    assert pushed.u == pytest.approx(uneven.u, abs=1e-6)


def test_the_offset_of_a_symmetric_fit_is_taken_apart():
    even = AXIS.replace(dTsu=0.0, dbu=0.0)
    fine = InverseOptions(centre_hold=True)
    for truth, verdict in (
        (even.replace(dbu=-35.0), "is mostly an alias of the asymmetry"),
        (even.replace(dTsu=-3.0), "is not an alias"),
    ):
        run = loop(truth, LAW, asked())
        split = split_offset([run], truth.km, fine)
        plain = identify_one_inertia([run], truth.km, options=fine).estimates["offset"]
        assert split.before == pytest.approx(plain, rel=1e-9)
        assert split.before == pytest.approx(split.after + split.alias, rel=1e-9)
        assert split.after == pytest.approx(truth.dTsu, abs=0.1)
        assert split.dbu == pytest.approx(truth.dbu, abs=1.5)
        assert verdict in split.text


@needs_emps
def test_emps_position_law(emps):
    """The stated gains, the velocity a central difference, and less than a count is left."""
    fit, _ = emps
    for recording in emps:
        law = find_position_law([recording], "qg:m", "pulses_N")
        assert (law.span, law.delay) == (2, 0)
        stated = [recording.constant(name) for name in ("kp", "kv")]
        assert [law.kp, law.kv] == pytest.approx(stated, rel=5e-4)
    law = find_position_law([fit], "qg")
    count = law.kv * fit.quanta["theta_u"] / (2 * fit.interval)
    assert law.left * np.sqrt(np.mean(fit.u**2)) < count


@needs_emps
def test_emps_closed_loop_beats_the_published_simulation(emps):
    fit, pulses = emps
    km, law = fit.constant("gtau"), find_position_law([fit], "qg", "pulses_N")
    errors = {}
    for free in (OFFSET, ASYMMETRIC):
        found = identify_closed_loop([fit], km, law, holdout=[pulses], free=free)
        errors[free] = (found.fit_error, found.holdout_errors[pulses.source])
        assert found.fit_error < 0.0585
        assert found.holdout_errors[pulses.source] < 0.0894
    assert errors[ASYMMETRIC][0] < 0.85 * errors[OFFSET][0]
    assert errors[ASYMMETRIC][1] < 0.9 * errors[OFFSET][1]
    # The inverse-dynamics rigs run in the loop too.
    rig = identify_one_inertia([fit], km).rig
    assert closed_loop_error(pulses, rig, law) < 0.0894


@needs_emps
def test_most_of_the_emps_offset_is_an_alias(emps):
    split = split_offset(emps[:1], emps[0].constant("gtau"))
    assert split.before == pytest.approx(-3.1648, abs=6e-5)
    assert 100 * split.error_before == pytest.approx(4.083, abs=6e-4)
    assert 100 * split.error_after == pytest.approx(3.112, abs=6e-4)
    assert 0.9 < split.alias / split.before < 1.0
    assert "-3.165, is mostly an alias of the asymmetry" in split.text


@needs_emps
@pytest.mark.slow
def test_emps_asymmetry_is_found_by_the_model_comparison(emps):
    fit, pulses = emps
    law = find_position_law([fit], "qg", "pulses_N")
    best, other = compare_asymmetry(
        [fit], fit.constant("gtau"), law, holdout=[pulses], models=("offset", "viscous asymmetry")
    )
    assert best.name == "viscous asymmetry"
    assert other.bic - best.bic > 6.0
    assert best.found.fit_error < other.found.fit_error
    assert best.found.holdout_errors[pulses.source] < other.found.holdout_errors[pulses.source]


@pytest.fixture
def invoke():
    app = typer.Typer()
    register(app)
    return lambda *args: CliRunner().invoke(app, [str(a) for a in args])


def test_identify_command_in_closed_loop(invoke, tmp_path):
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for seed, path in enumerate(paths):
        run = noisy(seed)
        columns = {"t": run.t, "u": run.u, "theta_u": run.theta_u, "ref": 1e3 * run.extra["asked"]}
        pd.DataFrame(columns).to_csv(path, index=False)
    shared = (paths[0], "--one-inertia", "--gain", 35.0, "--map", "theta_u=theta_u:m")
    out = tmp_path / "rig.toml"
    result = invoke(
        "identify", *shared, "--closed-loop", "--reference", "ref:mm", "--holdout", paths[1],
        "--asymmetric", "--out", out, "--json",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document["law"]["kp"] == pytest.approx(160.0, rel=1e-3)
    assert document["rig"]["Ju"] == pytest.approx(95.0, rel=0.02)
    assert document["holdout_errors"][str(paths[1])] < 0.1
    assert "offset" in document["offset"]["text"]
    assert out.exists()
    for args, message in [
        (("--closed-loop",), "--reference COLUMN"),
        (("--reference", "ref"), "--reference belongs to --closed-loop"),
        (("--closed-loop", "--reference", "ref:mm", "--disturbance", "d"), "no recording has"),
    ]:
        error = invoke("identify", *shared, *args).exception
        assert isinstance(error, InputError)
        assert message in str(error)


@needs_emps
def test_identify_command_tells_of_the_emps_offset(invoke):
    maps = ("--map", "u=vir", "--map", "theta_u=qm:m", "--gain-column", "gtau")
    result = invoke(
        "identify", EMPS / "DATA_EMPS.mat", "--one-inertia", *maps, "--closed-loop", "--reference",
        "qg:m", "--disturbance", "pulses_N", "--holdout", EMPS / "DATA_EMPS_PULSES.mat",
        "--asymmetric",
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "held out: DATA_EMPS_PULSES.mat" in result.output
    assert "is mostly an alias of the asymmetry" in result.output
