"""Unseen windows decide what an axis lacks, on plants that share no code with the package."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from benchmarks.other_rigs import CASES, PENDULUM, Case, Plant, recorded
from drill_env import InputError, Rig
from drill_env.diagnosis.by_prediction import diagnose_by_prediction
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.result import DiagnosisResult, Grade, NamedEffect
from drill_env.diagnosis.sentences import verdict_sentence
from drill_env.effects import LIBRARY
from drill_env.effects.along import Motion
from drill_env.integrator import sampled_voltage, simulate
from drill_env.integrator.windows import Windows
from drill_env.prediction.candidate import Scales, candidate_of
from drill_env.prediction.compare import row_of, standard_error, weighed, z_of
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.families import FAMILIES
from drill_env.prediction.likelihood import log_density, scales
from drill_env.prediction.randomisation import z_of_groups, z_of_sum
from drill_env.prediction.rule import Entrant, chosen
from drill_env.recordings import Recording

BARE = Plant(**{**PENDULUM.__dict__, "weight": 0.0})
QUICK = DiagnosisOptions(most=1, given_rig=True, doubt=0.1, leave_out=("gear_backlash",))


def test_the_scale_and_density_are_those_of_students_t():
    rng = np.random.default_rng(3)
    errors = 0.02 * rng.standard_t(4.0, (20000, 1, 1))
    size = scales(errors, 4.0)
    assert size[0, 0] == pytest.approx(0.02, rel=0.02)
    ours = log_density(errors, size, 4.0)[:, 0]
    theirs = stats.t.logpdf(errors[:, 0, 0], 4.0, scale=size[0, 0])
    np.testing.assert_allclose(np.diff(ours), np.diff(theirs), atol=1e-12)


def test_one_bad_reading_hardly_moves_the_scale():
    errors = np.random.default_rng(5).standard_normal((200, 1, 1))
    spoilt = np.concatenate([errors, [[[1e6]]]])
    assert scales(spoilt, 4.0)[0, 0] == pytest.approx(scales(errors, 4.0)[0, 0], rel=0.03)


def test_a_scale_is_no_smaller_than_the_error_of_rounding():
    """Of a disc that mostly rests most predictions are right to the last bit."""
    errors = np.zeros((100, 1, 1))
    errors[:20] = np.random.default_rng(7).uniform(-0.02, 0.02, (20, 1, 1))
    assert scales(errors, 4.0)[0, 0] < 1e-6
    assert scales(errors, 4.0, least=np.array([0.005]))[0, 0] == 0.005
    # One that is larger is the same with it.
    wide = np.random.default_rng(9).standard_normal((200, 1, 1))
    assert scales(wide, 4.0, least=np.array([0.005])) == scales(wide, 4.0)


def test_an_axis_that_mostly_stands_lacks_nothing():
    """A blind maker's axis was given an encoder off centre, by a quarter of a step."""
    truth = Rig.one_inertia(km=4.5, Ju=1.8, Tsu=14.0, bu=9.1, dbu=0.3)
    step, runs = 2.0 * math.pi / 1024, []
    for seed in range(4):
        rng = np.random.default_rng([14, seed])
        t = np.arange(6001) / 200.0
        # A push now and then; between them the axis is held by its friction.
        u = np.where(rng.random(60) < 0.3, rng.uniform(-8.0, 8.0, 60), rng.uniform(-2.5, 2.5, 60))
        u = u[np.minimum((2.0 * t).astype(int), 59)]
        run = simulate(truth, sampled_voltage(t, u), float(t[-1]), t_eval=t)
        angle = np.round((run.theta_u + rng.uniform(0.0, step)) / step) * step
        runs.append(Recording(t, u, angle, quanta={"theta_u": step}, source=f"stands-{seed}"))
    known = truth.replace(km=4.66, Ju=1.75, Tsu=13.6, bu=9.5, dbu=0.29)
    found = diagnose_by_prediction(runs[:3], known, runs[3:], QUICK).result
    assert found.verdict == "consistent", found.sentences


def test_equal_models_share_their_probability_and_a_number_costs_one_nat():
    windows = np.random.default_rng(1).normal(1.0, 1.0, (30, 1))
    one = row_of("a", 1, windows, [0] * 30)
    two = row_of("b", 2, windows, [0] * 30)
    assert weighed([one, one], [1.0, 1.0]) == pytest.approx([0.5, 0.5])
    share = weighed([one, two], [1.0, 1.0])
    assert share[0] / share[1] == pytest.approx(np.e)
    assert weighed([one, one], [10.0, 1.0]) == pytest.approx([10 / 11, 1 / 11])


