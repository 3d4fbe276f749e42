"""Columns out of matrices and structs of MATLAB files."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.io import savemat

from benchmarks.fuzz.recorded import read_in_turn
from drill_env import InputError
from drill_env.recordings import parse_map, read_folder, read_recording

ROWS = 400
T = np.arange(ROWS) / 200.0
U = 2.0 + np.sin(5.0 * T)
TOP = np.round(3.0 * T + 0.1 * np.sin(9.0 * T), 6)
BIT = np.round(0.9 * TOP, 6)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """One workspace with the run in every shape."""
    tall = np.column_stack([T, U, TOP, BIT])
    signals = np.empty((1, 2), dtype=[("values", object), ("label", object)])
    signals[0, 0] = (np.column_stack([U, TOP]), "a")
    signals[0, 1] = (BIT[None, None, :], "b")
    cell = np.empty((2, 1), dtype=object)
    cell[0, 0], cell[1, 0] = TOP[:, None], "words"
    file = tmp_path_factory.mktemp("mat") / "run.mat"
    workspace = {
        "tall": tall, "wide": tall.T, "block": tall[:, None, :],
        "out": {"time": T, "signals": signals},
        "cell": cell, "run": {"enc": {"top": TOP}, "m": tall[:, 2:]}, "z": np.ones((3, 3)) * 1j,
    }  # fmt: skip
    savemat(file, workspace)
    return file


WAYS = {
    "counted from 1": ("tall(:,1)", "tall(:,2)", "tall(:,3)", "tall(:,4)"),
    "counted from 0": ("tall[:,0]", "tall[:, 1]", "tall[:,2]", "tall[:,3]"),
    "one channel a row": ("wide(1,:)", "wide[1,:]", "wide[2]", "wide(4,:)"),
    "a length of one": ("block(:,1)", "block[:,1]", "block(:,3)", "block(:,4)"),
    "Simulink": ("out.time", "out.signals(1).values(:,1)", "out.signals[0].values[:,1]",
                 "out.signals(2).values"),
    "structs and cells": ("out.time", "tall[:,1]", "run.enc.top", "run.m(:,2)"),
    "cell": ("out.time", "tall[:,1]", "cell{1}", "run.m[:,1]"),
}  # fmt: skip


@pytest.mark.parametrize("way", WAYS)
def test_every_place_gives_its_column(way, path):
    names = ("t", "u", "theta_u", "theta_l")
    columns = [f"{name}={place}" for name, place in zip(names, WAYS[way], strict=True)]
    with read_in_turn(), warnings.catch_warnings():
        warnings.simplefilter("error")
        recording = read_recording(path, parse_map(columns))
    for values, name in zip((T, U, TOP, BIT), names, strict=True):
        np.testing.assert_array_equal(recording.channel(name), values)


def test_units_and_the_manifest_go_with_places(path):
    columns = 't = "tall(:,1)", u = "tall(:,2)", theta_u = "run.enc.top", theta_l = "tall[:,3]"'
    manifest = path.parent / "recordings.toml"
    manifest.write_text(
        f'[[recording]]\nfile = "run.mat"\ncolumns = {{ {columns} }}\n'
        'units = { theta_u = "deg", u = "24" }\n'
    )
    recording = read_folder(manifest).fit[0]
    np.testing.assert_allclose(recording.theta_u, np.radians(TOP))
    np.testing.assert_allclose(recording.u, 24.0 * U)
    np.testing.assert_array_equal(recording.theta_l, BIT)


BAD = {
    "tall(:,5)": r"no tall\(:,5\): tall is a matrix of 400 x 4; its columns are tall\(:,1\) to "
    r"tall\(:,4\), or counted from 0 tall\[:,0\] to tall\[:,3\]",
    "tall(:,0)": "a matrix of 400 x 4",
    "tall[:,4]": "a matrix of 400 x 4",
    "tall(5)": "a matrix of 400 x 4",
    "tall(:,:)": "a matrix of 400 x 4",
    "tall(1,2)": "a matrix of 400 x 4",
    "tall": "tall is a matrix of 400 x 4; its columns are",
    "wide(:,1,1)": r"a matrix of 4 x 400; its rows are wide\(1,:\) to wide\(4,:\)",
    "wide[99999999999999999999]": "a matrix of 4 x 400",
    "tall.x": "no tall.x: tall is a matrix of 400 x 4",
    "out": "out is a struct of time, signals; write out.time",
    "out.tim": "no out.tim: out is a struct of time, signals",
    "out.signals": r"1 x 2 structs of values, label; write out.signals\(1\) to out.signals\(2\)",
    "out.signals.values": "no out.signals.values: out.signals is 1 x 2 structs",
    "out.signals(3).values": r"no out.signals\(3\): ",
    "out.signals(1).label": "label is no array of real numbers",
    "cell": r"a cell array of 2 x 1; write cell\(1\)",
    "cell{2}": "no array of real numbers",
    "z(:,1)": "no array of real numbers",
    "nothing(:,2)": r"no column nothing\(:,2\); found: out.time, tall .a matrix of 400",
    "tall(:,": r"no column tall\(; found",
    "tall(:,1):hours": "unknown unit 'hours'",
}  # fmt: skip


@pytest.mark.parametrize("place", BAD)
def test_a_place_that_is_no_column_is_one_line(place, path):
    with read_in_turn(), pytest.raises(InputError, match=BAD[place]) as caught:
        read_recording(path, {"t": "out.time", "u": place})
    assert str(path) in str(caught.value) or "--map" in str(caught.value)


def test_without_a_map_the_matrices_are_named(path):
    with pytest.raises(InputError, match="no column t; found: tall .a matrix of 400 x 4., wide"):
        read_recording(path)


def test_a_matrix_of_more_values_than_rows_are_allowed_is_read(tmp_path):
    """The limit of rows is that of a column, not of a whole matrix."""
    big = np.zeros((1_500_000, 8), dtype=np.int8)
    savemat(tmp_path / "big.mat", {"big": big, "t": T, "theta_u": TOP}, do_compression=True)
    assert len(read_recording(tmp_path / "big.mat")) == ROWS
