"""Laws that differ from the library's: each is the formula it says, and nothing at size 0."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from benchmarks.concealed.cases import Plan, draw, plan
from benchmarks.concealed.fields import (
    ANCHOR,
    BEND,
    DRIVE,
    FACTOR_L,
    FACTOR_U,
    HYST,
    N_HELD,
    N_STATES,
    N_STEPPED,
    PAPER,
    TH_L,
    TH_U,
    W_L,
    W_U,
    plant_record,
)
from benchmarks.concealed.held import amplify, hold
from benchmarks.concealed.marks import mark
from benchmarks.concealed.measures import measure
from benchmarks.concealed.other_laws import OTHER_LAWS
from benchmarks.concealed.torques import bend, rates
from drill_env.effects import LIBRARY

STRIBECK = {"torque": 0.05, "speed": 0.3}


def _torques(
    settings: dict[str, float], twist: float = 1.7, omega_u: float = 2.0, omega_l: float = 3.0
) -> np.ndarray:
    """Torques on both discs that slip forwards."""
    q = plant_record(PAPER, settings)[0]
    x, a, out = np.zeros(N_STATES), np.zeros(N_HELD), np.zeros(N_STEPPED)
    a[FACTOR_U] = a[FACTOR_L] = 1.0
    x[TH_U], x[W_U], x[W_L] = twist, omega_u, omega_l
    rates(q, x, np.array([1, 1]), a, out)
    return np.array([out[W_U] * q["Ju"], out[W_L] * q["Jl"]])


def _added(name: str, parameters: dict[str, float], **motion: float) -> np.ndarray:
    settings, sensors = OTHER_LAWS[name].settings(parameters)
    assert not sensors
    return _torques(settings, **motion) - _torques({}, **motion)


@pytest.mark.parametrize(("name", "parameters", "upper", "lower"), [
    ("upper_power_stribeck", {**STRIBECK, "power": 1.5},
     lambda twist, u, v: -0.05 * math.exp(-((u / 0.3) ** 1.5)), None),
    ("upper_rational_stribeck", STRIBECK,
     lambda twist, u, v: -0.05 * 0.3 / (0.3 + u), None),
    ("upper_power_drag", {"coefficient": 0.02, "power": 1.4},
     lambda twist, u, v: -0.02 * u * u**0.4, None),
    ("power_load_friction", {"coefficient": 0.3, "power": 0.8},
     lambda twist, u, v: -0.3 * math.exp(0.8 * math.log(PAPER["ktheta"] * abs(twist))), None),
    ("string_power_hardening", {"hardening": 0.01, "power": 1.5},
     lambda twist, u, v: -PAPER["ktheta"] * 0.01 * twist * math.sqrt(abs(twist)), "opposite"),
    ("string_knee", {"stiffening": 0.02, "knee": 1.0},
     lambda twist, u, v: -PAPER["ktheta"] * 0.02 * (twist - np.clip(twist, -1.0, 1.0)),
     "opposite"),
    ("string_power_damping", {"damping": 1e-3, "power": 1.5},
     lambda twist, u, v: -1e-3 * (u - v) * math.sqrt(abs(u - v)), "opposite"),
    ("lower_power_stribeck", {**STRIBECK, "power": 0.7}, None,
     lambda twist, u, v: -0.05 * math.exp(-((v / 0.3) ** 0.7))),
    ("lower_power_drag", {"coefficient": 1e-4, "power": 2.5}, None,
     lambda twist, u, v: -1e-4 * v * v * math.sqrt(v)),
], ids=lambda value: value if isinstance(value, str) else "")  # fmt: skip
def test_torque_is_that_of_the_formula(
    name: str, parameters: dict[str, float], upper: Callable | None, lower: Callable | str | None
):
    for twist, u, v in ((1.7, 2.0, 3.0), (-0.6, 0.15, 0.05), (-2.5, 4.0, 0.4)):
        found = _added(name, parameters, twist=twist, omega_u=u, omega_l=v)
        first = upper(twist, u, v) if upper else 0.0
        second = lower(twist, u, v) if callable(lower) else -first if lower else 0.0
        assert found == pytest.approx([first, second], rel=1e-9, abs=1e-15)


def test_hysteresis_follows_bouc_and_wen_with_its_power():
    settings, _ = OTHER_LAWS["string_power_hysteresis"].settings(
        {"amplitude": 0.01, "width": 0.3, "power": 2.5}
    )
    q = plant_record(PAPER, settings)[0]
    x, a, out = np.zeros(N_STATES), np.zeros(N_HELD), np.zeros(N_STEPPED)
    for rate, z in ((1.2, 0.7), (1.2, -0.7), (-0.4, -0.9), (-0.4, 0.2)):
        x[W_U], x[HYST] = rate, z
        rates(q, x, np.array([1, 1]), a, out)
        loss = 0.5 * (abs(rate) * z * abs(z) ** 1.5 + rate * abs(z) ** 2.5)
        assert out[HYST] == pytest.approx((rate - loss) / 0.3, rel=1e-9)


@pytest.mark.parametrize("power", [1.5, 2.0])
def test_bristles_bend_as_their_equation(power: float):
    q = plant_record(PAPER, {"presliding": 0.05, "presliding_power": power})[0]
    x = np.zeros(N_STATES)
    for way, start in ((1, -0.8), (-1, 0.3)):
        x[BEND], x[ANCHOR], x[TH_L] = start, 2.0, 2.0 + way * 0.12
        truth = solve_ivp(lambda _, z, way=way: way * abs(1.0 - way * z) ** power / 0.05,
                          (0.0, 0.12), [start], rtol=1e-10, atol=1e-12)  # fmt: skip
        assert bend(q, x, way) == pytest.approx(truth.y[0, -1], abs=1e-8)


@pytest.mark.parametrize(("name", "law"), [
    ("tanh_saturation", lambda r: (math.exp(2 * r) - 1) / (math.exp(2 * r) + 1)),
    ("arctan_saturation", lambda r: math.asin(r / math.hypot(2 / math.pi, r)) * 2 / math.pi),
], ids=["tanh", "arctan"])  # fmt: skip
def test_amplifier_saturates_softly(name: str, law: Callable):
    settings, _ = OTHER_LAWS[name].settings({"limit": 4.0})
    q, x = plant_record(PAPER, settings)[0], np.zeros(N_STATES)
    for v in (-4.5, 0.1, 3.0):
        assert amplify(q, x, v, 1e-3) == pytest.approx(4.0 * law(v / 4.0), rel=1e-9)


def _held(settings: dict[str, float], t: float) -> np.ndarray:
    a = np.zeros(N_HELD)
    hold(plant_record(PAPER, settings)[0], np.zeros(N_STATES), a, t, 0.0, 0.0, 0.0, 0.0)
    return a[[FACTOR_U, FACTOR_L]]


def test_friction_settles_as_a_ratio_of_times():
    warm, _ = OTHER_LAWS["rational_warmup"].settings({"excess": 0.2, "time_constant": 8.0})
    settled, _ = OTHER_LAWS["rational_settling"].settings({"change": -0.1, "time_constant": 8.0})
    assert _held(warm, 0.0) == pytest.approx([1.2, 1.0])
    assert _held(warm, 8.0) == pytest.approx([1.1, 1.0])
    assert _held(settled, 0.0) == pytest.approx([1.0, 1.0])
    assert _held(settled, 24.0) == pytest.approx([1.0, 0.925])


def test_winding_cools_by_air_that_it_moves():
    settings, _ = OTHER_LAWS["convective_motor_heating"].settings(
        {"loss": 0.3, "tau": 12.0, "power": 1.25}
    )
    q, x, a = plant_record(PAPER, settings)[0], np.zeros(N_STATES), np.zeros(N_HELD)
    for j in range(40_000):
        hold(q, x, a, 5e-4 * j, 5e-4, 4.0, 0.0, 0.0)
    truth = solve_ivp(lambda _, h: (16.0 / 25.0 - np.abs(h) ** 1.25) / 12.0, (0.0, 20.0), [0.0],
                      rtol=1e-10, atol=1e-12)  # fmt: skip
    assert a[DRIVE] == pytest.approx(4.0 * PAPER["km"] * (1.0 - 0.3 * truth.y[0, -1]), rel=1e-5)


def test_siblings_are_of_the_tool_s_library_and_of_the_same_component():
    for effect in OTHER_LAWS.values():
        assert effect.siblings and effect.id not in LIBRARY
        assert {LIBRARY[name].component for name in effect.siblings} == {effect.component}


def test_a_sibling_is_right_and_the_law_s_own_name_is_none():
    planned = plan("differ", len(OTHER_LAWS), ["wear"], [5.0])
    assert [p.effects for p in planned] == [(name,) for name in OTHER_LAWS]
    answer = dict(draw(5, Plan("differ", 3, ("upper_power_stribeck",), (5.0,))).answer)
    answer["oracle_five_second_rms"] = {"holdout-1": {"theta_u": 0.1, "theta_l": 0.2}}
    rows = []
    for name in ("upper_gaussian_stribeck", "upper_power_stribeck", "wear"):
        told = {"id": name, "probability": 0.9, "alias_class": [], "parameters": {}}
        diagnosis = {"verdict": "missing_physics", "effects": [told], "alternatives": [],
                     "located": {"component": LIBRARY["wear"].component}}  # fmt: skip
        rows.append({**mark(answer, diagnosis), "cpu_s": None, "wall_s": None})
    rows.append({**mark(answer, {"verdict": "unexplained"}), "cpu_s": None, "wall_s": None})
    assert [r["first"] for r in rows] == [True, False, False, False]
    assert [r["surplus"] for r in rows] == [0, 1, 1, 0]
    found = measure(rows)
    assert found["law differs: a sibling named first"]["hits"] == 1
    assert found["law differs: a sibling named first"]["n"] == 4
    assert found["law differs: component right"]["hits"] == 0
    assert found["law differs: told as unexplained"]["hits"] == 1
