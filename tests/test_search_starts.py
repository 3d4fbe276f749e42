"""Where the search begins with what slopes do not tell."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis import grid_starts
from drill_env.diagnosis.attempts import attempted, confused_with
from drill_env.diagnosis.find import find
from drill_env.diagnosis.fit_changes import added
from drill_env.diagnosis.grid_starts import descended, has_peaks
from drill_env.diagnosis.grids import gains_over
from drill_env.diagnosis.joint import descend_until, polished
from drill_env.diagnosis.linearised import linearised_at
from drill_env.diagnosis.scan import best_point
from drill_env.diagnosis.search import search
from drill_env.diagnosis.stiction_starts import best_at_rest
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from tests.test_filter_at_rest import played, played_of, setting_of

FAMILIES = ("random steps", "chirp", "square")


def both(*effects: dict, family: str):
    """A recording of the paper's rig with two effects."""
    return played_of(Rig(effects=effects), family)


def recorded(name: str, numbers: tuple[float, ...], *families: str):
    return [played(name, family, numbers) for family in families]


def test_a_hold_of_many_times_the_brakes_friction_is_found():
    torque, time = 0.2, 1.0
    setting, base = setting_of(
        *recorded("dwell_stiction", (torque, time), "random steps", "square")
    )
    found = best_at_rest(linearised_at(setting, base), Named(LIBRARY["dwell_stiction"]))
    assert found is not None
    # The rig has not followed yet; from there the two do.
    fit = polished(setting, added(setting, base, found[0]))
    hold, whole = (q[0] * (1.0 - math.exp(-1.0 / q[1])) for q in (fit.terms[0].q, (torque, time)))
    assert hold == pytest.approx(whole, rel=0.4)


def test_a_string_of_inertia_is_found_though_its_likelihood_has_many_peaks():
    frequency, damping = 0.88, 0.075
    samples = recorded("string_inertia", (frequency, damping), "random steps", "sines")
    setting, base = setting_of(*samples)
    ground = linearised_at(setting, base)
    (found,) = descended(ground, [LIBRARY["string_inertia"]], [], lambda text: None)
    assert found.term.q[0] == pytest.approx(frequency, rel=0.03)
    assert found.gain > 1000.0
    # Beside it, what explains one recording far worse is not tried on both.
    gear = [LIBRARY["gear_compliance"]]
    assert descended(ground, gear, [found], lambda text: None) == [found]


def test_what_the_best_name_is_taken_for_is_tried_too():
    setting, base = setting_of(*recorded("gear_compliance", (23.5, 0.35, 0.02, 0.05), "chirp"))
    source = Named(LIBRARY["gear_compliance"])
    fit = added(setting, base, Term(source, np.array([23.5, 0.35, 0.02, 0.05])))
    best = attempted(base, polished(setting, fit))
    peaked = [effect for effect in LIBRARY.values() if has_peaks(effect)]
    asked = [effect.id for effect in confused_with([best], peaked)]
    assert "gear_backlash" in asked
    assert "string_inertia" not in asked and "gear_compliance" not in asked


def test_all_recordings_choose_among_the_peaks_of_the_worst_one(monkeypatch):
    frequency, damping = 0.88, 0.075
    samples = recorded("string_inertia", (frequency, damping), "random steps", "sines")
    setting, base = setting_of(*samples)
    source = Named(LIBRARY["string_inertia"])

    def misled(one, fit, source, grid, goal):
        wrong, near = (
            added(one, fit, Term(source, np.array([f, damping]))) for f in (5.0, 1.05 * frequency)
        )
        # As if far-off numbers fitted the one recording best.
        return replace(wrong, value=goal - 1e6), [near]

    monkeypatch.setattr(grid_starts, "_best_alone", misled)
    (found,) = descended(linearised_at(setting, base), [source.effect], [], lambda text: None)
    assert found.term.q[0] == pytest.approx(frequency, rel=0.03)


def test_no_descent_begins_where_the_filter_breaks_down():
    setting, base = setting_of(*recorded("string_inertia", (0.88, 0.075), "sines"))
    broken = replace(base, value=math.inf, gradient=np.full_like(base.gradient, np.nan))
    assert descend_until(setting, broken, limit=3, enough=1.0, only=None) == (broken, True)