def test_windows_of_one_recording_that_err_together_count_as_one():
    gains = np.repeat([3.0, -1.0, 2.0, 4.0], 25)
    marks = np.repeat([1, 2, 3, 4], 25)
    alone = standard_error(gains, np.arange(100))
    assert alone == pytest.approx(np.sqrt(100 * gains.var(ddof=1)))
    between = np.sqrt(np.sum((25 * np.array([3.0, -1.0, 2.0, 4.0]) - 50.0) ** 2))
    assert standard_error(gains, marks) == pytest.approx(between)


@pytest.mark.parametrize("spread", [0.2, 1.0, 3.0, 30.0])
def test_a_sum_is_as_clear_as_all_signs_of_its_parts_say(spread):
    rng = np.random.default_rng(int(spread))
    for _ in range(5):
        parts = rng.standard_t(2, 14) * spread + 1.0
        exact = stats.permutation_test(
            (parts,), np.sum, permutation_type="samples", n_resamples=np.inf, alternative="greater"
        )
        assert z_of_sum(parts) == pytest.approx(stats.norm.isf(exact.pvalue), abs=0.1)
        assert z_of_sum(-parts) == -z_of_sum(parts)


def test_one_window_that_gains_much_more_does_not_hide_the_others():
    rng = np.random.default_rng(3)
    gains = rng.normal(4.0, 2.0, 22)
    clear = z_of(gains, [0] * 22)
    gains[-1] += 480.0
    assert gains.sum() < 2.0 * standard_error(gains, [0] * 22)
    assert z_of(gains, [0] * 22) > 3.0 < clear
    # Three recordings are three observations, however many windows they have.
    assert z_of(gains, [0] * 8 + [1] * 8 + [2] * 6) < 2.0
    # One gain alone is chance.
    alone = rng.normal(0.0, 1.0, 22)
    alone[-1] += 480.0
    assert z_of(alone, [0] * 22) < 2.0


def test_recordings_that_all_gain_are_clear_though_one_has_more_to_gain():
    rng = np.random.default_rng(4)
    sizes, marks = (0.3, 1.0, 20.0, 2.0, 0.6), np.repeat(np.arange(5), 20)
    gains = np.concatenate([size * rng.normal(1.0, 0.8, 20) for size in sizes])
    assert gains.sum() < 2.5 * standard_error(gains, marks.tolist())
    assert z_of(gains, marks.tolist()) > 3.0
    # One that loses says that the others may have gained by chance.
    gains[:20] -= 1.0
    assert z_of(gains, marks.tolist()) < 2.5


def test_gains_of_groups_are_as_clear_as_students_t_of_the_clearness_of_each():
    marks, gains = np.repeat(np.arange(4), 12), np.random.default_rng(6).normal(0.4, 1.0, 48)
    each = np.array([z_of_sum(gains[marks == i]) for i in range(4)])
    told = stats.ttest_1samp(each, 0.0, alternative="greater").pvalue
    assert told > stats.norm.sf(each.sum() / 2.0)
    assert z_of_groups(gains, marks.tolist()) == pytest.approx(stats.norm.isf(told))


def test_recordings_that_share_an_error_seldom_look_clear():
    rng, count, rows = np.random.default_rng(7), 5, np.repeat(np.arange(5), 12)
    draws = [rng.normal(0.0, 1.0, 60) + np.repeat(rng.normal(0.0, 2.0, count), 12)
             for _ in range(300)]  # fmt: skip
    assert np.mean([z_of_groups(draw, rows.tolist()) > 3.0 for draw in draws]) < 0.05


