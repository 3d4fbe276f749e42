"""Rig files: every rig comes back equal, every bad file says how to mend it."""

from __future__ import annotations

import tomllib

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drill_env import InputError, Rig, load_rig
from drill_env.parameters import SYMBOLS, dump_rig, save_rig

STRIBECK = Rig(friction="stribeck", T1=-0.004, T2=0.0, beta2=1.0)
COULOMB = Rig(friction="coulomb", T1=0.0, T2=0.0, beta1=1.0, beta2=1.0)
ALONE = Rig.one_inertia(km=35.1, Ju=95.1, Tsu=20.4, bu=203.5, dTsu=-3.2, dbu=1.5)
EFFECTS = (
    {"id": "backlash", "gap": 0.01},
    {"id": "table", "points": [[0.0, 1.0], [1.0, 2.5]], "fit": {"by": "hand", "n": 3}},
    {"only": {"nested": True}},
    {"many": [{"a": 1}, {"a": 2, "text": 'quoted "name"'}]},
)
RIGS = {
    "paper": Rig.paper(),
    "clamp": Rig(clamp=True),
    "stribeck": STRIBECK,
    "coulomb": COULOMB,
    "one inertia": ALONE,
    "one inertia with a loose lower disc": Rig(inertias=1, ktheta=0.0, clamp=True),
    "one short effect": Rig(effects=({"id": "x"},)),
    "effects": Rig(effects=EFFECTS),
    "one inertia with effects": ALONE.replace(effects=EFFECTS[:2]),
    "no digit lost": Rig(km=0.1 + 0.2, Jl=1e-17, ktheta=5e300),
}


@pytest.mark.parametrize("name", RIGS)
def test_a_written_rig_is_read_back_equal(name, tmp_path):
    path = tmp_path / "rig.toml"
    save_rig(RIGS[name], path)
    assert load_rig(path) == RIGS[name]


small = st.floats(0.0, 1e6, allow_subnormal=True)
above = st.floats(1e-300, 1e300)
signed = st.floats(-1e6, 1e6)
effect = st.dictionaries(
    st.text(min_size=1, max_size=8),
    st.one_of(
        st.integers(-(2**60), 2**60),
        st.booleans(),
        st.text(max_size=12),
        st.floats(allow_nan=False),
        st.lists(st.floats(-10, 10), max_size=3),
        st.dictionaries(st.text(min_size=1, max_size=4), st.integers(0, 9), max_size=2),
    ),
    max_size=4,
)


@st.composite
def rigs(draw):
    values = {name: draw(small) for name in ("Tsu", "bu", "Tsl", "beta1", "beta2")}
    values |= {name: draw(above) for name in ("km", "Ju", "Jl", "ktheta")}
    values |= {name: draw(signed) for name in ("T1", "T2", "bl")}
    values["dTsu"] = draw(st.floats(-values["Tsu"], values["Tsu"]))
    values["dbu"] = draw(st.floats(-values["bu"], values["bu"]))
    friction = draw(st.sampled_from(("humped", "stribeck", "coulomb")))
    if friction == "stribeck":
        values["T1"] = -draw(st.floats(0.0, values["Tsl"]))
    effects = tuple(draw(st.lists(effect, max_size=3)))
    inertias = draw(st.sampled_from((1, 2)))
    values["ktheta"] *= inertias - 1
    return Rig(
        **values, friction=friction, clamp=draw(st.booleans()), effects=effects, inertias=inertias
    )  # fmt: skip


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(rigs())
def test_any_rig_is_read_back_equal(tmp_path_factory, rig):
    path = tmp_path_factory.getbasetemp() / "any.toml"
    save_rig(rig, path)
    assert load_rig(path) == rig


def test_the_default_file_holds_the_papers_symbols_with_units():
    text = dump_rig(Rig.paper())
    table = tomllib.loads(text)["rig"]
    assert tuple(table) == (*SYMBOLS, "friction")
    assert "km = 3.5693" in text and "Nm/V" in text


def test_unused_keys_may_be_left_out(tmp_path):
    path = tmp_path / "rig.toml"
    lines = dump_rig(COULOMB).splitlines()
    dropped = ("T1", "T2", "beta1", "beta2")
    path.write_text("\n".join(x for x in lines if not x.startswith(dropped)))
    assert load_rig(path) == COULOMB


GOOD = dump_rig(Rig.paper())
BAD = {
    "not TOML": ("km == 3", ("not TOML", "drill-env rig show")),
    "no table": ("km = 3.5", ("no table [rig]", "drill-env rig show")),
    "rig is a number": ("rig = 3", ("no table [rig]",)),
    "unknown key": (GOOD + "kthetta = 1.0\n", ("unknown key kthetta", "known: km Ju")),
    "unknown table": (GOOD + "[motor]\nx = 1\n", ("unknown top-level key motor", "effects")),
    "missing key": ("[rig]\nkm = 1.0\n", ("missing key Ju", "drill-env rig show")),
    "text": (GOOD.replace("Jl = 0.0326", 'Jl = "0.0326"'), ("Jl is '0.0326'", "give a number")),
    "boolean": (GOOD.replace("Jl = 0.0326", "Jl = true"), ("Jl is True", "give a number")),
    "nan": (GOOD.replace("Jl = 0.0326", "Jl = nan"), ("Jl is nan", "give a finite number")),
    "sign": (GOOD.replace("Jl = 0.0326", "Jl = -0.0326"), ("Jl is -0.0326", "greater than 0")),
    "law": (GOOD.replace('"humped"', '"hump"'), ("friction is 'hump'", "humped, stribeck")),
    "law list": (GOOD.replace('"humped"', '["humped"]'), ("friction is ['humped']", "humped,")),
    "clamp": (GOOD + 'clamp = "yes"\n', ("clamp is 'yes'", "true or false")),
    "inertias": (GOOD + "inertias = 3\n", ("inertias is 3", "give 1")),
    "inertias true": (GOOD + "inertias = true\n", ("inertias is True", "give 1")),
    "inertias real": (GOOD + "inertias = 1.0\n", ("inertias is 1.0", "give 1")),
    "string": (GOOD + "inertias = 1\n", ("ktheta", "inertias = 1", "remove it")),
    "effects": ("effects = 3\n" + GOOD, ("[[effects]]",)),
    "effects of numbers": ("effects = [3]\n" + GOOD, ("[[effects]]",)),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_names_itself_and_the_remedy(name, tmp_path):
    text, wanted = BAD[name]
    path = tmp_path / "bad.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_rig(path)
    message = str(caught.value)
    assert str(path) in message and "\n" not in message
    for part in wanted:
        assert part in message


def test_missing_file_folder_and_bytes_name_the_path(tmp_path):
    binary = tmp_path / "rig.toml"
    binary.write_bytes(b"\xff\xfe[rig]")
    for path in (tmp_path / "none.toml", tmp_path, binary):
        with pytest.raises(InputError, match="rig file") as caught:
            load_rig(path)
        assert str(path) in str(caught.value)


def test_an_unwritable_place_leaves_nothing(tmp_path):
    with pytest.raises(InputError, match="cannot write"):
        save_rig(Rig(), tmp_path / "none" / "rig.toml")
    with pytest.raises(InputError, match="is a folder"):
        save_rig(Rig(), tmp_path)
    assert list(tmp_path.iterdir()) == []
