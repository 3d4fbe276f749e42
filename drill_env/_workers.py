"""What runs tasks for `drill_env._engine`: this process, its children, or a Ray cluster."""

from __future__ import annotations

import importlib
import logging
import os
import socket
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from multiprocessing import resource_tracker
from typing import Any, Protocol

from drill_env._ending import end_with, uninterrupted
from drill_env._errors import InputError, printable
from drill_env._threads import on_one_thread

Task = Callable[[Any, Any], Any]


class Workers(Protocol):
    """At most `ahead` tasks are given to them at a time."""

    @property
    def ahead(self) -> int:
        """Tasks that keep all of them busy."""
        ...

    def submit(self, task: Task, *arguments: Any) -> Future[Any]:
        """Begin a task."""
        ...

    def stop(self, futures: Sequence[Future[Any]]) -> None:
        """End what still runs."""
        ...


class Here:
    """This process: a task is done once it is submitted."""

    ahead = 1

    def submit(self, task: Task, *arguments: Any) -> Future[Any]:
        """Do a task."""
        future: Future[Any] = Future()
        future.set_result(task(*arguments))
        return future

    def stop(self, futures: Sequence[Future[Any]]) -> None:
        """Nothing runs."""


class Processes:
    """Joblib's processes on this machine. They are kept from one use to the next."""

    def __init__(self, jobs: int) -> None:
        self._jobs, self.ahead = jobs, 2 * jobs

    def submit(self, task: Task, *arguments: Any) -> Future[Any]:
        """Begin a task; where a process died, in new ones."""
        # Where it is first needed, its start would let interrupts through again.
        resource_tracker.ensure_running()
        # A terminal's interrupt reaches them too, and while they import it would be a traceback.
        with uninterrupted():
            return self._executor().submit(on_one_thread, task, *arguments)

    def stop(self, futures: Sequence[Future[Any]]) -> None:
        """End all processes."""
        # Loky's thread fails over tasks that it has not yet put into its queue, which has room.
        until = time.monotonic() + 1.0
        while time.monotonic() < until and any(not (f.running() or f.done()) for f in futures):
            time.sleep(0.002)
        self._executor().shutdown(wait=True, kill_workers=True)

    def _executor(self) -> Any:
        from joblib.externals.loky import get_reusable_executor

        # Who was killed without a word cannot end its processes.
        return get_reusable_executor(
            max_workers=self._jobs, initializer=end_with, initargs=(os.getpid(),)
        )


class Cluster:
    """Tasks of Ray, which begins them again itself where a process or a machine dies."""

    def __init__(self, jobs: int | None, address: str | None, retries: int) -> None:
        ray = self._ray = _connected(address, jobs)
        self._jobs, self._refs = jobs, {}
        self._call = ray.remote(num_cpus=1, max_retries=retries)(on_one_thread)

    @property
    def ahead(self) -> int:
        """Twice the cores that are there now, or as many as may run at a time."""
        cores = max(1, int(self._ray.cluster_resources().get("CPU", 1)))
        return 2 * cores if self._jobs is None or self._jobs >= cores else self._jobs

    def submit(self, task: Task, *arguments: Any) -> Future[Any]:
        """Begin a task wherever a core is free."""
        ref = self._call.remote(task, *arguments)
        future = ref.future()
        self._refs[future] = ref
        future.add_done_callback(lambda done: self._refs.pop(done, None))
        return future

    def stop(self, futures: Sequence[Future[Any]]) -> None:
        """End what still runs; others use the cluster too."""
        for ref in list(self._refs.values()):
            self._ray.cancel(ref, force=True)


def _connected(address: str | None, jobs: int | None) -> Any:
    # Nobody asked for a report of what is run here.
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        ray: Any = importlib.import_module("ray")
    except ImportError as error:
        raise InputError("engine ray needs Ray: pip install 'drill-env[cluster]'") from error
    if ray.is_initialized():
        return ray
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.ERROR}
    try:
        if address is None:
            ray.init("local", num_cpus=jobs, include_dashboard=False, **quiet)
        else:
            _answers(address)
            ray.init(address, **quiet)
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(
            f"address {address}: {printable(error, 200)}; name a cluster that `ray start` began"
        ) from error
    return ray


def _answers(address: str) -> None:
    """Raise OSError where nothing listens; Ray itself would try for minutes."""
    host, colon, port = address.rpartition("://")[2].rpartition(":")
    if not colon:
        if address != "auto":
            raise ValueError("it is neither auto nor HOST:PORT")
        return
    socket.create_connection((host, int(port)), timeout=10.0).close()
