"""Friction laws: which one made the recordings, and what each can make the rig do."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from benchmarks.rig_maker import make, quasi_random
from drill_env import InputError
from drill_env.identification.estimate import FitOptions
from drill_env.identification.laws import compare_laws
from drill_env.identification.stick_free import stick_free
from drill_env.parameters import SYMBOLS, Rig
from drill_env.recordings import Recording
from drill_env.report.validation_page import save_validation_page

STEP = 2.0 * math.pi / 8192
RIG = Rig()


def record(seed: int, seconds: float) -> Recording:
    """A run of the humped rig by the other simulator, with the practice sets' torque noise."""
    volts = quasi_random(np.random.default_rng(seed), seconds, 200.0, 5.0)
    made = make(
        {name: getattr(RIG, name) for name in SYMBOLS}, volts, seed=seed, torque_u=0.02,
        torque_l=2e-4,
    )  # fmt: skip
    quanta = {"theta_u": STEP, "theta_l": STEP}
    return Recording(made.t, made.u, made.theta_u, made.theta_l, quanta=quanta)


def test_stick_free_vibration_is_that_of_the_other_simulator():
    """The maker's own run at the widest cycle's voltage shows the same extremes of omega_l."""
    found = stick_free(RIG, 5.0)
    assert found.exists and found.largest is not None
    volts, low, high, period = found.largest
    cycles = make(
        {name: getattr(RIG, name) for name in SYMBOLS}, np.full(60_000, volts), 200.0
    ).truth[-round(4 * 200 * period) :, 3]
    assert cycles.min() == pytest.approx(low, abs=0.03)
    assert cycles.max() == pytest.approx(high, rel=2e-3)
    assert low > 0.0


@pytest.mark.parametrize(
    ("drop", "speed"), [(0.3, 1.0), (0.9, 1.0), (0.6, 2.0), (0.3, 8.0), (0.9, 8.0)]
)
def test_no_stribeck_curve_vibrates_without_standstill(drop, speed):
    """Falling friction that levels off: its Hopf points are subcritical, whatever its size."""
    level = 0.08
    rig = RIG.replace(
        friction="stribeck", Tsl=level, T1=-drop * level, beta1=1.0 / speed, bl=0.0042
    )
    found = stick_free(rig, 5.0)
    assert not found.exists and found.volts is None
    assert not any(soft for _, soft in found.hopf)
    assert "stick-free" not in [motion for _, motion in found.simulated]


def test_the_hump_is_found_and_the_stribeck_law_fails(tmp_path):
    fit, held = record(1, 15.0), record(11, 15.0)
    found = compare_laws(
        [fit], RIG.replace(T1=0.09, T2=-0.27, bu=1.9), fixed={"Ju": RIG.Ju}, holdout=[held],
        options=FitOptions(limit=30),
    )  # fmt: skip
    humped, stribeck = found.fit("humped"), found.fit("stribeck")
    assert found.fits[0] is humped
    assert min(found.gap("stribeck"), found.gap("coulomb")) > 500.0
    for law in ("stribeck", "coulomb"):
        assert found.fit(law).error("theta_l", free_run=False) > 5.0 * humped.error(
            "theta_l", free_run=False
        )
    assert humped.vibration is not None and humped.vibration.exists
    assert humped.soft > 0.9
    truth = stick_free(RIG, found.to_volts).volts
    assert truth is not None
    assert humped.vibration.volts == pytest.approx(truth, rel=0.05)
    assert stribeck.vibration is not None and not stribeck.vibration.exists
    assert stribeck.soft == 0.0
    assert humped.validations[0].verdict == "white"
    assert stribeck.validations[0].verdict != "white"
    plain = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    assert [entry["law"] for entry in plain["laws"]][0] == "humped"
    page = tmp_path / "laws.html"
    save_validation_page(humped.estimate, humped.validations, page, found)
    assert found.conclusion.split(".")[0] in page.read_text(encoding="utf-8")


def test_one_inertia_has_no_law_to_compare():
    alone = Rig.one_inertia(km=3.5, Ju=0.45, Tsu=0.32, bu=1.9)
    with pytest.raises(InputError, match="2 inertias"):
        compare_laws([record(1, 2.0)], alone)
