"""The report of a diagnosis: what it shows, for every verdict, and its files."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from html import escape
from html.parser import HTMLParser
from pathlib import Path

import gymnasium as gym
import jsonschema
import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

import drill_env  # noqa: F401
from drill_env import Rig, load_rig
from drill_env._documents import plain
from drill_env.cli.main import app
from drill_env.diagnosis.diagnose import Diagnosis, diagnose
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.diagnosis.result import Located, NamedEffect, NextExperiment, Number, digits_of
from drill_env.diagnosis.schema import schema
from drill_env.effects import LIBRARY
from drill_env.recordings import Recording
from drill_env.recordings.signals import Signal, signal_samples
from drill_env.report.diagnosis_page import diagnosis_page
from tests.made_recordings import played

pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")
STEP = 2.0 * math.pi / 8192
UNBALANCE = {"id": "unbalance", "torque": 0.03, "phase": 1.0}
NAMES = ("run <b>1 & $x$.csv", "held <script>alert(2).csv")
KEPT = {"unbalance", "lower_disturbance", "encoder_eccentricity_lower"}
LEFT_OUT = tuple(sorted({*LIBRARY, "friction_shape"} - KEPT))


def noise(rng: np.random.Generator, size: float, tau: float, n: int, step: float) -> np.ndarray:
    decay = math.exp(-step / tau)
    return lfilter([size * math.sqrt(1.0 - decay**2)], [1.0, -decay], rng.standard_normal(n))


def recorded(seed: int, name: str) -> Recording:
    """A run of an unbalanced rig under torque noise, its angles rounded to counts."""
    signal = Signal("quasi-random", seconds=20.0, rate=100.0, limit=5.0, seed=seed)
    t, u = signal_samples(signal)
    rng = np.random.default_rng(seed)
    pull = {
        "id": "table", "component": "lower", "depends_on": "time", "sort": "torque",
        "knots": t.tolist(), "values": noise(rng, 3e-4, 0.1, len(t), 0.01).tolist(),
    }  # fmt: skip
    rig = Rig.paper().replace(effects=(UNBALANCE, pull))
    push = noise(rng, 0.02, 0.1, len(t), 0.01) / rig.km
    angles = STEP * np.round(played(rig, t, u + push, np.zeros(4))[1] / STEP)
    quanta = {"theta_u": STEP, "theta_l": STEP}
    return Recording(t, u, angles[:, 0], angles[:, 1], source=name, quanta=quanta)


@pytest.fixture(scope="module")
def pair() -> tuple[Recording, Recording]:
    return recorded(1, NAMES[0]), recorded(2, NAMES[1])


@pytest.fixture(scope="module")
def named(pair) -> Diagnosis:
    options = DiagnosisOptions(leave_out=LEFT_OUT, most=1)
    return diagnose([pair[0]], Rig.paper(), [pair[1]], options=options)


@pytest.fixture(scope="module")
def nameless(pair) -> Diagnosis:
    options = DiagnosisOptions(leave_out=(*LEFT_OUT, "unbalance"), most=1)
    return diagnose([pair[0]], Rig.paper(), options=options)


def fault_only(found: Diagnosis) -> Diagnosis:
    """The same rig with nothing missing but a sound clock."""
    effect = NamedEffect(
        "clock_jitter", "sensor", 0.99, {"jitter": Number(1e-4, 0.0, 2e-4, "s")}, "late", "late", []
    )
    none = {"upper": 0.0, "lower": 0.0}
    where = Located("sensor", "both", "time", "", [], {}, None, None, none, none)
    result = replace(
        found.result, effects=[effect], located=where, faults=["late"], sentences=["late"],
        next_experiment=NextExperiment("a ramp", "drill-env signal ramp", ["a", "b"], 3.0),
    )  # fmt: skip
    return replace(found, result=result, found=replace(found.found, final=found.found.base))


def consistent(found: Diagnosis) -> Diagnosis:
    result = replace(
        found.result, verdict="consistent", effects=[], located=None, shape=None,
        next_experiment=None,
    )  # fmt: skip
    return replace(found, result=result, found=replace(found.found, final=found.found.base))


def as_json(found: Diagnosis) -> dict:
    return json.loads(json.dumps(plain(found.result.as_dict()), allow_nan=False))


class Links(HTMLParser):
    """Everything that a page would fetch, and every id."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.ids: list[str] = []
        self.tags: set[str] = set()
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        for name, value in attrs:
            if name in ("src", "href", "xlink:href", "data", "action"):
                self.fetched.append(value)
            if name == "id":
                self.ids.append(value)


