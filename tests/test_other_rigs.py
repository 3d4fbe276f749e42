"""Coupled drives at another scale, by a plant that shares no code with the package."""

from __future__ import annotations

import pytest

from benchmarks.other_rigs import row_of


def test_drag_on_the_load_of_coupled_drives_is_named_from_a_measured_torque():
    row = row_of("coupled drives, drag, by torque")
    assert row["right"]
    ((true, (value, low, high)),) = [tuple(n.values()) for n in row["numbers"].values()]
    assert value == pytest.approx(true, rel=0.1) and low < true < high
    for errors in row["five_second_prediction"].values():
        assert errors["after_rms"] < 0.7 * errors["before_rms"]


def test_nothing_is_missing_from_coupled_drives_as_their_lab_knows_them():
    row = row_of("coupled drives")
    assert row["right"] and row["verdict"] == "consistent"
