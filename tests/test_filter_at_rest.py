"""Effects that decide when a disc rests, taken by the filter at its own state."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.concealed.fields import PAPER, plant_record
from benchmarks.concealed.signals import signal
from drill_env import Rig
from drill_env.diagnosis import extended, in_filter, joint, joint_noise
from drill_env.diagnosis.applied import with_terms
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import evaluate, whitened
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import added
from drill_env.diagnosis.joint import joint_step, overreaches
from drill_env.diagnosis.linearised import linearised_at
from drill_env.diagnosis.stiction_starts import best_at_rest
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.identification.noise import NoiseModel
from drill_env.identification.prediction_error import path_of
from drill_env.identification.samples import Samples, prepare
from drill_env.parameters import SYMBOLS
from drill_env.recordings import Recording
from tests.made_recordings import played as run_played

QUANTUM = 2.0 * math.pi / 8192
# Torques that nobody knows are next to none: what is predicted wrong shows.
NOISE = NoiseModel(1e-3, 1e-5, 0.1, 0.1, QUANTUM / math.sqrt(12.0), QUANTUM / math.sqrt(12.0))
NUMBERS = {
    "lower_stribeck": (0.0235, 0.2),
    "lower_gaussian_stribeck": (0.0235, 0.3),
    "presliding": (0.004,),
    "dwell_stiction": (0.02, 1.0),
    "friction_lag": (0.02,),
    "rate_state": (0.003, 0.3, 0.5),
    "upper_stribeck": (0.1, 0.4),
    "gear_compliance": (23.5, 0.35, 0.02, 0.05),
    "gear_backlash": (0.01, 0.35, 20.0, 0.02, 0.3),
}


def term_of(name: str) -> Term:
    effect = LIBRARY[name]
    return Term(Named(effect, within=effect.refined_within), np.array(NUMBERS[name]))


def played(name: str, family: str = "chirp", numbers: tuple[float, ...] | None = None) -> Samples:
    """A recording of the paper's rig with an effect, with rests and reversals."""
    numbers = numbers or NUMBERS[name]
    names = [p.name for p in LIBRARY[name].parameters]
    effect = {"id": name, **dict(zip(names, numbers, strict=True))}
    return played_of(Rig(effects=(effect,)), family)


def played_of(rig: Rig, family: str) -> Samples:
    """A recording of a rig, prepared for the paper's."""
    u = signal(family, np.random.default_rng(3), plant_record(PAPER))
    t = 5e-3 * np.arange(len(u))
    angles = run_played(rig, t, u, np.zeros(4))[1]
    angles = np.round(angles / QUANTUM) * QUANTUM
    quanta = dict.fromkeys(("theta_u", "theta_l"), QUANTUM)
    samples = prepare(Recording(t, u, angles[:, 0], angles[:, 1], quanta=quanta), Rig())
    return replace(samples, starts=np.zeros_like(samples.starts))


def setting_of(*samples: Samples) -> tuple[Setting, Fit]:
    """A setting in which all but Ju is free, and the paper's rig in it."""
    return base_fit(samples, Rig(), [name for name in SYMBOLS if name != "Ju"])


@pytest.mark.parametrize("name", list(NUMBERS))
def test_the_true_effect_leaves_rounding_alone(name: str):
    samples = played(name)
    given = with_terms(samples, (term_of(name),), Rig(), None)  # type: ignore[arg-type]
    with_it = path_of(given, Rig(), NOISE, samples.starts)
    without = path_of(samples, Rig(), NOISE, samples.starts)
    seen = with_it.trace.standardised[400:]
    assert np.sqrt(np.mean(seen**2)) < 1.25
    assert with_it.value < without.value - 100.0


def test_a_start_that_comes_to_rest_at_once_is_moved_to_rest():
    """Readings tell nothing of such a speed: its column is none, and a step would be anything."""
    samples, term = played("gear_compliance"), term_of("gear_compliance")
    starts = samples.starts.copy()
    starts[0, 1] = -1e-4
    spreads = np.full_like(samples.spreads, 0.1)
    setting, base = setting_of(replace(samples, spreads=spreads))
    fit = evaluate(
        setting, setting.coordinates.vector(Rig()), (term,), NOISE, [starts], base.motions
    )
    assert samples.u[0] > 0.0
    assert fit.start_steps[0][0, 1] == pytest.approx(1e-4)
    assert (fit.start_slopes[0][0, 1] == 0.0).all()
    # The other numbers of the start are found in spite of it.
    assert np.abs(fit.start_steps[0][0, [0, 3]]).max() < QUANTUM


