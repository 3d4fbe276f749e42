"""A search with the humped law is made where recordings ask for that law, and is spared else."""

from __future__ import annotations

import numpy as np
import pytest

import drill_env.diagnosis.law as law
from drill_env import Rig
from drill_env.diagnosis.law import law_fit
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.search import find
from drill_env.identification.samples import prepare
from drill_env.integrator import sampled_voltage, simulate
from drill_env.recordings import Recording
from tests.made_recordings import STEP, made

COULOMB = Rig(friction="coulomb", Tsl=0.06, bl=0.006)


def of_coulomb(seed: int) -> Recording:
    """A rig with a plain brake, its volts held for a second and a little shaken."""
    rng = np.random.default_rng(seed)
    t = np.arange(5000) / 200.0
    u = rng.uniform(-4.0, 4.0, 25)[(t + 1e-9).astype(int)]
    shaken = sampled_voltage(t, u + rng.normal(0.0, 0.01, len(t)))
    run = simulate(COULOMB, shaken, t[-1], t_eval=t)
    read = [np.round(angle / STEP) * STEP for angle in (run.theta_u, run.theta_l)]
    return Recording(t, u, *read, quanta={"theta_u": STEP, "theta_l": STEP}, source=f"c-{seed}")


@pytest.mark.parametrize(
    ("made_by", "asked"),
    [(lambda: [made(Rig.paper(), (), (8, i)) for i in range(2)], True),
     (lambda: [of_coulomb(i) for i in range(2)], False)],
    ids=["humped", "coulomb"],
)  # fmt: skip
def test_a_search_with_the_humped_law_is_made_where_it_is_asked_for(made_by, asked, monkeypatch):
    rig = COULOMB if not asked else COULOMB.replace(Tsl=0.01)
    samples = [prepare(recording, rig) for recording in made_by()]
    plain = find(samples, rig, free_parameters(rig), (), most=0)
    searches = []

    def searched(*args, **options):
        searches.append(args)
        return find(*args, **options)

    monkeypatch.setattr(law, "find", searched)
    found = law_fit(samples, rig, plain, (), 0, lambda text: None)
    assert len(searches) == asked
    assert (found is not None) == asked
    if found is not None:
        assert found.gain > 1000.0 and found.found.final.rig.friction == "humped"