@pytest.mark.parametrize(
    "effects",
    [
        (),
        ({"id": "friction_lag", "time_constant": 0.05},),
        ({"id": "input_delay", "delay": 0.033},),
        ({"id": "gear_backlash", "gap": 0.05, "motor_share": 0.3, "frequency": 9.5,
          "friction_share": 0.5, "damping": 0.07},),
        ({"id": "encoder_eccentricity_lower", "error": 0.01, "phase": 0.3},),
        ({"id": "encoder_delay_lower", "delay": 0.033},),
    ],
)  # fmt: skip
def test_the_rig_itself_predicts_its_readings_from_any_row(effects):
    """The integrator's whole run is the truth; inner states, delays and encoders' errors agree."""
    rng, rate = np.random.default_rng(0), 200.0
    t = np.arange(0.0, 20.0, 1.0 / rate)
    u = np.repeat(rng.uniform(1.0, 5.0, 40), 100)
    rig = Rig(effects=effects)
    run = simulate(rig, sampled_voltage(t, u), t[-1], t_eval=t, method="dopri5", rtol=1e-9)
    states = np.hstack([run.state, np.gradient(run.state[:, 1:3], t, axis=0)])
    starts = np.arange(300, 3000, 100)
    rows = starts[:, None] + np.array([3, 30, 200])
    # The true motion: with a late encoder the reading is the angle of a delay ago.
    windows = Windows(
        Motion(t, u, states, np.zeros(1, dtype=np.int64)), starts, rows, as_read=False
    )
    found = windows.predicted(rig, rtol=1e-7).readings
    assert np.abs(found - run.readings[rows]).max() < 1e-3


def run_of(case: Case, seed: int) -> Recording:
    return recorded(replace(case, seconds=20.0), seed)


@pytest.mark.parametrize("seed", [11, 21, 31])
def test_an_axis_as_its_lab_knows_it_lacks_nothing(seed):
    case = Case(BARE, volts=1.6, rate=200.0)
    runs = [run_of(case, seed + i) for i in range(3)]
    found = diagnose_by_prediction(runs[:2], BARE.rig(), runs[2:], QUICK)
    assert found.result.verdict in ("consistent", "parameters")
    assert found.result.effects == [] and found.result.grades is None


def test_a_weight_is_named_with_its_size_and_predicts_what_was_not_fitted():
    case = CASES["pendulum that turns over"]
    runs = [run_of(case, seed) for seed in (1, 2, 3)]
    found = diagnose_by_prediction(runs[:2], case.plant.rig(), runs[2:], QUICK)
    (effect,) = found.result.effects
    assert effect.id == "upper_unbalance"
    number = effect.parameters["torque"]
    assert number.value == pytest.approx(0.6, rel=0.1)
    grades = found.result.grades
    assert grades is not None and grades.component == "upper" and grades.depends_on == "theta_u"
    assert grades.law_probability > 0.9
    told = found.result.fit["prediction"]["theta_u"]
    assert told["after_rms"][-1] < 0.2 * told["before_rms"][-1]
    given = case.plant.rig().replace(effects=found.rig.effects)
    again = diagnose_by_prediction(runs[:2], given, runs[2:], QUICK)
    assert again.result.effects == []


def test_numbers_do_not_depend_on_which_recordings_were_held_out():
    """All recordings tell them once it is decided what is missing."""
    case = CASES["pendulum that turns over"]
    runs = [run_of(case, seed) for seed in (1, 2)]
    told = []
    for seen, unseen in ((runs[:1], runs[1:]), (runs[1:], runs[:1])):
        found = diagnose_by_prediction(seen, case.plant.rig(), unseen, QUICK)
        (effect,) = found.result.effects
        assert effect.id == "upper_unbalance"
        told.append([(n.low, n.value, n.high) for n in effect.parameters.values()])
        assert found.rig.effects[0]["torque"] == effect.parameters["torque"].value
    # Windows begin where the first fit predicts best from, which is that of other recordings.
    assert np.allclose(*told, rtol=0.01)


def test_numbers_of_given_physics_are_refined_with_the_rig():
    """A weight that the rig file knows within some per cent is a weight, not missing physics."""
    case = CASES["pendulum that turns over"]
    runs = [run_of(case, seed) for seed in (1, 2, 3)]
    weight = {"id": "upper_unbalance", "torque": 0.55, "phase": np.pi / 2 + 0.08}
    rig = case.plant.rig().replace(effects=(weight,))
    found = diagnose_by_prediction(runs[:2], rig, runs[2:], QUICK)
    assert found.result.effects == [] and found.result.grades is None
    change = found.result.parameters_changed["upper_unbalance.torque"]
    assert change.before == 0.55 and change.low < 0.6 < change.high
    (refined,) = found.rig.effects
    assert refined["torque"] == pytest.approx(0.6, rel=0.02)


