"""Truths of concealed cases in the tool's terms: both sides' formulas on one motion."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.concealed.fields import (
    AGE,
    CREEP,
    HOLD,
    HYST,
    LAGGED,
    N_HELD,
    N_STATES,
    N_STEPPED,
    PAPER,
    SLEWED,
    TH_L,
    TH_S,
    TH_U,
    W_L,
    W_S,
    W_U,
    plant_record,
)
from benchmarks.concealed.held import amplify, held_voltage, hold, remember
from benchmarks.concealed.library import LIBRARY as CONCEALED
from benchmarks.concealed.sensors import Sensors, recorded, sample_times, shown
from benchmarks.concealed.terms import LEFT_OUT, in_tool_terms
from benchmarks.concealed.torques import bend, rates
from drill_env._types import FloatArray
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion, responses_along
from drill_env.effects.declared import bundled
from drill_env.parameters import Rig

DT, ROWS, SUBSTEPS = 2e-3, 5000, 4
FAULTS = {
    "clock_jitter": {"jitter"}, "missing_samples": {"share"}, "lost_encoder_bits": {"bits"},
    "missed_counts_upper": {"size", "rate"}, "missed_counts_lower": {"size", "rate"},
}  # fmt: skip
# Of the largest torque: what the formulas' small print makes (see `terms`), or steps of time.
NEARLY = {"supply_sag": 0.03, "string_hysteresis": 0.01}
# Times and lengths that steps of time resolve.
SIZES = {"slew_limit": 0.2, "friction_lag": 0.1, "presliding": 0.3, "amplifier_saturation": 1.0}
# Neither holds along a motion that is given: a motor moves on its own, counts are lost at random.
APART = {"gear_backlash", "gear_compliance", "missed_counts_upper", "missed_counts_lower"}
SIDES = [n for n in CONCEALED if in_tool_terms(n, CONCEALED[n].parameters(
    1e-3, CONCEALED[n].middle()), PAPER) and n not in APART | set(FAULTS)]  # fmt: skip


class Moved:
    """A motion of both discs with reversals, slow and fast, and the voltage beside it."""

    def __init__(self, *, rest: bool = False, steps: bool = True) -> None:
        self.t: FloatArray = np.arange(ROWS + 1, dtype=np.float64) * DT
        t = self.t
        # From rest without a jerk: what remembers begins where both sides begin.
        grown = np.zeros_like(t) if rest else 1.0 - np.exp(-((t / 2.0) ** 3))
        slope = np.zeros_like(t) if rest else 1.5 * (t / 2.0) ** 2 * np.exp(-((t / 2.0) ** 3))
        lower, lower_rate = self._wave(t, 5.0, 0.7, 0.3)
        twist, twist_rate = self._wave(t, 1.5, 2.1, 1.2)
        self.theta_l, self.omega_l = grown * lower, grown * lower_rate + slope * lower
        self.twist, twist_rate = grown * twist, grown * twist_rate + slope * twist
        if rest:
            self.twist = np.full_like(t, 3.0)
        self.omega_u, self.theta_u = self.omega_l + twist_rate, self.theta_l + self.twist
        self.u = 4.8 * np.sin(0.5 * t[:-1]) * grown[:-1]
        if steps:
            self.u = np.round(self.u)

    @staticmethod
    def _wave(t: np.ndarray, size: float, rate: float, phase: float):
        return size * np.sin(rate * t + phase), size * rate * np.cos(rate * t + phase)

    def motion(self) -> Motion:
        speeds = np.column_stack([self.omega_u, self.omega_l])
        states = np.column_stack(
            [self.twist, speeds, self.theta_l, np.gradient(speeds, DT, axis=0)]
        )
        return Motion(self.t, np.append(self.u, 0.0), states, np.zeros(1, dtype=np.int64))


def _whole(moved: Moved, record: np.ndarray) -> np.ndarray:
    """Torques on the discs and the extra hold over each row, by the maker's own functions."""
    q = record[0]
    x, a, s = np.zeros(N_STATES), np.zeros(N_HELD), np.zeros(2, dtype=np.int64)
    k = np.zeros((2, N_STEPPED))
    h, out = DT / SUBSTEPS, np.zeros((ROWS, 3))
    x[AGE], x[TH_S] = 1.0, 0.5 * (moved.theta_u[0] + moved.theta_l[0])
    own = [i for i, used in ((TH_S, q["string_inertia"]), (W_S, q["string_inertia"]), (HYST, 1.0),
                             (CREEP, 1.0), (LAGGED, 1.0), (AGE, 1.0)) if used]  # fmt: skip

    def place(share: float, row: int) -> None:
        for at, values in ((TH_U, moved.theta_u), (W_U, moved.omega_u),
                           (TH_L, moved.theta_l), (W_L, moved.omega_l)):  # fmt: skip
            x[at] = (1.0 - share) * values[row] + share * values[row + 1]
        for disc, at in enumerate((W_U, W_L)):
            side = int(np.sign(x[at]))
            if disc == 1 and q["presliding"] > 0.0 and side * s[1] < 0:
                x[19], x[20] = bend(q, x, s[1]), x[TH_L]
            s[disc] = side

    for row in range(ROWS):
        for j in range(SUBSTEPS):
            t = moved.t[row] + j * h
            v = moved.u[row]
            if q["input_delay"] > 0.0:
                v = held_voltage(moved.t, moved.u, t + 0.5 * h - q["input_delay"], row)
            place((j + 0.5) / SUBSTEPS, row)
            hold(q, x, a, t, h, amplify(q, x, v, h), 0.0, 0.0)
            rates(q, x, s, a, k[0])
            start = x[own]
            x[own] = start + 0.5 * h * k[0][own]
            rates(q, x, s, a, k[1])
            out[row] += np.array([k[1][W_U] * q["Ju"], k[1][W_L] * q["Jl"], a[HOLD]]) / SUBSTEPS
            x[own] = start + h * k[1][own]
            remember(q, x, s, a, h)
    return out


