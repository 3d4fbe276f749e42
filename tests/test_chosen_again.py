"""What was found first is chosen once more beside what was found later."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drill_env.prediction import decide
from drill_env.prediction.compare import Row, row_of
from drill_env.prediction.criteria import Criteria
from drill_env.prediction.search import Round, Tried

RECORDINGS = (0, 1, 2, 3, 4, 5)


def row(name: str, gain: float, scatter: float) -> Row:
    """Of one window in each of six recordings."""
    signs = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
    return row_of(name, 1, (gain / 6.0 + scatter * signs)[:, np.newaxis], RECORDINGS)


def tried(name: str, gain: float, scatter: float, *, common: bool = False) -> Tried:
    told: Any = SimpleNamespace(
        id=name, component="upper", depends_on="theta_u", at_end=lambda z: False,
        effect=SimpleNamespace(common=common),
    )  # fmt: skip
    fit: Any = SimpleNamespace(candidates=(told,), numbers=(np.zeros(1),), name=name)
    return Tried(told, (fit,), row(name, gain, scatter))


def test_what_was_not_clear_while_more_was_missing_is_asked_again(monkeypatch: pytest.MonkeyPatch):
    """A servo's weight was no clear gain before its friction was found, a spring was."""
    spring, weight = (
        tried("upper_spring", 75.0, 2.0),
        tried("upper_unbalance", 57.0, 40.0, common=True),
    )
    friction = tried("upper_load_friction", 75.0, 2.0)
    criteria = Criteria()
    first = decide.decided(Round((), (spring, weight), ()), criteria)
    second = decide.decided(Round((), (friction,), ()), criteria)
    assert first.chosen is not None and first.chosen.candidate.id == "upper_spring"
    clear = {
        "upper_spring": tried("upper_spring", 113.0, 2.0),
        "upper_unbalance": tried("upper_unbalance", 112.0, 2.0, common=True),
        "upper_load_friction": friction,
    }

    def searched(folds: Any, before: Any, candidates: Any, report: Any) -> Round:
        return Round((), tuple(clear[c.id] for c in candidates), ())

    monkeypatch.setattr(decide, "searched", searched)
    beside = [[friction.candidate], [clear["upper_unbalance"].candidate]]
    monkeypatch.setattr(
        decide, "without_first", lambda here: (SimpleNamespace(candidates=beside.pop(0)),)
    )
    kept, _ = decide._again((), (first, second), (), criteria, lambda text: False)
    told = [c.chosen.candidate.id for c in kept if c.chosen is not None]
    assert told == ["upper_unbalance", "upper_load_friction"]


def test_a_name_is_not_chosen_beside_itself(monkeypatch: pytest.MonkeyPatch):
    """Two curves of one kind may fit a third better than two of different kinds."""
    falls, gaussian = tried("upper_stribeck", 75.0, 2.0), tried("upper_gaussian", 80.0, 2.0)
    criteria = Criteria()
    first = decide.decided(Round((), (falls,), ()), criteria)
    second = decide.decided(Round((), (gaussian,), ()), criteria)
    first = replace(first, found=Round((), (falls, gaussian), ()))
    every = {t.candidate.id: t for t in (falls, gaussian)}
    beside = [[gaussian.candidate], [falls.candidate]]
    monkeypatch.setattr(
        decide, "searched",
        lambda folds, before, given, report: Round((), tuple(every[c.id] for c in given), ()),
    )  # fmt: skip
    monkeypatch.setattr(
        decide, "without_first", lambda here: (SimpleNamespace(candidates=beside.pop(0)),)
    )
    kept, _ = decide._again((), (first, second), (), criteria, lambda text: False)
    told = [c.chosen.candidate.id for c in kept if c.chosen is not None]
    assert told == ["upper_stribeck", "upper_gaussian"]