@pytest.mark.parametrize("name", ["lower_stribeck", "presliding", "dwell_stiction", "rate_state"])
def test_slopes_are_those_of_the_predictions(name: str):
    samples, term = played(name), term_of(name)
    setting, base = setting_of(samples)
    noise = replace(NOISE, torque_u=0.02, torque_l=2e-4)
    vector, motion = setting.coordinates.vector(Rig()), base.motions[0]

    def path(vector, slopes=False):
        rig = setting.coordinates.rig(vector)
        given = with_terms(samples, (term,), rig, motion)
        return given, rig, path_of(given, rig, noise, samples.starts, slopes=slopes)

    given, rig, here = path(vector, True)
    jacobian = setting.coordinates.jacobian(vector)
    columns = whitened(given, setting, rig, jacobian, (term,), noise, samples.starts, here, motion)
    for name_of_rig in ("Jl", "Tsl", "T1", "km"):
        place = setting.coordinates.free.index(name_of_rig)
        step = np.zeros_like(vector)
        step[place] = 1e-5 * max(abs(vector[place]), 1.0)
        moved = (path(vector - step)[2].rows["white"] - path(vector + step)[2].rows["white"]) / (
            2.0 * step[place]
        )
        column = columns[:, :, place]
        # Bristles bend further where the disc stands further, which the slopes leave out.
        share = 0.2 if name == "presliding" else 0.02
        assert np.linalg.norm(moved - column) < share * np.linalg.norm(moved)


def test_a_stronger_hold_is_sought_by_the_likelihood_itself():
    setting, base = setting_of(*(played("dwell_stiction", family) for family in ("ramp", "chirp")))
    found = best_at_rest(linearised_at(setting, base), Named(LIBRARY["dwell_stiction"]))
    assert found is not None and found[1] > 50.0
    fit = added(setting, base, found[0])
    assert base.value - fit.value == pytest.approx(found[1], rel=1e-6)
    hold = [q[0] * (1.0 - math.exp(-1.0 / q[1])) for q in (found[0].q, NUMBERS["dwell_stiction"])]
    assert hold[0] == pytest.approx(hold[1], rel=0.3)


def test_a_disc_that_never_rests_says_nothing_of_its_hold():
    t = 5e-3 * np.arange(4001)
    u = 5.0 * np.minimum(t, 1.0)
    angles = run_played(Rig(), t, u, np.array([0.0, 2.0, 2.0, 0.0]))[1]
    samples = prepare(Recording(t, u, angles[:, 0], angles[:, 1]), Rig())
    setting, base = setting_of(samples)
    assert best_at_rest(linearised_at(setting, base), Named(LIBRARY["dwell_stiction"])) is None


def test_presliding_yields_below_the_brakes_torque_and_springs_back():
    t = 1e-2 * np.arange(1001)
    start = np.array([0.5 * Rig().Tsl / Rig().ktheta, 0.0, 0.0, 0.0])
    held, _ = run_played(Rig(), t, np.zeros_like(t), start)
    yielding = Rig(effects=({"id": "presliding", "distance": 0.02},))
    sprung, _ = run_played(yielding, t, np.zeros_like(t), start)
    assert not held[:, 3].any()
    # Dahl's curve says how far it goes when it goes there slowly; here it swings beyond that.
    rest = -0.02 * math.log(1.0 - 0.5)
    assert rest < sprung[:, 3].max() < 4.0 * rest
    assert (sprung[:, 2] < -1e-3).any()


