"""A motor's current that leads into an angle: read before the next voltage acts, told as such."""

from __future__ import annotations

import numpy as np
import pytest

from drill_env import Rig
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording
from tests.made_recordings import STEP

PER_VOLT = 0.004
# Lost counts jump, too.
OPTIONS = DiagnosisOptions(
    leave_out=tuple(n for n in LIBRARY if n != "missed_counts_upper"), most=1
)


def crossed(seed: int) -> Recording:
    """The paper's rig, its upper reading off by a multiple of the voltage that acts until then."""
    rng = np.random.default_rng([93, seed])
    t = np.arange(4000) / 200.0
    u = np.repeat(rng.uniform(1.0, 5.0, 40), 100)
    run = simulate(Rig(), sampled_voltage(t, u), float(t[-1]), t_eval=t)
    upper = run.theta_u + PER_VOLT * np.append(u[:1], u[:-1])
    read = [np.round(angle / STEP) * STEP for angle in (upper, run.theta_l)]
    return Recording(t, u, *read, quanta={"theta_u": STEP, "theta_l": STEP}, source=f"x-{seed}")


@pytest.fixture(scope="module")
def found():
    runs = [crossed(seed) for seed in range(3)]
    return diagnose(runs[:2], Rig(), runs[2:], options=OPTIONS).result


def test_it_is_an_error_of_the_reading_over_the_voltage(found):
    assert found.verdict == "unexplained" and not found.effects
    assert (found.located.component, found.located.depends_on) == ("sensor", "voltage")


def test_its_slope_is_what_a_volt_adds(found):
    slope = np.polyfit(found.shape.knots, found.shape.values, 1)[0]
    assert slope == pytest.approx(PER_VOLT, rel=0.05)
