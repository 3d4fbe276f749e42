"""The second mode's frequency is found though descents from afar end on another peak."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import Rig
from drill_env.diagnosis.attempts import carried_on, tuned_alike
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.fit_changes import added
from drill_env.diagnosis.in_filter import moved_in
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.resonance import resonates, retuned
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.identification.samples import prepare
from tests.made_recordings import FREE, made
from tests.test_filter_at_rest import played_of

INERTIA = 3e-4
HERTZ = math.sqrt(4.0 * Rig().ktheta / INERTIA) / (2.0 * math.pi)


def test_a_wrong_peak_is_left_for_the_right_one():
    mode = Hidden("string_inertia", {"string_inertia": INERTIA})
    samples = [prepare(made(Rig(), (mode,), (seed,)), Rig()) for seed in (1, 2)]
    setting, base = base_fit(samples, Rig(), FREE)
    start = added(
        setting, base, Term(Named(LIBRARY["string_inertia"]), np.array([1.3 * HERTZ, 5e-3]))
    )
    descended = descend_jointly(setting, start, limit=10, enough=2.0)
    found = retuned(setting, descended)
    assert abs(descended.terms[-1].q[0] - HERTZ) > 0.1
    assert found.terms[-1].q[0] == pytest.approx(HERTZ, rel=0.005)
    assert found.value < descended.value - 20.0


def test_what_has_more_numbers_or_others_is_no_plain_resonance():
    def term(name: str) -> Term:
        return Term(Named(LIBRARY[name]), np.zeros(len(LIBRARY[name].parameters)))

    plain = {"string_inertia", "drive_resonance"}
    assert {name for name in LIBRARY if resonates(term(name))} == plain


def test_a_resonance_as_wide_as_the_walk_has_one_peak():
    # At half of critical damping it dies out within its period: from either end of the walk a
    # descent comes to the same value, and none is walked.
    mode = Hidden("string_damping", {"damping": 1e-4})
    setting, base = base_fit([prepare(made(Rig(), (mode,), (1,)), Rig())], Rig(), FREE)
    starts = [
        added(setting, base, Term(Named(LIBRARY["string_inertia"]), np.array([20.0 * share, 0.5])))
        for share in (math.exp(-0.4), 1.0, math.exp(0.4))
    ]
    ends = [descend_jointly(setting, start, limit=15, enough=0.5).value for start in starts]
    assert ends[0] == pytest.approx(ends[1], abs=2.0)
    assert ends[2] == pytest.approx(ends[1], abs=2.0)
    assert retuned(setting, starts[1]) is starts[1]


def test_a_string_with_inertia_is_found_from_the_frequency_of_a_resonator():
    """Its peak is a five hundredth of its frequency wide: the grid of frequencies missed it."""
    numbers = {"frequency": 2.37, "damping": 0.002}
    rig = Rig(effects=({"id": "string_inertia", **numbers},))
    setting, fit = base_fit((played_of(rig, "chirp"),), Rig(), ["Jl", "ktheta", "Tsl"])
    term = Term(Named(LIBRARY["lower_resonator"]), np.array([2.33, 0.03, 0.004]))
    inside = moved_in(setting, added(setting, fit, term))
    first = carried_on(setting, fit, inside, 2)
    effects = [LIBRARY["string_inertia"], LIBRARY["lower_resonator"], LIBRARY["unbalance"]]
    best, second = tuned_alike(setting, fit, [first], effects)
    assert (best.term.id, second.term.id) == ("string_inertia", "lower_resonator")
    assert best.gain > first.gain + 100.0
    assert abs(best.term.q[0] - numbers["frequency"]) < 0.05
