"""The driven disc is diagnosed alone though the whole rig used up its own time."""

from __future__ import annotations

import math

import numpy as np
import pytest

import drill_env.diagnosis.diagnose as within
from benchmarks.rig_maker import quasi_random
from drill_env import Rig, _watch
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.recordings import Recording

RATE, SECONDS, WITHIN = 50.0, 12.0, 40
RIG = Rig().replace(km=1.0, Ju=0.4, bu=0.8, ktheta=4.0, Tsu=0.0, dTsu=0.0)
COULOMB = 1.2
# Time in s that each thing takes which is tried of the whole rig.
SLOW = 5.0


def moved_by_hand(seed: int) -> Recording:
    """The lower end moved as no disc on a brake does, the upper disc on it rubbing besides."""
    rng = np.random.default_rng(seed)
    torque = quasi_random(rng, SECONDS, RATE, 4.0)
    rows = len(torque)
    hand = 2.0 * np.cumsum(quasi_random(rng, SECONDS, RATE, 1.0)[:rows]) / RATE
    angle = speed = 0.0
    angles, step = np.zeros(rows), 1.0 / (RATE * WITHIN)
    for k in range(rows):
        angles[k] = angle
        for i in range(WITHIN):
            end = hand[k] + (hand[min(k + 1, rows - 1)] - hand[k]) * i / WITHIN
            load = torque[k] - RIG.ktheta * (angle - end) - RIG.bu * speed
            resting = speed == 0.0 and abs(load) <= COULOMB
            new = speed + step * (load - math.copysign(COULOMB, speed or load)) / RIG.Ju
            speed = 0.0 if resting or new * speed < 0.0 else new
            angle += step * speed
    read = np.column_stack([angles, hand]) + rng.normal(0.0, 3e-4, (rows, 2))
    t = np.arange(rows) / RATE
    return Recording(t, torque, read[:, 0], read[:, 1], drive="torque", source=f"run-{seed}")


def test_the_driven_disc_has_time_of_its_own(monkeypatch: pytest.MonkeyPatch):
    told: list[str] = []

    def seconds() -> float:
        alone = told.index("reading the motion") if "reading the motion" in told else len(told)
        return SLOW * alone

    monkeypatch.setattr(_watch, "stopwatch", lambda: seconds)
    runs = [moved_by_hand(seed) for seed in range(3)]
    found = diagnose(
        runs[:2], RIG, runs[2:], options=DiagnosisOptions(given_rig=True, doubt=0.1, seconds=120.0),
        report=told.append,
    ).result  # fmt: skip
    assert found.complete
    assert [e.id for e in found.effects] == ["upper_coulomb"]
    assert found.effects[0].parameters["torque"].value == pytest.approx(COULOMB, rel=0.1)


class Ended(Exception):
    """The search was told to end."""


@pytest.mark.parametrize(("leads", "seconds"), [(False, 45), (True, 90)])
def test_once_a_name_leads_the_whole_rig_has_all_of_the_search_time(monkeypatch, leads, seconds):
    """Of two effects with a measured torque the second was left out on a slow machine."""
    told: list[str] = []
    monkeypatch.setattr(_watch, "stopwatch", lambda: lambda: float(len(told)))

    def find(setting, base, effects, most, report, named):
        for _ in range(10):
            assert not report("trying")
        if leads:
            named()
        while not report("looking for more"):
            pass
        raise Ended

    monkeypatch.setattr(within, "cleaned_base", lambda *given: (None, None))
    monkeypatch.setattr(within, "find_beside", find)
    runs = [moved_by_hand(seed) for seed in range(2)]
    with pytest.raises(Ended):
        diagnose(
            runs[:1], RIG, runs[1:], options=DiagnosisOptions(seconds=120.0), report=told.append
        )
    assert len(told) == seconds + 1
