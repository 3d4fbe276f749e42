"""Recordings of light discs on a stiff string are screened by their own rig, not by the paper's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.other_rigs import CASES, Case, Plant, recorded
from drill_env.identification.screening import findings
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording

# Discs that swing at 5, 10 and 19 Hz against each other, and those of the paper at 0.25 Hz. Seen
# below 3 Hz, the torque of the second was of a wrong unit, and that of the third unrelated.
NOISY = 5e-3
STIFF = {
    "drives": CASES["coupled drives"],
    "belt": Case(Plant(k=6.0, noise=NOISY)),
    "shaft": Case(Plant(k=20.0, noise=NOISY), rate=500.0),
}


def run_of(name: str, seed: int = 5) -> Recording:
    return recorded(STIFF[name], seed)


@pytest.mark.parametrize("name", STIFF)
def test_a_sound_recording_gets_no_remark(name: str):
    assert findings(run_of(name), STIFF[name].plant.rig()) == ()


@pytest.mark.parametrize("name", STIFF)
def test_a_wrong_unit_is_still_seen(name: str):
    sound = run_of(name)
    assert sound.u is not None
    wrong = replace(sound, u=1000.0 * sound.u)
    assert [note.code for note in findings(wrong, STIFF[name].plant.rig())] == ["unit"]


def test_a_jump_beyond_what_the_drive_can_do_is_still_seen():
    sound = run_of("shaft")
    assert sound.theta_u is not None
    late = sound.t > 0.5 * sound.t[-1]
    wrong = replace(sound, theta_u=sound.theta_u + 0.3 * late)
    assert "jump" in [note.code for note in findings(wrong, STIFF["shaft"].plant.rig())]


def test_the_drive_of_another_run_is_still_seen():
    one, other = run_of("shaft"), run_of("shaft", 6)
    wrong = replace(one, u=other.u)
    assert findings(wrong, STIFF["shaft"].plant.rig()) != ()


def test_light_discs_may_change_their_speed_fast():
    """Volts that jump give this disc 1500 rad/s^2, the paper's no more than 150."""
    mixer = Plant(km=0.52, Ju=0.012, Tu=0.075, bu=0.4, Jl=0.03, k=6.6, Tl=0.05, bl=0.02)
    times, rig = np.arange(0.0, 12.0, 0.005), mixer.rig()
    u = np.where(np.floor(0.5 * times) % 2 == 0, 17.0, -17.0)
    run = simulate(rig, sampled_voltage(times, u), times[-1], t_eval=times)
    sound = Recording(times, u, run.theta_u, run.theta_l, source="steps")
    assert findings(sound, rig) == ()
    wrong = replace(sound, theta_u=run.theta_u + 0.05 * (times > 4.5))
    assert "jump" in [note.code for note in findings(wrong, rig)]