def test_unbalance_is_named_and_without_it_the_tool_says_so(named, nameless):
    assert named.result.verdict == "missing_physics"
    assert [effect.id for effect in named.result.effects] == ["unbalance"]
    torque = named.result.effects[0].parameters["torque"].value
    assert torque == pytest.approx(UNBALANCE["torque"], rel=0.05)
    assert nameless.result.verdict == "unexplained"
    assert nameless.result.shape is not None
    assert nameless.result.shape.coordinate == "theta_l"


def test_json_follows_the_schema_and_the_schema_bites(named, nameless):
    jsonschema.Draft202012Validator.check_schema(schema())
    check = jsonschema.Draft202012Validator(schema()).validate
    for found in (named, nameless, fault_only(named), consistent(named)):
        check(as_json(found))
    good = as_json(named)
    for wrong in (
        {**good, "schema": 2},
        {**good, "verdict": "perhaps"},
        {**good, "extra": 1},
        {k: v for k, v in good.items() if k != "fit"},
        {**good, "effects": [{**good["effects"][0], "probability": 1.5}]},
        {**good, "located": {**good["located"], "intervals_s": [[1.0]]}},
    ):
        with pytest.raises(jsonschema.ValidationError):
            check(wrong)


@pytest.mark.parametrize("change", [lambda d: d, fault_only, consistent])
@pytest.mark.parametrize("which", ["named", "nameless"])
def test_page_holds_every_sentence_and_needs_no_network(which, change, request):
    found = change(request.getfixturevalue(which))
    page = diagnosis_page(found)
    for line in found.result.sentences:
        assert escape(line, quote=False) in page.replace("&#39;", "'").replace("&#34;", '"')
    links = Links(page)
    assert all(link.startswith("#") for link in links.fetched)
    assert "@import" not in page and not re.search(r"url\((?!#)", page)
    assert len(links.ids) == len(set(links.ids))
    assert len(page) < 1_000_000
    assert not {"script", "b>1"} & links.tags
    assert "&lt;b&gt;1 &amp; $x$" in page
    assert ("&lt;script&gt;" in page) == bool(found.holdout)


def test_page_shows_the_law_and_both_fits(named):
    page = diagnosis_page(named)
    for text in ("fitted law", "missing torque", "noise alone", "before", "measured", "unbalance"):
        assert f">{text}<" in page or text in page
    effect = named.result.effects[0]
    for number in effect.parameters.values():
        digits = digits_of(number.value, number.low, number.high)
        assert f"{number.value:.{digits}g}" in page
    for name in named.result.parameters_changed:
        assert f">{name}" in page


def test_command_writes_three_files_and_the_rig_runs_with_what_was_found(pair, tmp_path, capsys):
    files = []
    for name, recording in zip(("fit.csv", "hold.csv"), pair, strict=True):
        columns = {"t": recording.t, "u": recording.u, **recording.angles()}
        pd.DataFrame(columns).to_csv(tmp_path / name, index=False)
        files.append(str(tmp_path / name))
    left_out = [part for name in LEFT_OUT for part in ("--leave-out", name)]
    out = tmp_path / "report"
    app(
        ["diagnose", files[0], "--holdout", files[1], "--most", "1", "--out", str(out), *left_out],
        standalone_mode=False,
    )
    document = json.loads((out / "diagnosis.json").read_text())
    jsonschema.validate(document, schema())
    assert all(line in capsys.readouterr().out for line in document["sentences"][:1])
    assert sorted(p.name for p in Path(out).iterdir()) == [
        "diagnosis.json", "index.html", "rig-extended.toml",
    ]  # fmt: skip
    rig = load_rig(out / "rig-extended.toml")
    assert [effect["id"] for effect in rig.effects] == ["unbalance"]
    extended, bare = (gym.make("DrillString-v0", rig=r) for r in (rig, rig.replace(effects=())))
    angles = []
    for env in (extended, bare):
        env.reset(seed=0)
        for _ in range(100):
            observation = env.step(env.action_space.high)[0]
        angles.append(observation)
    assert np.isfinite(angles[0]).all()
    assert not np.allclose(angles[0], angles[1])
