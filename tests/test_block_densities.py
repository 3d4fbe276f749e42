"""Densities of innovations do not go by how large the filter takes its noise to be."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from drill_env.diagnosis import block_densities as module
from drill_env.diagnosis.block_densities import block_densities

DEGREES, ROWS = 4.0, 20000


def told(innovation: np.ndarray, variance: float) -> SimpleNamespace:
    shape = np.full(innovation.shape, variance)
    return SimpleNamespace(
        innovation=innovation, variance=shape, standardised=innovation / np.sqrt(shape)
    )


@pytest.mark.parametrize("disturbed", [1.0, 3.0])
@pytest.mark.parametrize("heavy", [False, True])
def test_an_error_of_the_filters_noise_gains_and_costs_nothing(monkeypatch, heavy, disturbed):
    draw = stats.t(DEGREES) if heavy else stats.norm()
    fitted, unseen = (
        size * draw.rvs((ROWS, 2), random_state=np.random.default_rng(seed))
        for seed, size in ((1, 1.0), (2, disturbed))
    )
    samples = SimpleNamespace(t=np.arange(ROWS) / 1000.0, angles=unseen)

    def nats(variance: float) -> float:
        fit = SimpleNamespace(traces=(told(fitted, variance),))
        path = SimpleNamespace(trace=told(unseen, variance))
        monkeypatch.setattr(module, "followed", lambda *given: (None, None, path))
        return float(block_densities(samples, None, fit, DEGREES).sum())

    right = nats(1.0)
    # By the deviations of a normal, 2 % less noise was worth more than all that lists a name.
    assert nats(0.96) == pytest.approx(right, abs=1e-6)
    assert nats(4.0) == pytest.approx(right, abs=1e-6)
    if heavy:
        constant = stats.t(DEGREES).logpdf(0.0) * 2 * ROWS
        truth = stats.t(DEGREES, scale=disturbed).logpdf(unseen).sum() - constant
        # One scale is estimated for each reading.
        assert right == pytest.approx(truth, abs=3.0)


def test_each_fit_is_asked_once_of_each_recording(monkeypatch):
    asked = []

    def densities(samples, setting, fit, degrees):
        asked.append((fit, samples))
        return np.full(samples, float(fit))

    monkeypatch.setattr(module, "block_densities", densities)
    held = module.HeldOut((2, 1), None, DEGREES)  # type: ignore[arg-type]
    held.ask([7, 8, 7])  # type: ignore[list-item]
    assert held.blocks(8).tolist() == [8.0] * 3  # type: ignore[arg-type]
    assert held.blocks(7).tolist() == [7.0] * 3  # type: ignore[arg-type]
    assert held.blocks(9).tolist() == [9.0] * 3  # type: ignore[arg-type]
    assert sorted(asked) == [(fit, n) for fit in (7, 8, 9) for n in (1, 2)]
    alone = module.HeldOut((), None, DEGREES)  # type: ignore[arg-type]
    assert alone.blocks(7).size == 0  # type: ignore[arg-type]
