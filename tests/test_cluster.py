"""Runs on a Ray cluster of two nodes: the same as alone, though workers and a node die."""

from __future__ import annotations

import functools
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from drill_env import Engine, InputError, Rig
from drill_env._engine import TaskError, outcomes, run
from drill_env.integrator import simulate

ray = pytest.importorskip("ray", reason="Ray is not installed: make cluster")
pytestmark = pytest.mark.filterwarnings("ignore::drill_env.integrator.NegativeFrictionWarning")


@pytest.fixture(scope="module")
def cluster():
    from ray.cluster_utils import Cluster

    here = Path(__file__).parent
    paths = os.pathsep.join([str(here), str(here.parent), os.environ.get("PYTHONPATH", "")])
    with pytest.MonkeyPatch.context() as patch:
        # The nodes must find this module and the package.
        patch.setenv("PYTHONPATH", paths)
        patch.setenv("RAY_USAGE_STATS_ENABLED", "0")
        made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
        made.second = made.add_node(num_cpus=1)
        yield made
        ray.shutdown()
        made.shutdown()


def simulated(marks: Path, number: int) -> tuple[bytes, str]:
    """A run, and the node that it was on; at 3 its worker is killed, the first time."""
    mark = marks / "killed"
    if number == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    with (marks / f"{number}.begun").open("a") as stream:
        stream.write("x")
    time.sleep(0.3)
    volts = float(np.random.default_rng(number).uniform(2.0, 5.0))
    node = ray.get_runtime_context().get_node_id() if ray.is_initialized() else ""
    return simulate(Rig(), volts, 20.0).state.tobytes(), node


def faulty(number: int) -> int:
    if number == 2:
        raise ValueError("no root")
    if number == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def test_killed_workers_and_a_lost_node_change_no_bit(cluster, tmp_path):
    engine = Engine("ray", address=cluster.address)
    alone_marks, marks = tmp_path / "alone", tmp_path / "cluster"
    for folder in (alone_marks, marks):
        folder.mkdir()
    (alone_marks / "killed").touch()
    alone = [found[0] for found in run(functools.partial(simulated, alone_marks), range(16))]

    def lose(done: int, total: int) -> None:
        if done == 8:
            cluster.remove_node(cluster.second, allow_graceful=False)

    found = list(run(functools.partial(simulated, marks), range(16), engine, progress=lose))
    assert [state for state, _ in found] == alone
    assert (marks / "killed").exists()
    # Both nodes had work, and in the end the one that was left had all of it.
    assert len({node for _, node in found}) == 2 and found[-1][1] == found[-2][1]


def test_errors_on_a_cluster_are_named_and_stop_no_other(cluster):
    engine = Engine("ray", jobs=1, address=cluster.address, retries=1)
    found = list(outcomes(faulty, range(6), engine, name=lambda i: f"case {i}"))
    assert [found[i] for i in (0, 1, 3, 5)] == [0, 1, 3, 5]
    assert isinstance(found[2], TaskError) and isinstance(found[4], TaskError)
    assert str(found[2]) == "case 2: ValueError: no root"
    assert str(found[4]).startswith("case 4: its process failed (WorkerCrashedError")


@pytest.mark.parametrize("address", ["127.0.0.1:1", "127.0.0.1:port", "nowhere"])
def test_an_address_without_a_cluster_is_named(address):
    ray.shutdown()
    with pytest.raises(InputError, match=address):
        list(run(abs, [1], Engine("ray", address=address)))
