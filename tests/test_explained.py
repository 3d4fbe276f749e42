"""A name that leaves most of the unseen error stands in for something else."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drill_env.diagnosis.explained import explained_share, that_explain
from drill_env.diagnosis.rounds import Found
from drill_env.diagnosis.strikes import Once
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.identification.noise import NoiseModel
from drill_env.prediction.criteria import Criteria

SENSOR = 1e-4


def found_with(*names: str) -> Found:
    terms = tuple(Term(Named(LIBRARY[n]), np.zeros(0)) for n in names)
    noise = NoiseModel(encoder_u=SENSOR, encoder_l=SENSOR)
    final: Any = SimpleNamespace(terms=terms, noise=noise)
    base: Any = SimpleNamespace(terms=(), noise=noise)
    setting: Any = None
    return Found(setting, base, (), final)


def judged_with(rms: float, times: Sequence[float] = (1.0,) * 10) -> Any:
    """Errors of one size in ten spans, or of so many times that size in each."""
    error = rms * np.kron(np.reshape(times, (-1, 1)), np.tile([[1.0, -1.0], [-1.0, 1.0]], (5, 1)))
    return SimpleNamespace(
        short=error, measured=np.zeros_like(error), channels=("theta_u", "theta_l"),
        spans=np.arange(0, len(error), 10),
    )  # fmt: skip


def decide(name: str, before: float, after: float, noise: float) -> Found:
    return that_explain(
        found_with(name), [judged_with(before)], [judged_with(after)],
        {"short": [judged_with(noise).short]}, Criteria(),
    )  # fmt: skip


def test_the_share_is_of_what_noise_does_not_give():
    assert explained_share(10.0, 1.0, 1.0) == 1.0
    assert explained_share(11.0, 6.0, 1.0) == pytest.approx(0.5)
    # Hardly more than noise: nothing is told.
    assert explained_share(1.5, 1.4, 1.0) == 1.0
    assert explained_share(1.5, 2.9, 1.0) == 1.0
    # A name with which they err far more than noise and the rig alone is none all the same.
    assert explained_share(1.5, 6.0, 1.0) == pytest.approx(-3.0)
    assert explained_share(4.0, 5.0) == pytest.approx(-0.25)
    # Noise, however large, makes no right model err so much more than the rig alone.
    assert explained_share(1.3, 5.0, 5.5) == 1.0
    assert explained_share(1.3, 5.7, 5.5) == pytest.approx(1.0 - 5.7 / 2.6)


@pytest.mark.parametrize(
    ("before", "after", "noise", "stands"),
    [
        (1e-2, 1e-3, 1e-3, True),
        # A fifth of the squared error may stay, and no more.
        (1e-2, 4.4e-3, 1e-4, True),
        (1e-2, 4.6e-3, 1e-4, False),
        # The torques that the fit takes for noise would give far more error than there is.
        (2e-3, 1.9e-3, 5e-3, False),
        (2e-3, 2e-4, 5e-3, True),
    ],
)
def test_a_name_stands_by_what_it_takes_away_from_unseen_errors(before, after, noise, stands):
    found = decide("lower_resonator", before, after, noise)
    assert bool(found.final.terms) == stands
    assert found.rejected == (() if stands else ("lower_resonator",))
    if noise == 5e-3:
        share = 1.0 - (after**2 - SENSOR**2) / (before**2 - SENSOR**2)
        assert found.explained == pytest.approx(share)


def test_what_one_span_alone_speaks_against_stands_within_its_standard_error():
    spans = np.ones(10)
    spans[3] = 5.0
    before, after = judged_with(1e-2), judged_with(2.6e-3, spans)
    noise = judged_with(1e-4).short
    found = that_explain(
        found_with("lower_resonator"), [before], [after], {"short": [noise]}, Criteria()
    )
    # 0.93 of the squared error goes in nine spans of ten, and none of it in the other one.
    left = (2.6e-3**2 * (9 + 25) / 10 - 1e-8 - SENSOR**2) / (1e-4 - 1e-8 - SENSOR**2)
    assert found.explained == pytest.approx(1.0 - left, abs=1e-3)
    assert found.explained < Criteria().share
    assert found.final.terms


def test_friction_that_most_machines_have_stands_beside_whatever_else_is_missing():
    assert decide("upper_coulomb", 1e-2, 9e-3, 1e-4).final.terms


def test_a_name_with_which_more_is_predicted_wrongly_stands_on_no_scatter():
    """A copied column was called a springy gear: error 1.28 rad where it had been 1.13 rad."""
    spans = np.ones(10)
    spans[3] = 60.0
    before, after = judged_with(1e-2), judged_with(1e-3, spans)
    noise = judged_with(1e-4).short
    found = that_explain(
        found_with("lower_resonator"), [before], [after], {"short": [noise]}, Criteria()
    )
    assert found.explained is not None
    assert found.explained < 0.0
    assert not found.final.terms
    assert "err no less" in str(found.reason)


@pytest.mark.parametrize("after", [1e-3, 9e-3])
def test_what_happened_once_excuses_no_name_beside_it(after):
    """A play in an encoder's coupling was a resonator, since a torque pulse stood beside it."""
    found = found_with("lower_resonator")
    pulse = Term(Once(LIBRARY["torque_pulse"]), np.zeros(0))
    beside = SimpleNamespace(terms=(*found.final.terms, pulse), noise=found.final.noise)
    told = that_explain(
        Found(found.setting, found.base, (), beside), [judged_with(1e-2)], [judged_with(after)],
        {"short": [judged_with(1e-4).short]}, Criteria(),
    )  # fmt: skip
    assert bool(told.final.terms) == (after == 1e-3)
    # Alone nothing is asked of it.
    alone = SimpleNamespace(terms=(pulse,), noise=found.final.noise)
    told = that_explain(
        Found(found.setting, found.base, (), alone), [judged_with(1e-2)], [judged_with(after)],
        {"short": [judged_with(1e-4).short]}, Criteria(),
    )  # fmt: skip
    assert told.explained == 1.0
    assert told.final.terms[0] is pulse
