"""Coupled drives at another scale, by a plant that shares no code with the package."""

from __future__ import annotations

import pytest

from benchmarks.other_rigs import row_of


def test_drag_on_the_load_of_coupled_drives_is_named_from_a_measured_torque():
    row = row_of("coupled drives, drag, by torque")
    assert row["right"]
    ((true, (value, low, high)),) = [tuple(n.values()) for n in row["numbers"].values()]
    assert value == pytest.approx(true, rel=0.1) and low < true < high
    for errors in row["errors"].values():
        assert errors["after"] < 0.7 * errors["before"]


def test_nothing_is_missing_from_coupled_drives_as_their_lab_knows_them():
    row = row_of("coupled drives")
    assert row["right"] and row["verdict"] == "consistent"


def test_a_twist_that_was_measured_from_the_hub_is_no_missing_physics():
    """Its angle has the noise of both sensors, which is neither a late clock nor a wrong gain."""
    row = row_of("flexible link, strain gauge")
    assert row["right"]


def test_a_pendulum_stays_named_where_the_rig_alone_would_lose_the_recording():
    """Held-out motions are told under noise that follows them, not under what is left of it."""
    row = row_of("pendulum on a quiet motor")
    assert row["right"]
    assert row["errors"]["theta_u"]["after"] < 0.1 * row["errors"]["theta_u"]["before"]
