"""Where predicted windows begin: on the model's own motion through the readings around."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drill_env import Rig
from drill_env.diagnosis.by_prediction import diagnose_by_prediction
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.window_residual import share_removed
from drill_env.identification.samples import prepare
from drill_env.prediction.compare import difference, row_of
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.cut import cut
from drill_env.prediction.motion import motion_as_read
from drill_env.prediction.rule import Entrant, chosen
from drill_env.prediction.starts import starts_of
from drill_env.recordings import Recording

RATE, NOISE = 200.0, 2e-4
AXIS = Rig.one_inertia(km=0.5, Ju=0.02, Tsu=0.0, bu=0.05)
LEVER, COULOMB = 0.2, 0.1


def axis_run(seed, seconds=10.0, weight=0.0, coulomb=0.0):
    """An axis under voltage steps, by SciPy from the formulas, and its true speeds."""
    rng, t = np.random.default_rng(seed), np.arange(int(seconds * RATE)) / RATE
    u = np.repeat(rng.uniform(-1.5, 1.5, int(seconds / 0.05)), int(0.05 * RATE))

    def rates(now, y, volts):
        torque = AXIS.km * volts - AXIS.bu * y[1] + weight * math.cos(y[0] + 0.4)
        return [y[1], (torque - coulomb * math.tanh(y[1] / 1e-3)) / AXIS.Ju]

    states = np.zeros((len(t), 2))
    for a in range(0, len(t), 10):
        b = min(a + 10, len(t) - 1)
        run = solve_ivp(
            rates, (t[a], t[b]), states[a], t_eval=t[a : b + 1], args=(u[a],), rtol=1e-9,
            atol=1e-11, method="LSODA",
        )  # fmt: skip
        states[a : b + 1] = run.y.T
    read = states[:, 0] + rng.normal(0.0, NOISE, len(t))
    return Recording(t, u, read, source=f"axis {seed}"), states


def windows_of(run):
    samples = prepare(run, AXIS)
    return cut(samples, motion_as_read(samples, AXIS), AXIS, np.array([0.015, 0.1, 0.3, 0.95]))


@pytest.mark.parametrize("width", [0.15, 0.075])
def test_angle_and_speed_at_a_start_err_as_a_parabola_through_noise_does(width):
    """However fast the drive changes: it is the model's own."""
    errors, count = [], round(2 * width * RATE)
    for seed in range(6):
        run, truth = axis_run(seed)
        found = windows_of(run).begun(width, AXIS, 0.0)
        states, _ = found.starts.states(AXIS, found.windows.motion, 0.0)
        errors.append(states[:, :2] - truth[found.windows.starts])
    sizes = np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0))
    # Least squares of a parabola through evenly spaced points, at its middle.
    speed = NOISE * math.sqrt(12.0 / count**3) * RATE
    angle = NOISE * 1.5 / math.sqrt(count)
    np.testing.assert_allclose(sizes, [angle, speed], rtol=0.25)


def test_readings_of_an_encoder_far_off_centre_are_predicted_as_those_of_a_true_one():
    eccentricity = {"id": "encoder_eccentricity_upper", "error": 0.05, "phase": 0.9}
    rigs, sizes = (AXIS, AXIS.replace(effects=(eccentricity,))), []
    for seed in range(3):
        run, truth = axis_run(seed)
        off = 0.05 * np.cos(truth[:, 0] + 0.9)
        for rig, error in zip(rigs, (0.0, off), strict=True):
            found = windows_of(replace(run, theta_u=np.asarray(run.theta_u) + error))
            sizes.append(found.begun(0.15, AXIS, 0.0).errors(rig, 0.0)[..., 0])
    true, wrong = (np.concatenate(sizes[i::2]) for i in (0, 1))
    # The same noise; the third power of 0.05 is left.
    np.testing.assert_allclose(wrong, true, atol=2.0 * 0.05**3)
    np.testing.assert_allclose(np.std(wrong, axis=0), np.std(true, axis=0), rtol=0.1)