@pytest.mark.parametrize("family", ["random steps", "sines"])
def test_next_to_a_jump_of_a_torque_the_covariance_stays_one(family: str):
    """Of a wrong rig that hardly moves, a derivative there was 1e5 Nms, and the filter broke down.

    A friction amplifies no speed a thousand times within an interval.
    """
    rig = Rig(
        km=3.619, Tsu=0.323, dTsu=0.0101, bu=2.0836, dbu=-0.0166, Jl=0.0372, ktheta=0.0839,
        Tsl=0.0746, bl=0.00112, friction="coulomb",
    )  # fmt: skip
    samples = played("presliding", family)
    term = Term(Named(LIBRARY["presliding"]), np.array([0.0014]))
    noise = replace(NOISE, torque_u=0.021, torque_l=0.032, tau_l=1.5)
    given = with_terms(samples, (term,), rig, None)  # type: ignore[arg-type]
    rows = path_of(given, rig, noise, samples.starts).rows
    least = [np.linalg.eigvalsh(P)[0] / np.trace(P) for P in rows["P"]]
    assert min(least) > -1e-14
    assert rows["F"][:, 2, 2].max() < 10.0


def test_a_fit_beside_its_peak_is_carried_to_it_by_slopes_over_wide_steps():
    """An order of a brake's runout lay nine deviations off, and 65 less likely, once."""
    numbers = {"runout": 0.02, "phase": 1.0, "order": 1.0}
    rig = Rig(effects=({"id": "brake_runout", **numbers},))
    setting, base = setting_of(played_of(rig, "ramp"))
    aside = np.array([0.02, 1.0, 1.003])
    fit = added(setting, base, Term(Named(LIBRARY["brake_runout"], within=True), aside))
    found = in_filter.within_filter(setting, fit, lambda text: None)
    assert found.value < fit.value - 1000.0
    assert found.terms[-1].q == pytest.approx(list(numbers.values()), rel=1e-3)


def test_where_the_filter_breaks_down_the_numbers_along_the_motion_stay(monkeypatch):
    """A gear's numbers that the motion told ended a diagnosis: "SVD did not converge"."""
    term = term_of("gear_compliance")
    setting, base = setting_of(played("gear_compliance"))
    outside = Term(Named(LIBRARY["gear_compliance"]), term.q)
    fit = added(setting, base, outside)
    none = np.full_like(fit.gradient, math.nan)
    broken = replace(fit, value=math.inf, gradient=none, terms=(term,))
    monkeypatch.setattr(in_filter, "evaluate", lambda *point: broken)
    assert in_filter.within_filter(setting, fit, lambda text: None) is fit
    # A descent from there goes nowhere, and says so.
    assert joint_step(setting, broken, 1e-4)[0] is broken
    assert not overreaches(setting, broken, 1e-4)


def test_a_point_without_slopes_has_no_likelihood(monkeypatch):
    setting, base = setting_of(played("gear_compliance"))
    whole = extended.whitened

    def broken(*given):
        return np.full_like(whole(*given), math.nan)

    monkeypatch.setattr(extended, "whitened", broken)
    there = evaluate(setting, base.vector, (), base.noise, base.starts, base.motions)
    assert there.value == math.inf


def test_a_point_whose_likelihood_is_no_number_has_none(monkeypatch):
    """Sorted first among attempts, it ended a diagnosis of an arm's joint in a traceback."""
    setting, base = setting_of(played("gear_compliance"))
    monkeypatch.setattr(extended, "lost_value", lambda *given: math.nan)
    there = evaluate(setting, base.vector, (), base.noise, base.starts, base.motions)
    assert there.value == math.inf


def test_a_fit_stays_where_the_filter_breaks_down_along_its_own_motion(monkeypatch):
    setting, base = setting_of(played("gear_compliance"))
    monkeypatch.setattr(
        joint, "with_new_motions", lambda setting, fit: replace(fit, value=math.inf)
    )
    assert joint.polished(setting, base) is base


def test_a_step_never_ends_where_there_are_no_slopes(monkeypatch):
    """The value was one, the slopes were none: the descent went on from nothing."""
    setting, base = setting_of(played("gear_compliance"))
    whole = extended.whitened

    def broken(*given):
        return np.full_like(whole(*given), math.nan)

    noise = replace(base.noise, torque_u=1.01 * base.noise.torque_u)
    for module in (joint, joint_noise):
        monkeypatch.setattr(module, "value_at", lambda *point: -math.inf)
    monkeypatch.setattr(extended, "whitened", broken)
    assert joint_noise.with_noise(setting, base, noise) is base
    assert joint._further(setting, base, base) is base