@pytest.fixture(scope="module")
def bare() -> dict[bool, np.ndarray]:
    return {steps: _whole(Moved(steps=steps), plant_record(PAPER)) for steps in (True, False)}


def _tools(name: str, parameters: dict[str, float], moved: Moved) -> tuple[np.ndarray, np.ndarray]:
    effect = LIBRARY[name]
    q = effect.vector(in_tool_terms(name, parameters, PAPER))
    return responses_along(bundled([(effect, q)]), Rig(), moved.motion())


@pytest.mark.parametrize("name", SIDES)
def test_both_formulas_are_one_function(name: str, bare: dict[bool, np.ndarray]):
    effect = CONCEALED[name]
    moved = Moved(rest=name == "dwell_stiction", steps=name != "supply_sag")
    parameters = effect.parameters(SIZES.get(name, effect.guess), effect.middle())
    # The middle of a turn is half a turn: a sine there is no cosine but for its sign.
    if "phase" in parameters:
        parameters["phase"] = 0.8
    if "time" in parameters:
        parameters["time"] = 7.0
    plant, sensors = effect.settings(parameters)
    torques, errors = _tools(name, parameters, moved)
    if sensors:
        states = np.column_stack([moved.theta_u, moved.omega_u, moved.theta_l, moved.omega_l])
        ours = shown(moved.t, states, Sensors(**sensors)) - states[:, ::2]
        # A constant is the encoder's zero.
        truth, ours = ours - ours[0], errors - errors[0]
    else:
        whole = _whole(moved, plant_record(PAPER, plant))
        truth, ours = (whole - bare[name != "supply_sag"])[:, :2], torques[:-1]
        if name == "dwell_stiction":
            truth, ours = np.column_stack([np.zeros(ROWS), -whole[:, 2]]), torques[:-1]
    size = np.abs(truth).max()
    assert size > 0.0
    # Rows in which a speed passes through zero hold both directions.
    still = np.abs(np.diff(np.sign(moved.omega_l))) + np.abs(np.diff(np.sign(moved.omega_u))) > 0
    gap = np.abs(ours - truth)[: len(still)][~still]
    assert np.quantile(gap, 0.999) < NEARLY.get(name, 0.005) * size


SHARES = {"motor_share"}


def test_every_number_is_translated_or_left_out_with_a_reason():
    for name, effect in CONCEALED.items():
        names = [effect.size, *effect.shape]
        whole = {n: 0.2 if n in SHARES else 2.0 for n in names}
        base = in_tool_terms(name, whole, PAPER)
        known = {p.name for p in LIBRARY[name].parameters} if name in LIBRARY else set()
        assert set(base) <= known | FAULTS.get(name, set())
        for own in names:
            other = {**whole, own: 0.7 if own in SHARES else 11.0}
            moved = in_tool_terms(name, other, PAPER) != base
            assert moved != (f"{name}.{own}" in LEFT_OUT), f"{name}.{own}"


def test_faults_of_the_recording_are_those_that_are_played():
    rng = np.random.default_rng(0)
    n, rate = 200_000, 200.0
    told = in_tool_terms("clock_jitter", {"sigma": 3e-5}, PAPER)["jitter"]
    times = sample_times(rng, n, rate, 1e-5, Sensors(clock=3e-5))
    assert np.std(times - np.arange(n + 1) / rate) == pytest.approx(told, rel=0.02)
    ramp = np.outer(0.01 * np.arange(n), np.ones(2))
    stale = Sensors(repeated=0.2, repeated_run=5.7)
    seen = np.mean(np.all(np.diff(recorded(rng, ramp, stale), axis=0) == 0.0, axis=1))
    told = in_tool_terms("missing_samples", {"share": 0.2, "run": 5.7}, PAPER)["share"]
    assert seen == pytest.approx(told, rel=0.03)
    coarse = recorded(rng, ramp[:2000] / 50.0, Sensors(coarse_l=0.0062))
    steps = [float(np.diff(np.unique(column)).min()) for column in coarse.T]
    told = in_tool_terms("lost_encoder_bits", {"step": 0.0062}, PAPER)["bits"]
    assert steps[1] / steps[0] == pytest.approx(2.0**told) and told == 3.0


@pytest.mark.parametrize("settings", [
    {"slew_rate": 70.0}, {"sag": 0.05, "sag_tau": 0.05}, {"lag": 0.02},
    {"heating": 0.3, "heating_tau": 0.1},
], ids=lambda s: next(iter(s)))  # fmt: skip
def test_drive_of_a_substep_is_its_mean(settings: dict[str, float]):
    """However long the substep: the same mean torque, and the same state at its end."""
    q = plant_record(PAPER, settings)[0]
    coarse, fine, a = np.zeros(N_STATES), np.zeros(N_STATES), np.zeros(N_HELD)
    for i, v in enumerate((3.0, 3.0, -1.0, -1.02, 4.0, 4.0)):
        drives = []
        for x, h, count in ((coarse, 0.02, 1), (fine, 2e-5, 1000)):
            drive = 0.0
            for j in range(count):
                hold(q, x, a, 0.02 * i + j * h, h, amplify(q, x, v, h), 0.0, 0.0)
                drive += a[0] / count
            drives.append(drive)
        assert drives[0] == pytest.approx(drives[1], abs=1e-9)
        assert coarse == pytest.approx(fine, abs=1e-9)
    assert coarse[SLEWED:].any()
