"""The detective on another maker's recordings, whose answers are beside them."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import pytest

from drill_env import Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.recordings import read_recording

PRACTICE = Path(__file__).resolve().parents[2] / "shared" / "recordings" / "practice"
needs_shared = pytest.mark.skipif(not PRACTICE.is_dir(), reason="no recordings beside the checkout")

PLACES = {"practice-6": ("lower", "theta_l")}


@needs_shared
@pytest.mark.parametrize("name", [f"practice-{i}" for i in range(1, 7)])
def test_practice_set_is_diagnosed(name):
    answer = json.loads((PRACTICE / "answers.json").read_text())[name]
    with warnings.catch_warnings():
        # One recording of each set runs at a constant voltage.
        warnings.simplefilter("ignore")
        fit, held = (
            [read_recording(path) for path in sorted((PRACTICE / name).glob(f"{role}-*.csv.gz"))]
            for role in ("fit", "holdout")
        )
        result = diagnose(fit, Rig(), held).result
    if name in PLACES:
        # A local hard spot that no library has: told where and on what it depends.
        assert result.verdict == "unexplained" and result.located is not None
        assert (result.located.component, result.located.depends_on) == PLACES[name]
        assert result.shape is not None
        return
    assert [effect.id for effect in result.effects][:1] == answer["effects"]
    assert result.verdict == ("missing_physics" if answer["effects"] else "consistent")
