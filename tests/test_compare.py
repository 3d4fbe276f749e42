"""The comparison: its measures by hand, its runs against the exact simulation."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

from drill_env import InputError, Rig, baselines
from drill_env._documents import plain
from drill_env.benchmark import (
    SETPOINTS,
    UnreachableWarning,
    compare,
    measure,
    vibration_free,
)
from drill_env.cli.compare_command import write_comparison
from drill_env.controllers import Controller, observation_names
from drill_env.dynamics import equilibrium_voltage
from drill_env.environment.config import EnvConfig
from drill_env.integrator import simulate
from drill_env.report.compare_table import compare_table

HOPF = 0.815194
BELOW = [w for w in SETPOINTS if w < HOPF]
ABOVE = [w for w in SETPOINTS if w > HOPF]


@pytest.fixture(scope="module")
def runs():
    few = ("open-loop", "pi", "active-damping")
    return compare({name: baselines.CONTROLLERS[name] for name in few}, EnvConfig())


class Shouting:
    """Returns what it is told to; reads one past frame."""

    view = "surface"
    history = 1

    def __init__(self, value):
        self.value, self.widths = value, set()

    def reset(self, n):
        self.n = n

    def act(self, observation):
        self.widths.add(observation.shape[1])
        return np.broadcast_to(self.value, (self.n,)).copy()


def test_measures_of_a_short_series_by_hand():
    omega = np.array([0.0, 3.0, 1.9, -0.05, 0.05, 4.0, 2.0, 2.0])
    volts = np.array([5.0, 5.0, 0.0, 1.0, 1.0, -5.0, 1.0, 2.0])
    found = measure(omega, volts, setpoint=2.0, period=0.5, limit=5.0, window_s=2.5)
    assert found.mean == pytest.approx(8.0 / 5)
    assert (found.min, found.max) == (-0.05, 4.0)
    assert found.severity_index == pytest.approx(4.05 / (2 * 1.6))
    assert found.bias == pytest.approx(-0.2)
    assert found.below_share == 0.4 and found.reversal_share == 0.2
    assert found.rms_voltage == pytest.approx(math.sqrt((1 + 1 + 25 + 1 + 4) / 5))
    assert found.rms_voltage_rate == pytest.approx(math.sqrt((0 + 144 + 144 + 4) / 4))
    assert found.saturation_share == 0.2
    assert math.isnan(found.settling_s)


def test_settling_is_the_end_of_the_last_period_outside_the_band():
    omega = np.array([0.0, 3.0, 2.05, 2.11, 1.95, 2.0, 2.0, 2.0])
    wide = measure(omega, np.ones(8), 2.0, 0.5, 5.0, window_s=2.0)
    assert wide.settling_s == 4 * 0.5
    assert measure(omega[4:], np.ones(4), 2.0, 0.5, 5.0).settling_s == 0.0
    assert math.isnan(measure(omega, np.ones(8), 2.0, 0.5, 5.0, window_s=2.5).settling_s)


@pytest.mark.parametrize("omega", [np.zeros(10), -np.ones(10), np.full(10, np.nan)])
def test_no_forward_speed_is_infinite_severity_and_never_free(omega):
    found = measure(omega, np.zeros(10), 2.0, 0.05, 5.0)
    assert found.severity_index == math.inf and math.isnan(found.settling_s)
    table = compare({"pi": baselines.SpeedPI}, EnvConfig(), setpoints=[2.0], seconds=40.0)
    table = table.assign(**dataclasses.asdict(found))
    assert not vibration_free(table).any()
    compare_table(table)
    assert json.dumps(plain(table.to_dict("records")), allow_nan=False)


@pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")
def test_open_loop_ends_where_the_exact_simulation_does(runs):
    rig = Rig.paper()
    for setpoint in (1.0, 3.0, 8.5):
        exact = simulate(rig, float(equilibrium_voltage(rig, setpoint)), 200.0, extrema=True)
        late = exact.omega_l[exact.t > 150.0]
        mine = runs[(runs.controller == "open-loop") & (runs.setpoint == setpoint)]
        # Read 20 times a second, a peak is missed by at most an eighth of (w T)^2 of its height.
        missed = 0.125 * (1.55 * 0.05) ** 2 * np.ptp(late) + 1e-3
        assert mine["max"].to_numpy() == pytest.approx([late.max()] * 2, abs=missed)
        assert mine["min"].to_numpy() == pytest.approx([late.min()] * 2, abs=missed)


def test_active_damping_ends_vibration_everywhere_from_both_starts(runs):
    mine = runs[runs.controller == "active-damping"]
    assert len(mine) == 2 * len(SETPOINTS)
    assert vibration_free(mine).all() and mine.severity_index.max() < 1e-2
    assert mine.settling_s.notna().all()


@pytest.mark.parametrize("name", ["open-loop", "pi"])
def test_open_loop_and_pi_vibrate_above_the_hopf_point_only(runs, name):
    mine = runs[runs.controller == name]
    assert not vibration_free(mine[mine.setpoint.isin(ABOVE)]).any()
    assert vibration_free(mine[mine.setpoint.isin(BELOW)]).all()


def test_same_seed_same_table():
    config = EnvConfig(uncertainty="L2")
    makers = {"pi": baselines.SpeedPI, "active-damping": baselines.ActiveDamping}
    first, again, other = (
        compare(makers, config, setpoints=(1.0, 4.0), seconds=20.0, window_s=10.0, seed=seed)
        for seed in (3, 3, 4)
    )
    assert first.equals(again)
    assert not first["mean"].equals(other["mean"])


def test_unreachable_set_points_warn_and_are_still_run():
    with pytest.warns(UnreachableWarning, match=r"9 rad/s .* 5 V hold at most 8\.89 rad/s"):
        found = compare(
            {"pi": baselines.SpeedPI}, EnvConfig(), setpoints=(2.0, 9.0), starts=("rest",),
            seconds=40.0,
        )  # fmt: skip
    assert found.saturation_share[1] > 0.5 > found.saturation_share[0]


def test_the_observation_has_the_frames_the_controller_asks_for():
    speaker = Shouting(1.0)
    assert isinstance(speaker, Controller)
    compare({"x": lambda _: speaker}, EnvConfig(), setpoints=(2.0,), seconds=1.0, window_s=1.0)
    names = observation_names(EnvConfig(observation="surface", history=1))
    assert speaker.widths == {len(names)} == {5}
    for name in baselines.CONTROLLERS:
        made = baselines.make(name, EnvConfig())
        assert isinstance(made, Controller) and made.history == 0


@pytest.mark.parametrize("value", [np.nan, np.inf, np.ones((1, 3, 1))])
def test_a_controller_without_a_voltage_is_named(value):
    speaker = Shouting(1.0)
    speaker.act = lambda observation: np.asarray(value) * np.ones(1)
    with pytest.raises(InputError, match=r"controller bad: .* finite voltages"):
        compare({"bad": lambda _: speaker}, EnvConfig(), setpoints=(2.0,), seconds=1.0, window_s=1)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"setpoints": ()}, "at least one"),
        ({"setpoints": (-1.0,)}, "setpoint is -1.0"),
        ({"setpoints": (61.0,)}, "at most 60"),
        ({"window_s": 100.0}, "window is 100.0"),
        ({"seconds": math.nan}, "seconds is nan"),
        ({"seconds": 0.0}, "seconds is 0.0"),
    ],
)
def test_bad_arguments_are_named(options, text):
    with pytest.raises(InputError, match=text):
        compare({"pi": baselines.SpeedPI}, EnvConfig(), **options)


def test_written_files_agree_and_the_picture_is_there(runs, tmp_path):
    import pandas as pd

    csv, parquet, document, picture = write_comparison(runs, EnvConfig(), tmp_path / "new")
    assert pd.read_csv(csv).equals(runs) and pd.read_parquet(parquet).equals(runs)
    rows = json.loads(document.read_text())
    assert len(rows) == len(runs) and rows[0]["controller"] == "open-loop"
    assert picture.read_bytes().startswith(b"\x89PNG")