def test_missing_friction_is_told_as_coulomb_friction():
    plant = Plant(**{**BARE.__dict__, "Tu": 0.06})
    runs = [run_of(Case(plant, volts=1.6, rate=200.0), seed) for seed in (1, 2, 3)]
    given = plant.rig().replace(Tsu=0.0)
    found = diagnose_by_prediction(runs[:2], given, runs[2:], QUICK)
    (effect,) = found.result.effects
    assert effect.id == "upper_coulomb"
    number = effect.parameters["torque"]
    assert number.low < 0.06 * found.rig.Ju / plant.Ju < number.high


def test_a_drive_that_acts_two_rows_late_is_no_missing_physics():
    case = Case(BARE, volts=1.6, rate=200.0)
    runs = [run_of(case, seed) for seed in (4, 5, 6)]
    late = [replace(r, u=np.concatenate([r.u[2:], r.u[-2:]])) for r in runs]  # type: ignore[index]
    found = diagnose_by_prediction(late[:2], BARE.rig(), late[2:], QUICK)
    assert found.result.effects == []
    assert found.whole.vector[-1] == pytest.approx(2.0, abs=0.3)


def test_too_short_a_recording_is_refused_with_what_to_do():
    short = run_of(Case(BARE, volts=1.6, rate=200.0), 7).part(0, 60)
    with pytest.raises(InputError, match="record longer"):
        diagnose_by_prediction([short], BARE.rig(), [short], QUICK)


def entrant(name: str, per_window: float, *, named: bool, component: str = "upper") -> Entrant:
    scatter = 0.1 * np.random.default_rng(0).standard_normal(40)
    row = row_of(name, 1, (per_window + scatter)[:, np.newaxis], [0] * 40)
    return Entrant(name, component, "omega_u", named, False, True, row)


def test_a_shape_that_a_name_stands_for_is_no_rival_of_it():
    """The right name, with nine tenths of a free shape's gain, had a probability of 1e-20."""
    entrants = [
        entrant("upper_quadratic_drag", 9.0, named=True),
        entrant("upper_stribeck", 8.9, named=True),
        entrant("upper_torque_of_omega_u", 10.0, named=False),
    ]
    choice = chosen(entrants, Criteria())
    assert choice.chosen is not None and choice.chosen.id == "upper_quadratic_drag"
    assert choice.share == pytest.approx(0.9, abs=0.01)
    # Against the other name, 4 nats behind, it is weighed as it was.
    assert choice.grades.law == pytest.approx(1.0 / (1.0 + np.exp(-4.0)), abs=0.01)
    assert choice.weights["upper_torque_of_omega_u"] == 0.0
    # A shape elsewhere remains one.
    far = chosen([*entrants, entrant("string_shape", 8.99, named=False, component="string")],
                 Criteria())  # fmt: skip
    assert far.grades.component < 0.7
    assert far.grades.law == pytest.approx(far.weights["upper_quadratic_drag"])


def test_names_far_behind_a_shape_are_still_told_apart():
    """Their shares of the whole are below what a number can hold."""
    entrants = [
        entrant("upper_stribeck", 85.0, named=True),
        entrant("upper_quadratic_drag", 90.0, named=True),
        entrant("upper_torque_of_omega_u", 110.0, named=False),
    ]
    choice = chosen(entrants, Criteria())
    assert choice.chosen is not None and choice.chosen.id == "upper_quadratic_drag"
    assert choice.grades.law == pytest.approx(1.0)


def test_a_free_shape_is_told_with_the_names_that_come_nearest_at_its_place():
    """A string damped by a power of its rate was unexplained, its family hidden in a table."""
    elsewhere = entrant("string_damping", 7.0, named=True, component="string")
    entrants = [
        entrant("upper_stribeck", 4.0, named=True),
        entrant("upper_quadratic_drag", 5.0, named=True),
        entrant("upper_viscous", 0.01, named=True),
        elsewhere,
        entrant("upper_torque_of_omega_u", 10.0, named=False),
    ]
    choice = chosen(entrants, Criteria())
    assert choice.chosen is not None and choice.chosen.id == "upper_torque_of_omega_u"
    # Neither what nobody asks for nor what acts elsewhere.
    assert [name for name, _ in choice.grades.nearest] == ["upper_quadratic_drag", "upper_stribeck"]
    assert dict(choice.grades.nearest)["upper_stribeck"] == pytest.approx(0.4, abs=0.01)
    # Where a name is taken, it is the answer itself.
    named = chosen([*entrants[:4], entrant("upper_shape", 5.0, named=False)], Criteria())
    assert named.chosen is not None and named.chosen.named
    assert named.grades.nearest == ()


