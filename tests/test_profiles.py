"""Profiles of the likelihood over numbers of effects within the filter."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from drill_env import Rig
from drill_env.diagnosis import in_filter
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import value_at
from drill_env.diagnosis.fit import Fit, Setting
from drill_env.diagnosis.fit_changes import added
from drill_env.diagnosis.intervals import numbers_of
from drill_env.diagnosis.joint import LAST_ROUNDS, WORTH_A_ROUND, descend_jointly
from drill_env.diagnosis.profiles import interval_ends
from drill_env.diagnosis.terms import Named, Term
from drill_env.effects import LIBRARY
from drill_env.identification.coordinates import inverse
from tests.test_filter_at_rest import NUMBERS, played, played_of

RUNOUT = Rig(effects=({"id": "brake_runout", "runout": 0.02, "phase": 1.0, "order": 1.0},))
CHI_95 = 3.841459
"""What minus twice the log likelihood rises by at the ends of a 95 % interval (Wilks)."""


def fitted(name: str, numbers: tuple[float, ...], free: list[str]) -> tuple[Setting, Fit]:
    """A fit, from these numbers on, to recordings with the library's usual ones."""
    samples = [played(name, family) for family in ("ramp", "chirp")]
    samples = [replace(s, spreads=np.zeros_like(s.spreads)) for s in samples]
    setting, base = base_fit(samples, Rig(), free)
    term = Term(Named(LIBRARY[name], within=True), np.array(numbers))
    return setting, added(setting, base, term)


def test_what_the_readings_are_linear_in_has_the_interval_of_its_curvature():
    """A plain quadratic likelihood: Gauss-Newton's covariance is exact."""
    samples = played("upper_stribeck", "ramp")
    setting, base = base_fit((samples,), Rig(), ["Tsl"])
    term = Term(Named(LIBRARY["lower_asymmetry"], within=True), np.array([0.001]))
    fit = descend_jointly(setting, added(setting, base, term), limit=LAST_ROUNDS, enough=1e-3)
    ends, better = interval_ends(setting, fit)
    deviation = math.sqrt(inverse(fit.information)[-1, -1])
    assert better is None
    assert ends == pytest.approx(1.959964 * deviation * np.ones((1, 2)), rel=0.1)


def test_at_its_ends_the_readings_are_as_improbable_as_another_solver_says():
    samples = replace(played_of(RUNOUT, "ramp"), spreads=np.zeros((1, 5)))
    setting, base = base_fit((samples,), Rig(), ["Tsl"])
    term = Term(Named(LIBRARY["brake_runout"], within=True), np.array([0.02, 1.0, 1.0]))
    fit = in_filter.within_filter(setting, added(setting, base, term))
    assert fit.ends is not None
    for column, sign in enumerate((-1.0, 1.0)):
        order = fit.terms[0].q[2] + sign * fit.ends[2, column]

        def rise(other: np.ndarray, order: float = order) -> float:
            size, phase, *vector = other / 1e3
            term = Term(fit.terms[0].source, np.array([0.02 + size, 1.0 + phase, order]))
            point = (fit.vector + vector, (term,), fit.noise, fit.starts, fit.motions)
            return value_at(setting, *point) - fit.value

        start = np.zeros(2 + len(fit.vector))
        lowest = minimize(rise, start, method="Nelder-Mead", options={"maxfev": 600})
        assert lowest.fun == pytest.approx(CHI_95, rel=0.15)


def test_a_number_that_leads_on_where_the_slopes_say_none_is_followed():
    """Of a concealed case the numbers ended 70 deviations off and 39 less likely, once."""
    setting, fit = fitted("lower_stribeck", (0.018, 0.15), ["Tsl", "T1", "T2", "beta1"])
    fit = in_filter.probed(setting, fit)
    halted = descend_jointly(setting, fit, limit=LAST_ROUNDS, enough=WORTH_A_ROUND)
    halted = in_filter.probed(setting, halted)
    found = in_filter.within_filter(setting, fit)
    deviations = np.sqrt(np.diag(inverse(halted.information)))[-2:]
    true = np.array(NUMBERS["lower_stribeck"])
    assert (abs(halted.terms[0].q - true) > 3.0 * deviations).any()
    assert found.value < halted.value - WORTH_A_ROUND
    told = numbers_of(found, found.terms[0]).values()
    assert all(n.low < value < n.high for n, value in zip(told, true.tolist(), strict=True))


def test_a_number_of_which_the_slopes_tell_nothing_has_no_end():
    setting, fit = fitted("lower_stribeck", (0.0235, 0.2), ["Tsl"])
    information = fit.information.copy()
    information[-2:] = information[:, -2:] = 0.0
    ends, better = interval_ends(setting, replace(fit, information=information))
    assert better is None
    assert (ends == 0.0).all()