def test_a_score_is_the_gain_of_a_newton_step_of_the_fit():
    # Beside a second spring from so small a twist the string could take back what that does: but
    # for what was believed of the string, the two grow against each other as far as they like.
    setting, base = setting_of(*recorded("string_second_spring", (0.2, 1.0), "random steps"))
    source = Named(LIBRARY["string_second_spring"])
    scored = best_point(linearised_at(setting, base), source, [np.array([0.005, 0.01])])
    assert scored is not None
    fit = added(setting, base, Term(source, np.array([0.0, 0.01])))
    rig = len(setting.coordinates.free)
    g, h = fit.gradient[: rig + 1], fit.information[: rig + 1, : rig + 1]
    step = np.linalg.solve(h, g)
    alone = g[:rig] @ np.linalg.solve(h[:rig, :rig], g[:rig])
    assert scored.gain == pytest.approx(g @ step - alone, rel=0.02)
    assert scored.term.q[0] == pytest.approx(step[-1], rel=0.02)


def test_all_recordings_that_rest_say_where_a_hold_begins():
    # The one that is asked first, as it rests no less than the others, holds five times as hard.
    samples = [
        *recorded("dwell_stiction", (0.0217, 1.76), "square"),
        *recorded("dwell_stiction", (0.004, 1.76), "square", "square"),
    ]
    setting, base = setting_of(*samples)
    linearised, source = linearised_at(setting, base), Named(LIBRARY["dwell_stiction"])
    found = best_at_rest(linearised, source)
    assert found is not None and found[1] > 0.0
    # Where others explain far more, they are not asked.
    assert best_at_rest(linearised, source, 100.0 * found[1]) is None


@pytest.mark.parametrize("peak", [(0.3, 1.0, -2.0, 0.0, 1.0), (-3.0, -1.0, 2.0, 1.0, 0.0)])
def test_the_peak_of_a_dense_grid_is_found_by_half_of_its_points(peak):
    axes = [np.linspace(-4.0, 4.0, n) for n in (10, 3, 4, 2, 2)]
    grid = [np.array(point) for point in itertools.product(*axes)]
    # Two numbers that make up for each other, as a frequency and a stiffness do.
    bent = np.eye(5)
    bent[0, 2] = bent[2, 0] = 0.6

    def gains(points):
        asked.extend(points)
        return [float(-(q - peak) @ bent @ (q - peak)) for q in points]

    asked = []
    told = gains_over(grid, gains)
    assert len(asked) < 0.5 * len(grid)
    assert int(np.argmax(told)) == int(np.argmax(gains(grid)))


def test_what_a_free_shape_explains_best_is_asked_of_gears_too(monkeypatch):
    # A gear's twist poses as noise, and no longer does beside a name that takes part of it.
    posed = iter([{"tau_l": 0.1}])
    monkeypatch.setattr("drill_env.diagnosis.search.unusual", lambda *at: next(posed, {}))
    runout = {"id": "brake_runout", "runout": 0.005, "phase": 2.4, "order": 1.0}
    gear = {
        "id": "gear_compliance", "frequency": 24.0, "motor_share": 0.09, "friction_share": 0.05,
        "damping": 0.045,
    }  # fmt: skip
    samples = [both(runout, gear, family=family) for family in FAMILIES]
    setting, base = setting_of(*samples)
    effects = [LIBRARY["brake_runout"], LIBRARY["gear_compliance"]]
    found = search(setting, base, effects, lambda text: None)
    assert found.shapes
    assert found.named[0].term.id == "gear_compliance"


def test_while_another_effect_is_to_follow_gears_wait_for_the_first_name(monkeypatch):
    # What leaves the noise unusual may be the second effect: beside the first one it is asked.
    monkeypatch.setattr("drill_env.diagnosis.search.unusual", lambda *at: {"tau_l": 0.1})
    setting, base = setting_of(*recorded("unbalance", (0.02, 1.0), "random steps"))
    effects = [LIBRARY["unbalance"], LIBRARY["gear_compliance"]]

    asked: list[Sequence[str]] = []

    def noted(linearised, effects, done, report):
        asked.append([effect.id for effect in effects])
        return list(done)

    monkeypatch.setattr("drill_env.diagnosis.search.descended", noted)
    for more in (True, False):
        found = search(setting, base, effects, lambda text: None, more=more)
        assert found.named[0].term.id == "unbalance"
    assert asked == [[], ["gear_compliance"]]


def test_a_second_name_that_time_let_be_tried_to_the_end_stays():
    step = {"id": "friction_step", "step": 0.01, "time": 12.0}
    loss = {"id": "string_damping", "damping": 1e-4}
    setting, _ = setting_of(*(both(step, loss, family=family) for family in FAMILIES[:1]))
    effects = [LIBRARY["friction_step"], LIBRARY["string_damping"]]

    def ended(when: str):
        told: list[str] = []

        def report(text: str) -> bool:
            told.append(text)
            return "looking for more" in told and when in told[told.index("looking for more") :]

        found = find(setting.samples, Rig(), setting.coordinates.free, effects, report=report)
        return {term.id for term in found.final.terms}

    assert ended("choosing") == {"friction_step", "string_damping"}
    assert len(ended("comparing what was tried")) == 1
