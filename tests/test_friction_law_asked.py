"""A search with the humped law is made where recordings ask for that law, and is spared else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import drill_env.diagnosis.humped_law as humped_law
import drill_env.diagnosis.law as law
from drill_env import Rig
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.find import find, find_beside
from drill_env.diagnosis.humped_law import nearest_of_law
from drill_env.diagnosis.law import find_with_laws, law_fit
from drill_env.diagnosis.offered import free_parameters
from drill_env.diagnosis.rounds import Found
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


def times(rig: Rig, factor: float) -> Rig:
    """The same motion of a machine with so many times the torque."""
    torques = ("km", "Ju", "Tsu", "dTsu", "bu", "dbu", "Jl", "ktheta", "Tsl", "bl")
    return rig.replace(**{name: factor * getattr(rig, name) for name in torques})


@pytest.mark.parametrize(
    ("made_by", "factor", "asked"),
    [(lambda: [made(Rig.paper(), (), (8, i)) for i in range(2)], 1.0, True),
     (lambda: [made(Rig.paper(), (), (8, i)) for i in range(2)], 300.0, True),
     (lambda: [of_coulomb(i) for i in range(2)], 1.0, False)],
    ids=["humped", "humped, a larger machine", "coulomb"],
)  # fmt: skip
def test_a_search_with_the_humped_law_is_made_where_it_is_asked_for(
    made_by, factor, asked, monkeypatch
):
    rig = times(COULOMB if not asked else COULOMB.replace(Tsl=0.01), factor)
    samples = [prepare(recording, rig) for recording in made_by()]
    plain = find(samples, rig, free_parameters(rig), (), most=0)
    searches, fits = [], []

    def searched(setting, base):
        searches.append(base)
        return find_beside(setting, base, (), 0, lambda text: None)

    def fitted(*args):
        fits.append(args)
        return base_fit(*args)

    monkeypatch.setattr(humped_law, "base_fit", fitted)
    found, own = law_fit(plain, searched, lambda text: None)
    assert own is plain
    assert len(searches) == len(fits) == asked
    assert (found is not None) == asked
    if found is not None:
        assert found.gain > 1000.0 and found.found.final.rig.friction == "humped"


def test_a_law_that_bends_to_no_hump_is_the_rigs_own():
    speeds = np.linspace(0.05, 8.0, 200)
    flat = Rig.paper().replace(T1=0.0, T2=0.0, Tsl=0.2, bl=0.03)
    near = nearest_of_law(flat, COULOMB, speeds)
    assert near is not None and near.friction == "coulomb"
    assert (near.Tsl, near.bl) == pytest.approx((0.2, 0.03))
    falling = COULOMB.replace(friction="stribeck", T1=-0.04, beta1=2.0)
    assert nearest_of_law(falling.replace(friction="humped"), COULOMB, speeds) is None
    assert nearest_of_law(Rig.paper(), COULOMB, speeds) is None
    assert nearest_of_law(Rig.paper(), falling, speeds) is None


def test_a_better_fit_is_kept_under_the_rigs_own_law():
    """The search with the simpler law ended badly, and the other one found a law without a hump."""
    samples = [prepare(of_coulomb(i), COULOMB) for i in range(2)]
    plain = find(samples, COULOMB, free_parameters(COULOMB), (), most=0)
    end, setting = plain.final, plain.setting
    vector = setting.coordinates.vector(end.rig.replace(Tsl=1.2 * end.rig.Tsl))
    spoilt = evaluate(setting, vector, (), end.noise, end.starts, end.motions)
    assert spoilt.bic > end.bic + 100.0

    def flat(there, base):
        law = base.rig.replace(**{n: getattr(end.rig, n) for n in setting.coordinates.free})
        at = there.coordinates.vector(law.replace(T1=1e-7, T2=-1e-7))
        fit = evaluate(there, at, (), end.noise, end.starts, end.motions)
        return replace(plain, setting=there, base=fit, final=fit)

    bad = replace(plain, base=spoilt, final=spoilt)
    found, own = law_fit(bad, flat, lambda text: None)
    assert found is None
    assert own.final.rig.friction == "coulomb"
    assert own.final.bic == pytest.approx(end.bic, abs=5.0)


@pytest.mark.parametrize(("left", "laws"), [(99.0, ["humped", "coulomb"]), (1.0, ["humped"])])
def test_where_the_humped_law_leads_it_is_searched_first(left, laws, monkeypatch):
    """On a slow machine the search with a wrong law of the brake took all the time."""
    rig = COULOMB.replace(Tsl=0.01)
    samples = [prepare(made(Rig.paper(), (), (8, i)), rig) for i in range(2)]
    setting, base = base_fit(samples, rig, free_parameters(rig))
    searched = []

    def searches(setting, base, effects, most, report, named):
        searched.append(base.rig.friction)
        return Found(setting, base, (), base)

    monkeypatch.setattr(law, "find_beside", searches)
    monkeypatch.setattr(law, "stopwatch", lambda: lambda: 10.0)
    monkeypatch.setattr(law, "left_by", lambda report: left)
    other, own = find_with_laws(setting, base, (), 2, lambda text: None)
    assert searched == laws
    assert other is not None and other.gain > 1000.0
    assert other.found.final.rig.friction == "humped" and own.final is base


def test_a_law_that_leads_nowhere_is_searched_last(monkeypatch):
    samples = [prepare(of_coulomb(i), COULOMB) for i in range(2)]
    setting, base = base_fit(samples, COULOMB, free_parameters(COULOMB))
    # As if a free function of the speed gained; the humped law itself gains nothing.
    monkeypatch.setattr(law, "_may_bend", lambda setting, fit: True)
    searched = []

    def searches(setting, base, effects, most, report, named):
        searched.append(base.rig.friction)
        return Found(setting, base, (), base)

    monkeypatch.setattr(law, "find_beside", searches)
    other, own = find_with_laws(setting, base, (), 2, lambda text: None)
    assert other is None and searched == ["coulomb"]
    assert own.final.rig.friction == "coulomb"
