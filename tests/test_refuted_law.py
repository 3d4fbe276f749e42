"""A friction law that held-out recordings speak against is none."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from drill_env.diagnosis import diagnose as module
from drill_env.diagnosis.law import LawFit
from drill_env.diagnosis.rounds import Found


@pytest.mark.parametrize(("error", "stays"), [(2.0, False), (0.3, True)])
def test_a_friction_law_with_which_all_is_predicted_far_worse_is_none(monkeypatch, error, stays):
    """A blind maker's stribeck rig was given a hump: 5 s predictions erred seven times as far."""
    nothing = np.zeros((4, 2))
    setting = SimpleNamespace(samples=[SimpleNamespace(release=1.0)], jitter=0.0)
    plain, humped = (
        Found(setting, SimpleNamespace(bic=bic), (), SimpleNamespace(bic=bic, terms=()))
        for bic in (0.0, -500.0)
    )

    def judge_all(held, setting, fit):
        short = nothing + (error if fit is humped.final else 1.0)
        return [SimpleNamespace(value=0.0, short=short, measured=nothing)]

    monkeypatch.setattr(module, "judge_all", judge_all)
    monkeypatch.setattr(module, "errors_by_noise", lambda *args: {})
    monkeypatch.setattr(module, "follow", lambda judged: True)
    monkeypatch.setattr(module, "only_if_they_follow", lambda found, before, after: found)
    monkeypatch.setattr(module, "cleaned", lambda held, jitter: [SimpleNamespace(release=1.0)])
    monkeypatch.setattr(module, "replace", lambda samples, **changes: samples)
    law = LawFit(setting, plain.base, humped, 500.0)
    kept, unseen, _ = module._held_out(plain, law, [], 0)
    assert (kept, unseen.found) == ((law, humped) if stays else (None, plain))
