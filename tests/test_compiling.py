"""Compilation: what is told of it, what is kept of it, and where it cannot be kept."""

import os
import pickle
import subprocess
import sys

import numpy as np
from numba import float64

from drill_env import _compiling, _jit
from drill_env.effects import LIBRARY

SOURCE = """
@kernel
def inner(x):
    return x + 1.0

@kernel
def middle(x):
    return inner(x) + inner(2.0 * x)

@entry
def outer(x):
    return middle(x) + inner(x)
"""


def fresh():
    """Kernels that stand in no file, so that no cache can hold them."""
    scope = {"kernel": _jit.kernel, "entry": _jit.entry, "__name__": "drill_env.made_up"}
    exec(SOURCE, scope)
    return scope["outer"]


def test_every_kernel_is_counted_once(monkeypatch):
    told = []
    monkeypatch.setattr(_compiling, "_observers", [told.append])
    assert fresh()(1.0) == 7.0
    assert {state.total for state in told} == {3}
    assert [state.done for state in told if not state.finished] == [0, 0, 0]
    assert {state.name for state in told} == {"outer", "middle", "inner"}
    assert told[-1].finished and told[-1].done in (2, 3)


def test_nothing_is_told_of_what_is_compiled_already(monkeypatch):
    outer = fresh()
    outer(1.0)
    told = []
    monkeypatch.setattr(_compiling, "_observers", [told.append])
    outer(2.0)
    assert told == []


def test_a_unit_is_called_by_its_address():
    scope = {"unit": _jit.unit, "signature": float64(float64, float64[::1])}
    exec("@unit(signature)\ndef total(x, y):\n    y[0] += x\n    return y[0] + y[1]", scope)
    total = scope["total"]
    call = total.call
    scope = {"entry": _jit.entry, "call": call}
    exec("@entry\ndef run(code, y):\n    return call(code, 2, y)", scope)
    y = np.array([1.0, 5.0])
    assert scope["run"](total.address, y) == 8.0
    assert y[0] == 3.0


def test_an_address_does_not_travel_to_another_process():
    kernel = LIBRARY["unbalance"].kernel
    assert pickle.loads(pickle.dumps(kernel)) is kernel
    assert str(kernel.address).encode() not in pickle.dumps(kernel)


def test_it_runs_where_no_cache_can_be_written(tmp_path):
    """A file stands where the folder would be made."""
    (tmp_path / "file").write_text("")
    code = (
        "from drill_env.integrator import constant_voltage; from drill_env import friction, Rig; "
        "print(friction.lower_curve(Rig.paper(), 0.0))"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "file" / "below")}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) == 0.0094


def test_a_changed_file_makes_all_compiled_code_stale(monkeypatch):
    """Numba links one file's code into another's, and looks at the latter alone."""
    stamp = _jit._package_stamp()
    changed = next(p for p in (_jit.Path(_jit.__file__).parent / "friction").glob("_*.py"))
    real = type(changed).stat

    def later(path, **options):
        found = real(path, **options)
        if path != changed:
            return found
        return os.stat_result([*found[:6], found.st_size + 1, *found[7:10]])

    monkeypatch.setattr(type(changed), "stat", later)
    _jit._package_stamp.cache_clear()
    assert _jit._package_stamp() != stamp
    monkeypatch.undo()
    _jit._package_stamp.cache_clear()
    assert _jit._package_stamp() == stamp


def test_a_cache_that_names_modules_of_an_older_version_is_stale(tmp_path):
    """Its index is a pickle, which cannot be read when a module is gone."""
    script = tmp_path / "old_kernel.py"
    lines = [
        "from drill_env._jit import entry",
        "",
        "@entry",
        "def double(x):",
        "    return 2.0 * x",
    ]
    run = "\nprint(double(3.0))\n"
    script.write_text("\n".join(lines) + run, "utf-8")
    command = [sys.executable, str(script)]
    assert subprocess.run(command, capture_output=True, check=True).stdout == b"6.0\n"
    (index,) = tmp_path.rglob("*.nbi")
    with index.open("rb") as file:
        pickle.load(file)
        version = index.read_bytes()[: file.tell()]
    index.write_bytes(version + b"cgone_module\nkernel\n.")
    again = subprocess.run(command, capture_output=True, check=False)
    assert again.stdout == b"6.0\n", again.stderr
