"""Long work that is killed, and odd places to run in; more kills by `benchmarks.fuzz.killed`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from benchmarks.fuzz import killed, left, places
from benchmarks.fuzz.works import ROOT
from drill_env._engine import Engine, run
from drill_env.agents import load
from drill_env.recordings import read_folder

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
SEED = 20261125


@pytest.mark.parametrize(("name", "kills"), [("writing", 6), ("compare", 3)])
def test_killed_work_leaves_nothing_half_there_and_can_be_run_again(name, kills):
    tally = killed.tried(name, kills, SEED, kills, anew=False)
    assert not tally.faults, tally.faults
    assert tally.sent.total() == kills


def test_the_check_tells_a_file_that_is_half_there(tmp_path):
    """A writer that does not mind is found out."""
    careless = "import sys, time; f = open(sys.argv[1] + '/a.json', 'w'); f.write('[1, 2'); "
    careless += "f.flush(); time.sleep(60)"

    def argv(_: Path, out: Path) -> list[str]:
        out.mkdir(exist_ok=True)
        return [sys.executable, "-c", careless, str(out)]

    work = killed.Work("careless", argv, endless=True)
    trial = killed.Trial(work, tmp_path / "in", tmp_path / "out")
    trial.inputs.mkdir()
    killed.kill(trial, 1.0, signal.SIGKILL, True)
    assert any("half there" in fault for fault in trial.tally.faults)


@pytest.mark.filterwarnings("ignore::drill_env.recordings.RecordingWarning")
def test_leftovers_are_no_recordings(tmp_path):
    """A hidden file in a folder of recordings is what a killed program has left."""
    t = np.arange(0.0, 6.0, 0.01)
    rows = np.column_stack([t, 2.0 + np.sin(t), 3.0 * t, 2.9 * t])
    np.savetxt(tmp_path / "fit-1.csv", rows, "%.6f", ",", header="t,u,theta_u,theta_l", comments="")
    (tmp_path / ".fit-2-abcd.csv").write_text("t,u,the")
    assert len(read_folder(tmp_path).fit) == 1


def test_workers_end_with_who_started_them():
    """Also where that has no time to tell them."""
    code = (
        "import os, sys, time; from joblib import Parallel, delayed; from drill_env._ending import "
        "end_with; f = lambda p: (end_with(p), print(os.getpid(), flush=True), time.sleep(60)); "
        "Parallel(n_jobs=2)(delayed(f)(os.getpid()) for _ in range(2))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert process.stdout is not None
    workers = [int(process.stdout.readline()) for _ in range(2)]
    assert len(set(workers)) == 2
    process.kill()
    process.wait()
    until = time.monotonic() + 20.0
    while left.running(process.pid) and time.monotonic() < until:
        time.sleep(0.1)
    assert not left.running(process.pid)


EXITS = ("atexit.register(send)", "threading.Thread(target=send).start()")


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("waits", EXITS)
def test_an_end_while_python_ends_is_silent(name, waits):
    """At its exit functions, or where it waits for threads, as for those of its workers."""
    code = (
        "import atexit, os, signal, threading, time; from drill_env._ending import ending_tidily\n"
        f"def send(): time.sleep(0.3); os.kill(os.getpid(), signal.{name}); time.sleep(60)\n"
        f"with ending_tidily(): {waits}"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], stderr=subprocess.PIPE, timeout=120, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (-getattr(signal, name), b"")


def _blocked(_):
    return signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_workers_leave_interrupts_to_who_started_them():
    """A terminal sends one to all; in a worker that still imports it would be a traceback."""
    assert all(signal.SIGINT in found for found in run(_blocked, range(4), Engine(jobs=2)))
    assert signal.SIGINT not in _blocked(0)


def test_one_agent_or_the_other(tmp_path):
    """Policy and setting change together; an error in between leaves the former pair."""
    from drill_env.agents.policy import feature_setting, save_agent

    rng = np.random.default_rng(0)
    setting = feature_setting("both", 1)
    width = load_width(setting)
    layers = [(rng.normal(size=(width, 4)), np.zeros(4)), (rng.normal(size=(4, 1)), np.zeros(1))]
    save_agent(layers, setting, tmp_path)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(TypeError):
        save_agent(layers[:1] * 2, {**setting, "x": object()}, tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    load(tmp_path)


def load_width(setting):
    from drill_env.agents.policy import make_features

    return make_features(setting).size


@pytest.fixture(scope="module")
def odd(tmp_path_factory):
    folder = tmp_path_factory.mktemp("odd")
    return folder, places.unwritable(folder)


@pytest.mark.parametrize("name", ["compare", "concealed", "train"])
@pytest.mark.parametrize("place", [0, 1], ids=["locked", "file"])
def test_no_place_to_write_is_one_error(odd, name, place):
    folder, outs = odd
    status, err = places.refused(name, folder, outs[place])
    assert status == 2 and err.strip().splitlines()[-1].startswith("error: "), err
    assert "Traceback" not in err


def test_without_cache_and_home(tmp_path):
    """Every folder that the compiler may keep its work in is closed."""
    assert places.without_cache(tmp_path) == places.plain(places.FILTER)


def test_threads_do_not_disturb_each_other():
    alone = places.moved()
    assert places.in_threads(places.moved, 3) == [alone] * 3
