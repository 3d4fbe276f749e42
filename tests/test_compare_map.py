"""The map of many controllers: what is marked is what the table says."""

import matplotlib.image as images
import numpy as np
import pandas as pd
import pytest

from drill_env.benchmark import compare
from drill_env.benchmark.measures import vibration_free
from drill_env.environment.config import EnvConfig
from drill_env.parameters import Rig
from drill_env.report.compare_map import compare_map
from drill_env.report.compare_picture import save_compare_picture


@pytest.fixture(scope="module")
def runs():
    from drill_env import baselines

    names = ("open-loop", "pi", "lqi")
    makers = {name: baselines.CONTROLLERS[name] for name in names}
    one = compare(makers, EnvConfig(), setpoints=(1.0, 4.0))
    return pd.concat([one, one.assign(controller=one.controller + "-again")])


def test_every_run_free_of_vibration_has_a_dot_and_a_place_in_the_count(runs):
    axes = [a for a in compare_map(runs).axes if a.images]
    assert [a.get_title(loc="left") for a in axes] == ["from rest", "from limit cycle"]
    for panel, (_, group) in zip(axes, runs.groupby("start", sort=False), strict=True):
        assert len(panel.lines[0].get_xdata()) == int(vibration_free(group).sum()) > 0
        counts = [int(text.get_text().split("/")[0]) for text in panel.texts]
        assert sum(counts) == int(vibration_free(group).sum())


def test_the_colour_is_the_severity_index(runs):
    axes = next(a for a in compare_map(runs).axes if a.images)
    shown = np.asarray(axes.images[0].get_array())
    first = runs[(runs.controller == "open-loop") & (runs.start == runs.start.iloc[0])]
    expected = first.sort_values("setpoint").severity_index.clip(lower=1e-3)
    np.testing.assert_allclose(shown[0], expected)


def test_many_controllers_stay_readable_and_few_keep_their_bars(runs, tmp_path):
    save_compare_picture(runs, Rig.paper(), 5.0, tmp_path / "many.png")
    assert 1000 < images.imread(tmp_path / "many.png").shape[1] <= 1800
    few = runs[runs.controller.isin(["pi", "lqi"])]
    save_compare_picture(few, Rig.paper(), 5.0, tmp_path / "few.png")
    assert (
        images.imread(tmp_path / "few.png").shape[:2]
        != images.imread(tmp_path / "many.png").shape[:2]
    )
