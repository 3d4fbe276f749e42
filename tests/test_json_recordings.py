"""JSON logs: every form gives what CSV gives, and each that is none is one line."""

from __future__ import annotations

import gzip
import json
import time
import warnings

import numpy as np
import pandas as pd
import pytest

from benchmarks.fuzz.recorded import read_in_turn
from drill_env import InputError
from drill_env.recordings import limits, parse_map, read_folder, read_recording

ROWS = 400


def table():
    t = np.arange(ROWS) / 200.0
    theta = np.round(3.0 * t + 0.1 * np.sin(9.0 * t), 6)
    return pd.DataFrame(
        {"t": t, "u": 2.0 + np.sin(5.0 * t), "theta_u": theta, "theta_l": np.round(0.9 * theta, 6)}
    )


def rows():
    return table().to_dict("records")


def lines(given):
    return "\n".join(json.dumps(row) for row in given)


FORMS = {
    "rows.json": lambda: json.dumps(rows(), indent=1),
    "columns.json": lambda: json.dumps(
        {**table().to_dict("list"), "gain": 3, "rig": {"who": "me"}}
    ),
    "pandas.json": lambda: table().to_json(double_precision=15),
    "lines.jsonl": lambda: lines(rows()) + "\n",
    "lines.ndjson": lambda: "\ufeff" + lines(rows()).replace("\n", "\r\n"),
}


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("name", FORMS)
def test_every_form_of_json_gives_the_same_exact_recording(name, packed, tmp_path):
    content = FORMS[name]().encode()
    path = tmp_path / (name + ".gz" if packed else name)
    path.write_bytes(gzip.compress(content) if packed else content)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        recording = read_recording(path)
    exact = {"atol": 1e-14} if name == "pandas.json" else {"atol": 0.0}
    for channel, values in recording.channels().items():
        np.testing.assert_allclose(values, table()[channel], rtol=0.0, **exact)
    assert len(recording.channels()) == 4 and recording.columns[:2] == ("t", "u")
    if name == "columns.json":
        assert recording.constant("gain") == 3.0


def test_nested_names_are_joined_by_dots(tmp_path):
    given = [
        {"t": 5 * i, "motor": {"voltage": row["u"], "enc": {"top": row["theta_u"]}}}
        for i, row in enumerate(rows())
    ]
    (tmp_path / "run.json").write_text(json.dumps(given))
    columns = {"t": "t:ms", "u": "motor.voltage", "theta_u": "motor.enc.top"}
    recording = read_recording(tmp_path / "run.json", columns)
    np.testing.assert_array_equal(recording.theta_u, table().theta_u)
    np.testing.assert_array_equal(recording.u, table().u)


def test_null_nan_and_absent_names_are_missing_samples(tmp_path):
    given = rows()
    given[7]["theta_l"] = None
    given[9]["theta_l"] = float("nan")
    del given[11]["theta_l"]
    for row in given[20:]:
        row["late"] = 1.0
    (tmp_path / "run.jsonl").write_text(lines(given))
    with pytest.raises(InputError, match="theta_l has 3 missing.*the first in row 8"):
        read_recording(tmp_path / "run.jsonl")
    with pytest.warns(UserWarning, match="3 rows lack a value"):
        recording = read_recording(tmp_path / "run.jsonl", missing="keep")
    assert np.flatnonzero(np.isnan(recording.theta_l)).tolist() == [7, 9, 11]
    assert np.isnan(recording.extra["late"]).sum() == 20


def _with(row, **changes):
    given = rows()
    given[row] |= changes
    return lines(given)


BAD = {
    "word": (_with(4, u="off"), "column u is not numeric: 'off' in row 5; remove"),
    "truth": (_with(4, u=True), "column u is not numeric: 'True' in row 5"),
    "list": (_with(4, u=[1, 2]), "column u is not numeric: 'a list' in row 5"),
    "huge": (lines(rows()).replace("2.0,", "9" * 9000 + ",", 1), "u has 1 missing, NaN or"),
    "exponent": (lines(rows()).replace("2.0,", "1e999,", 1), "u has 1 missing, NaN or"),
    "cut line": (lines(rows())[:-9], "line 400 is no JSON .*; mend or delete it"),
    "cut array": (json.dumps(rows())[:-1], "the array of rows does not end; the file was cut"),
    "behind": (json.dumps(rows()) + "x", "text behind the array's end"),
    "twice": ('{"t": 1, "t": 2}', "'t' comes twice in an object"),
    "twice by a dot": ('{"a.b": 1, "a": {"b": 2}}\n{}', "'a.b' comes twice in row 1"),
    "deep": ("[" * 100_000, "nested too deeply"),
    "deep object": ('{"a":' * 100_000, "nested too deeply"),
    "arrays": ("[[0, 1], [2, 3]]", "no rows of numbers: give an array of objects"),
    "row": ('[{"t": 1}, 5]', "row 2 is no object"),
    "number": ("5", "no rows of numbers"),
    "blank": ("  \n ", "no rows of numbers"),
    "nothing": ("[]", "no rows of numbers"),
    "no numbers": ('{"a": {"b": "c"}}', "no rows of numbers"),
    "short": ('{"t": [0, 1], "u": [0, 1]}', "only 2 rows"),
    "uneven": (
        json.dumps({**table().to_dict("list"), "u": [1.0] * 7}), "u has 7 values and the time 400",
    ),
    "latin": (b'{"t": "\xb5"}', "not a text file in UTF-8"),
    "half a letter": ('{"\\ud800": 1}\n' * 20, "not a whole JSON file|no column t"),
    "wide": (json.dumps({f"c{i}": i for i in range(1001)}) + "\n{}", "too large"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BAD)
def test_bad_json_is_one_line(kind, tmp_path):
    content, message = BAD[kind]
    path = tmp_path / "run.json"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    begin = time.monotonic()
    with read_in_turn(), pytest.raises(InputError, match=message) as caught:
        read_recording(path)
    assert str(path) in str(caught.value) and len(str(caught.value)) < 2000
    assert time.monotonic() - begin < 20.0


def test_what_unpacks_beyond_the_limits_is_refused(tmp_path):
    path = tmp_path / "run.json.gz"
    with gzip.open(path, "wb", compresslevel=1) as stream:
        for _ in range(limits.MOST_BYTES // 10**7 + 1):
            stream.write(b" " * 10**7)
    pytest.raises(InputError, read_recording, path).match("too large")


def test_a_folder_takes_json_by_its_manifest_and_lines_by_their_name(tmp_path):
    (tmp_path / "run.json").write_text(FORMS["rows.json"]())
    (tmp_path / "fit.jsonl").write_text(FORMS["lines.jsonl"]())
    with pytest.warns(UserWarning, match="1 fit"):
        assert [r.source[-9:] for r in read_folder(tmp_path).fit] == ["fit.jsonl"]
    (tmp_path / "recordings.toml").write_text('[[recording]]\nfile = "run.json"\n')
    assert [r.source[-8:] for r in read_folder(tmp_path).fit] == ["run.json"]


def test_columns_are_mapped_with_units(tmp_path):
    (tmp_path / "run.json").write_text(FORMS["columns.json"]())
    recording = read_recording(tmp_path / "run.json", parse_map(["theta_u=theta_u:deg", "u=u:24"]))
    np.testing.assert_allclose(recording.theta_u, np.radians(table().theta_u))
    np.testing.assert_allclose(recording.u, 24.0 * table().u)