def test_a_limit_of_the_current_may_lie_above_every_voltage():
    """A capstan's limit of 27 V, by 24 V and as much back EMF at each reversal, was not found."""
    scales = Scales(
        torque=20.0, speed=15.0, voltage=24.0, middle=0.0, way=10.0, interval=5e-3, seconds=30.0
    )
    capstan = candidate_of(LIBRARY["current_limit"], scales)
    levels = [capstan.entry(z)["level"] for z, _ in capstan.starts()]
    assert min(levels) < 24.0 < 27.0 < max(levels) <= 48.0
    # What acts on the voltage alone cuts nothing off above it.
    clipped = candidate_of(LIBRARY["amplifier_saturation"], scales)
    assert max(clipped.entry(z)["level"] for z, _ in clipped.starts()) < 24.0


def test_a_window_is_one_observation_at_however_many_leads():
    rng = np.random.default_rng(2)
    gains = rng.normal(0.3, 1.0, (40, 1))
    other = gains + rng.normal(0.05, 0.2, (40, 1))
    pair = (("a", gains), ("b", other))
    rows = [[row_of(n, 1, np.repeat(g, k, axis=1), [0] * 40) for n, g in pair] for k in (1, 4)]
    one, four = (weighed(r, [1.0, 1.0]) for r in rows)
    np.testing.assert_allclose(four, one)


def test_a_shape_elsewhere_takes_the_place_of_a_name_that_is_hardly_probable_beside_it():
    """A name is no stand-in for a curve at another component, however far its scatter reaches."""
    scatter = np.array([0.0, 0.0, 0.0, 60.0])
    there = row_of("upper_friction_of_theta_u", 12, (20.0 + scatter)[:, np.newaxis], [0, 1, 2, 3])
    shape = Entrant(there.id, "upper", "theta_u", False, False, True, there)
    ripple = row_of("commutation_ripple", 3, np.array([[7.0], [8.0], [7.5], [7.0]]), [0, 1, 2, 3])
    name = Entrant(ripple.id, "actuator", "theta_u", True, False, True, ripple)
    found = chosen([name, shape], Criteria(z=1.0))
    assert found.chosen is not None and found.chosen.id == shape.id
    assert found.grades.component > 0.9
    # Where it is likelier than not that there is a name, it stays.
    beside = replace(name, row=replace(ripple, windows=ripple.windows + 24.0))
    kept = chosen([beside, shape], Criteria(z=1.0)).chosen
    assert kept is not None and kept.id == "commutation_ripple"


def test_numbers_at_the_end_of_their_range_are_no_name():
    lost = replace(entrant("upper_resonator", 1.0, named=True), determined=False)
    assert chosen([lost], Criteria()).chosen is None


def test_a_family_is_as_probable_as_its_laws_together():
    """Two laws of friction that falls with speed share what neither has alone."""
    entrants = [
        entrant("upper_stribeck", 5.0, named=True),
        entrant("upper_gaussian_stribeck", 5.0, named=True),
        entrant("upper_quadratic_drag", 4.98, named=True),
    ]
    grades = chosen(entrants, Criteria()).grades
    assert grades.law == pytest.approx(0.5 * grades.family)
    assert 0.5 < grades.family < grades.depends_on == pytest.approx(1.0)
    assert {effect for family in FAMILIES.values() for effect in family} == set(LIBRARY)
    assert sum(len(family) for family in FAMILIES.values()) == len(LIBRARY)


def test_the_headline_is_the_finest_grade_that_is_likelier_than_not():
    grade = Grade("upper", 1.0, "omega_u", 1.0, "dry friction", 0.9, "upper_coulomb", 0.6, 1.0)
    effect = NamedEffect("upper_coulomb", "upper", 0.6, {}, "", "", [])
    result = DiagnosisResult(
        "missing_physics", None, [effect], [], None, {}, {}, {}, [], [], None, {}, grade, []
    )
    assert verdict_sentence(result).endswith("the model: upper_coulomb.")
    open_law = replace(result, grades=replace(grade, law_probability=0.4))
    assert "dry friction, most probably upper_coulomb" in verdict_sentence(open_law)
