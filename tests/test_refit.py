"""Numbers of what was found, from every reading of the windows."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from drill_env.identification.samples import prepare
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.cut import cut
from drill_env.prediction.fit import fit
from drill_env.prediction.intervals import covariance
from drill_env.prediction.motion import motion_as_read
from drill_env.prediction.refit import every_row, refitted
from drill_env.prediction.setting import Setting
from tests.test_window_starts import AXIS, axis_run

LEADS = np.array([0.015, 0.1, 0.3, 0.95])
GIVEN = AXIS.replace(km=0.45, bu=0.06)


def cut_of(run):
    samples = prepare(run, GIVEN)
    return cut(samples, motion_as_read(samples, GIVEN), GIVEN, LEADS)


def fitted(*runs):
    setting = Setting(GIVEN, ("km", "bu"), 0.3, tuple(map(cut_of, runs)), Criteria())
    return fit(setting, setting.centre)


def test_windows_are_predicted_at_all_their_rows():
    run, _ = axis_run(1)
    before = cut_of(run)
    (after,) = every_row([before])
    np.testing.assert_array_equal(after.windows.rows[:, [0, -1]], before.windows.rows[:, [0, -1]])
    assert (np.diff(after.windows.rows, axis=1) == 1).all()
    np.testing.assert_array_equal(after.target[..., 0], run.theta_u[after.windows.rows])


def test_rows_without_a_reading_are_left_out_and_a_lead_is_the_same_in_all_windows():
    (run, _), (other, _) = axis_run(1), axis_run(2)
    angles = np.array(run.theta_u)
    window = cut_of(run).windows.rows[2]
    lost = np.arange(window[1] + 1, window[2])[::2]
    angles[lost] = math.nan
    rows = [
        one.windows.rows
        for one in every_row(list(map(cut_of, (replace(run, theta_u=angles), other))))
    ]
    assert not np.isin(rows[0], lost).any()
    assert rows[0].shape[1] == rows[1].shape[1] == window[-1] - window[0] + 1 - len(lost)
    ahead = np.concatenate(rows) - np.concatenate(rows)[:, :1]
    assert np.ptp(ahead, axis=0).max() <= len(lost)
    assert np.ptp(ahead[:, -1]) <= 1


def test_numbers_from_all_readings_err_less():
    """Beside noise of a tenth of a radian, of which four leads leave most readings out."""
    errors = []
    for seed in range(4):
        run, _ = axis_run(seed)
        rng = np.random.default_rng([seed, 1])
        noisy = replace(run, theta_u=np.asarray(run.theta_u) + rng.normal(0.0, 0.1, len(run.t)))
        few = fitted(noisy)
        many = refitted([few], few.setting.cuts)
        errors.append([math.log(one.rig.km / AXIS.km) for one in (few, many)])
        assert many.errors.shape[1] > 100
    few, many = np.sqrt(np.mean(np.square(errors), axis=0))
    assert many < few


def test_the_covariance_is_the_jackknife_of_the_windows():
    """CR3 is what leaving out each window in turn gives, to the order of a window's leverage."""
    run, _ = axis_run(3)
    few = fitted(replace(run, theta_u=np.asarray(run.theta_u)))
    whole = refitted([few], few.setting.cuts)
    (cuts,) = few.setting.cuts
    count, moved = len(cuts.windows.starts), []
    for i in range(count):
        kept = np.arange(count) != i
        windows = replace(
            cuts.windows, starts=cuts.windows.starts[kept], rows=cuts.windows.rows[kept]
        )
        samples, motion = cuts.samples, cuts.windows.motion
        rest = replace(cut(samples, motion, GIVEN, LEADS), windows=windows)
        rest = replace(rest, target=cuts.target[kept]).begun(cuts.width, whole.rig, 0.0)
        moved.append(refitted([few], [rest]).vector[:2])
    spread = np.sqrt(np.diag(covariance(whole))[:2])
    jackknife = np.sqrt(np.sum((np.array(moved) - np.mean(moved, axis=0)) ** 2, axis=0))
    assert spread == pytest.approx(jackknife, rel=0.3)
