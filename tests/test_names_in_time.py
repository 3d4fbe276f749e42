"""What a search by windows says of a second name when its time ends."""

from __future__ import annotations

import pytest

from drill_env.diagnosis import by_prediction
from drill_env.diagnosis.by_prediction import diagnose_by_prediction
from drill_env.diagnosis.options import DiagnosisOptions
from tests.test_window_starts import AXIS, COULOMB, LEVER, axis_run

NAMES = ("upper_unbalance", "upper_coulomb", "upper_stribeck", "motor_fade")


def test_a_second_name_is_none_before_its_rivals_were_tried(monkeypatch: pytest.MonkeyPatch):
    every = by_prediction.candidates_for
    monkeypatch.setattr(
        by_prediction, "candidates_for",
        lambda *given, **options: [c for c in every(*given, **options) if c.id in NAMES],
    )  # fmt: skip
    runs = [axis_run(n, seconds=4.0, weight=LEVER, coulomb=COULOMB)[0] for n in (1, 2, 3, 4)]
    options = DiagnosisOptions(given_rig=True, most=2)

    def named(after: str) -> tuple[list[str], list[str]]:
        """What is found if time ends with the second trial after something was told."""
        told: list[str] = []

        def report(text: str) -> bool:
            told.append(text)
            since = told[told.index(after) :] if after in told else []
            return sum(one.startswith("trying") for one in since) > 1

        found = diagnose_by_prediction(runs[:2], AXIS, runs[2:], options, report).result
        return [effect.id for effect in found.effects], told

    both, told = named("never")
    assert set(both) == {"upper_unbalance", "upper_coulomb"}
    assert sum(text.startswith("trying") for text in told[told.index("looking for more") :]) > 1
    one, _ = named("looking for more")
    assert len(one) == 1 and one[0] in both
    # Where both were found, a comparison that is not made to its end takes neither away.
    kept, _ = named("choosing each beside the others")
    assert set(kept) == set(both)
