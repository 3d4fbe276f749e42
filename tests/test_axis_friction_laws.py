"""Friction of an axis of two laws at once, in recordings that are disturbed unequally."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.by_prediction import diagnose_by_prediction
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.prediction.compare import row_of
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.likelihood import log_density, scales
from drill_env.prediction.rule import Entrant, chosen
from drill_env.recordings import Recording

RATE, SECONDS, FINER = 200, 20.0, 20
J, B, ASYMMETRY, COULOMB = 2.0, 4.0, -1.2, 1.5
OPTIONS = DiagnosisOptions(given_rig=True, doubt=0.1)


def recorded(seed: int, coulomb: float, shaken: float) -> Recording:
    """An axis under held torques by small steps, at rest while friction holds it.

    Args:
        seed: of the torques and of what shakes it.
        coulomb: its dry friction, Nm.
        shaken: torque that shakes it, Nm, held for a tenth of a second.
    """
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-8.0, 8.0, int(SECONDS / 0.5)), RATE // 2)
    shake = np.repeat(shaken * rng.standard_normal(int(10 * SECONDS)), RATE // 10)
    theta, w, h, rows = 0.0, 0.0, 1.0 / (RATE * FINER), []
    for torque in (u + shake).tolist():
        rows.append(theta)
        for _ in range(FINER):
            pushed = w + h * (torque - B * w - ASYMMETRY * abs(w)) / J
            dry = h * coulomb / J
            w = 0.0 if abs(pushed) <= dry else pushed - np.copysign(dry, pushed)
            theta += h * w
    noise = 1e-6 * rng.standard_normal(len(rows))
    return Recording(np.arange(len(rows)) / RATE, u, np.array(rows) + noise, source=f"run {seed}")


def test_a_law_is_named_though_unseen_recordings_are_disturbed_more():
    runs = [recorded(1, COULOMB, 0.02), recorded(2, COULOMB, 0.4)]
    rig = Rig.one_inertia(km=1.0, Ju=J, Tsu=COULOMB, bu=B)
    found = diagnose_by_prediction(runs[:1], rig, runs[1:], OPTIONS)
    (effect,) = found.result.effects
    assert effect.id == "upper_asymmetry"
    assert effect.parameters["damping"].value == pytest.approx(ASYMMETRY, rel=0.1)


def test_two_laws_over_one_speed_are_no_curve_without_a_name():
    runs = [recorded(seed, COULOMB, 0.05) for seed in (3, 4)]
    rig = Rig.one_inertia(km=1.0, Ju=J, Tsu=0.0, bu=B)
    found = diagnose_by_prediction(runs[:1], rig, runs[1:], OPTIONS)
    named = {effect.id: effect.parameters for effect in found.result.effects}
    assert found.result.verdict == "missing_physics"
    assert named.keys() == {"upper_coulomb", "upper_asymmetry"}
    assert named["upper_coulomb"]["torque"].value == pytest.approx(COULOMB, rel=0.1)
    assert named["upper_asymmetry"]["damping"].value == pytest.approx(ASYMMETRY, rel=0.1)


def test_recordings_full_of_gaps_are_predicted_less_far_ahead():
    """Of every 0.75 s the last 0.15 are lost: no stretch holds a window of 1 s."""
    runs = [recorded(seed, COULOMB, 0.02) for seed in (5, 6)]
    kept = np.arange(len(runs[0])) % 150 < 120
    runs = [replace(r, t=r.t[kept], u=r.u[kept], theta_u=r.theta_u[kept]) for r in runs]
    rig = Rig.one_inertia(km=1.0, Ju=J, Tsu=COULOMB, bu=B, dbu=ASYMMETRY)
    found = diagnose_by_prediction(runs[:1], rig, runs[1:], OPTIONS)
    assert found.result.verdict in ("consistent", "parameters")
    assert found.leads[-1] <= 0.5


def test_densities_by_their_own_scale_differ_by_the_logarithm_of_the_errors():
    errors = np.random.default_rng(6).standard_t(4.0, (4000, 1, 1))
    for factor in (0.1, 7.0):
        one, other = (log_density(e, scales(e, 4.0), 4.0) for e in (errors, factor * errors))
        np.testing.assert_allclose(one - other, np.log(factor), atol=1e-6)


def entrant(name: str, gain: float, *, common: bool = False, named: bool = True) -> Entrant:
    """A candidate of the upper disc that gains so much over thirty windows and four leads."""
    gains = np.random.default_rng(int(gain)).standard_normal((30, 4)) * 0.2
    gains += (gain - gains.sum()) / gains.size
    row = row_of(name, 2 if named else 6, gains, [0] * 30)
    return Entrant(name, "upper", "omega_u", named, common, True, row)


@pytest.mark.parametrize(("gain", "taken"), [(38.0, "rare"), (46.0, "usual")])
def test_a_usual_name_goes_first_if_it_explains_four_fifths_of_the_curve(gain, taken):
    curve, rare = entrant("curve", 54.0, named=False), entrant("rare", 52.0)
    told = chosen([curve, rare, entrant("usual", gain, common=True)], Criteria())
    assert told.chosen is not None and told.chosen.id == taken
    # So much is probable in both: neither is ruled out.
    assert min(told.weights["rare"], told.weights["usual"]) > 0.05


def test_a_curve_without_a_name_stands_alone():
    told = chosen([entrant("curve", 54.0, named=False)], Criteria())
    assert told.chosen is not None and told.chosen.id == "curve"
    assert told.grades.component == 1.0 and told.grades.family == 0.0


def test_a_curve_that_unseen_recordings_do_not_bear_is_none():
    curve = replace(entrant("curve", 54.0, named=False), determined=False)
    assert chosen([curve], Criteria()).chosen is None
    # Nor does a name need to stand for it.
    name = entrant("name", 30.0)
    told = chosen([curve, name], Criteria())
    assert told.chosen is not None and told.chosen.id == "name" and told.share == 1.0
