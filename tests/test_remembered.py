"""What no effect and no function of one coordinate shows is still seen in what an axis leaves."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.axis_maker import draw, recorded
from drill_env import Rig
from drill_env.diagnosis import by_prediction
from drill_env.diagnosis.motion_features import _beyond_play
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.recordings import Recording


@pytest.mark.parametrize(
    ("term", "coordinate"), [("drive hysteresis", "voltage"), ("nothing", None)]
)
def test_a_drive_that_remembers_is_told_though_nothing_on_offer_shows_it(
    term, coordinate, monkeypatch
):
    rng = np.random.default_rng([1, 99])
    axis = draw(term, rng)
    made = [recorded(axis, rng) for _ in range(4)]
    runs = [Recording(**{k: v for k, v in m.items() if k != "step"},
                      quanta={"theta_u": m["step"]}) for m in made]  # fmt: skip
    monkeypatch.setattr(by_prediction, "candidates_for", lambda *given, **options: [])
    options = DiagnosisOptions(given_rig=True, doubt=0.1)
    rig = Rig.one_inertia(**axis.given)
    result = by_prediction.diagnose_by_prediction(runs[:2], rig, runs[2:], options).result
    assert result.fit.get("predictable_from") == coordinate
    told = any("without any law" in line for line in result.sentences)
    assert told == (coordinate is not None)
    assert (result.verdict == "unexplained") == told


def test_play_tells_the_side_that_a_value_came_from():
    rising, falling = np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.0, 50)
    left = _beyond_play(np.concatenate([rising, falling]), 0.1)
    # The same value, 0.5, once on the way up and once down.
    assert left[25] == pytest.approx(0.1) and left[75] == pytest.approx(-0.1)