def test_a_missing_reading_is_no_reading():
    run, truth = axis_run(1)
    angles = np.asarray(run.theta_u).copy()
    whole = windows_of(run)
    angles[whole.windows.starts[3] + np.array([-7, 2, 11])] = math.nan
    samples = prepare(replace(run, theta_u=angles), AXIS)
    starts = starts_of(samples, whole.windows, 1, 0.15)
    states, _ = starts.states(AXIS, whole.windows.motion, 0.0)
    off = states[:, :2] - truth[whole.windows.starts]
    assert np.abs(off[:, 0]).max() < 4.0 * NOISE and np.abs(off[:, 1]).max() < 2e-3


def test_an_axis_that_lacks_nothing_is_predicted_to_the_noise_of_its_readings():
    given = AXIS.replace(Ju=1.04 * AXIS.Ju, km=0.96 * AXIS.km)
    runs = [axis_run(n)[0] for n in (1, 2, 3, 4)]
    options = DiagnosisOptions(
        given_rig=True, most=1, leave_out=("gear_backlash",), fixed={"bu": AXIS.bu}
    )
    found = diagnose_by_prediction(runs[:2], given, runs[2:], options)
    assert not found.result.effects and found.result.verdict == "parameters"
    # At every lead; a start's own error adds a few hundredths.
    assert found.before.size.max() < 1.25 * NOISE
    assert found.rig.Ju == pytest.approx(AXIS.Ju, rel=1e-3)
    assert found.rig.km == pytest.approx(AXIS.km, rel=1e-3)


def test_of_two_effects_each_is_chosen_beside_the_other():
    runs = [axis_run(n, weight=LEVER, coulomb=COULOMB)[0] for n in (1, 2, 3, 4)]
    options = DiagnosisOptions(given_rig=True, most=2, leave_out=("gear_backlash",))
    found = diagnose_by_prediction(runs[:2], AXIS, runs[2:], options)
    sizes = {e.id: e.parameters["torque"] for e in found.result.effects}
    assert set(sizes) == {"upper_unbalance", "upper_coulomb"}
    for name, truth in (("upper_unbalance", LEVER), ("upper_coulomb", COULOMB)):
        assert sizes[name].value == pytest.approx(truth, rel=0.01)
    for choice, candidate in zip(found.choices, found.after.candidates, strict=True):
        assert choice.chosen is not None and choice.chosen.candidate is candidate
        # Each was judged with the other one in place.
        assert len(choice.found.before[0].candidates) == 1
    # What is left is noise to trees that know no formula; of what one alone leaves they learn.
    cuts = (*found.fold.setting.cuts, *found.fold.unseen)
    assert share_removed(found.before, found.after, cuts) == 1.0
    assert share_removed(found.before, found.before, cuts) == pytest.approx(0.0)
    one = found.choices[0].found.before[0]
    assert 0.0 < share_removed(found.before, one, cuts) < 0.8
    # Where nothing was predictable before, what a name leaves is of its own making.
    assert share_removed(found.after, found.before, cuts) == 0.0


def test_two_names_that_differ_in_one_recording_alone_are_not_told_apart():
    """Windows of one recording share the error of their model."""
    recordings = np.repeat([1, 2, 3, 4], 10).tolist()
    noise = 0.02 * np.random.default_rng(0).standard_normal((40, 1))
    weight = row_of("weight", 2, 3.0 + noise, recordings)
    ahead = np.repeat([0.0, 0.0, 0.0, 1.0], 10)[:, np.newaxis]
    spring = row_of("spring", 2, 3.0 + ahead + noise, recordings)
    assert difference(spring, weight).z == pytest.approx(10.0 / math.sqrt(3 * 2.5**2 + 7.5**2))
    both = [Entrant(r.id, "upper", "theta_u", True, r is weight, True, r) for r in (weight, spring)]
    found = chosen(both, Criteria())
    assert found.chosen is not None and found.chosen.id == "weight"
    assert found.weights["spring"] > 0.3
