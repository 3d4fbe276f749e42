"""Many independent runs: in this process, in processes of this machine, or on a Ray cluster.

Joblib's own Ray backend (`ray.util.joblib`) is not used: it gives no result before the last one is
there, deals tasks out in turn whoever is free, and loses them all with one worker.
"""

from __future__ import annotations

import os
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import dataclass
from typing import Any, Literal, TypeVar, get_args

from threadpoolctl import threadpool_limits

from drill_env._errors import InputError, printable
from drill_env._workers import Cluster, Here, Processes, Workers

Kind = Literal["local", "ray"]
Progress = Callable[[int, int], None]
T = TypeVar("T")
R = TypeVar("R")

# Results that may wait for an earlier one, for each task that is sent ahead. Two are sent to a
# worker, so a run that takes as long as fifteen others delays none.
_ROOM = 8


@dataclass(frozen=True, slots=True)
class Engine:
    """Where many independent runs go. Results are the same everywhere, to the last bit.

    Args:
        kind: "local", or "ray" for a cluster.
        jobs: runs at a time; all cores by default, with Ray those of the whole cluster. One with
            "local" stays in this process.
        address: of a running Ray cluster, as "auto" or "HOST:6379"; by default Ray is started on
            this machine.
        retries: how often a run whose process or machine dies is begun again, 1 or more.

    Raises:
        InputError: a value is out of range, or an address is given without Ray.
    """

    kind: Kind = "local"
    jobs: int | None = None
    address: str | None = None
    retries: int = 3

    def __post_init__(self) -> None:
        if self.kind not in get_args(Kind):
            raise InputError(f"engine is {self.kind!r}: give local or ray")
        for what in ("jobs", "retries"):
            value = getattr(self, what)
            if value is not None and value < 1:
                raise InputError(f"{what} is {value}: give 1 or more")
        if self.address is not None and self.kind != "ray":
            raise InputError(f"address {self.address} is that of a cluster: give engine ray too")


SERIAL = Engine(jobs=1)


class TaskError(RuntimeError):
    """One of many runs that failed.

    Attributes:
        reason: what went wrong, without the run's name.
        bad_input: whether its input is to blame.
    """

    def __init__(self, name: str, reason: str, *, bad_input: bool = False, trace: str = "") -> None:
        super().__init__(f"{name}: {reason}")
        self.reason, self.bad_input = reason, bad_input
        if trace:
            self.add_note(trace)


def run(
    function: Callable[[T], R], tasks: Sequence[T], engine: Engine = SERIAL, *,
    name: Callable[[T], str] = str, progress: Progress | None = None,
) -> Generator[R, None, None]:  # fmt: skip
    """Results of all tasks in their order, each as soon as it and all before it are there.

    Args:
        function: what is done with a task; both are sent to the workers.
        tasks: what differs from run to run.
        engine: where they run.
        name: what errors call a task.
        progress: called with (done, total).

    Raises:
        InputError: the input of a run is bad; the first one in order is named.
        TaskError: it failed otherwise, or its process died again and again.
    """
    with closing(outcomes(function, tasks, engine, name=name, progress=progress)) as found:
        for outcome in found:
            if isinstance(outcome, TaskError):
                raise InputError(outcome) if outcome.bad_input else outcome
            yield outcome


def outcomes(
    function: Callable[[T], R], tasks: Sequence[T], engine: Engine = SERIAL, *,
    name: Callable[[T], str] = str, progress: Progress | None = None,
) -> Generator[R | TaskError, None, None]:  # fmt: skip
    """As `run`, but where a run fails its error takes the place of a result, and the others go on.

    What still runs is ended when the iterator is closed or the process is interrupted.
    """
    tell = progress or (lambda done, total: None)
    tell(0, len(tasks))
    if not tasks:
        return
    workers = _workers_of(engine)
    flight = _Flight(function, iter(tasks), workers, engine.retries, name)
    try:
        for done in range(1, len(tasks) + 1):
            outcome = flight.next()
            tell(done, len(tasks))
            yield outcome
    except BaseException:
        workers.stop([job.future for job in flight.jobs if job.future is not None])
        raise


def _workers_of(engine: Engine) -> Workers:
    if engine.kind == "ray":
        return Cluster(engine.jobs, engine.address, engine.retries)
    jobs = engine.jobs or os.cpu_count() or 1
    return Here() if jobs == 1 else Processes(jobs)


def _attempt(function: Callable[[T], R], task: T) -> tuple[R | None, dict[str, Any] | None]:
    """The result or, as any process can read it, what went wrong."""
    try:
        # How many threads a sum is split over changes its last digit.
        with threadpool_limits(1):
            return function(task), None
    except (InputError, MemoryError) as error:
        return None, {"reason": printable(error) or "the memory is full", "bad_input": True}
    except Exception as error:
        reason = f"{type(error).__name__}: {printable(error)}"
        return None, {"reason": reason, "trace": traceback.format_exc()}


@dataclass(slots=True, eq=False)
class _Job:
    task: Any
    future: Future[Any] | None = None
    deaths: int = 0


class _Flight:
    """Tasks that were begun and whose results were not taken yet, in order."""

    def __init__(
        self, function: Callable[[T], R], tasks: Iterator[T], workers: Workers, retries: int,
        name: Callable[[T], str],
    ) -> None:  # fmt: skip
        self.jobs: deque[_Job] = deque()
        self._function, self._left, self._workers = function, tasks, workers
        self._retries, self._name = retries, name

    def next(self) -> Any:
        """The result of the first task, or its `TaskError`."""
        while True:
            for job in self.jobs:
                self._begin_again(job)
            self._fill()
            first = self.jobs[0].future
            if first is not None and first.done() and not self._died(self.jobs[0]):
                return self._told(self.jobs.popleft())
            wait([j.future for j in self._busy() if j.future], return_when=FIRST_COMPLETED)

    def _busy(self) -> list[_Job]:
        return [j for j in self.jobs if j.future is not None and not j.future.done()]

    def _fill(self) -> None:
        busy, ahead = self._busy(), self._workers.ahead
        while len(busy) < ahead and not any(self._suspect(j) for j in busy):
            job = next((j for j in self.jobs if j.future is None), None)
            if job is None and len(self.jobs) < _ROOM * ahead:
                job = next((_Job(task) for task in self._left), None)
                self.jobs.extend([] if job is None else [job])
            if job is None or (busy and self._suspect(job)):
                return
            try:
                job.future = self._workers.submit(_attempt, self._function, job.task)
            except BrokenProcessPool:
                return
            busy.append(job)

    def _suspect(self, job: _Job) -> bool:
        """Whether it was there so often when a process died that it must now run alone."""
        return job.deaths == self._retries

    def _died(self, job: _Job) -> bool:
        """Whether it was there when a process died, and may be begun again."""
        if job.future is None or not job.future.done() or job.deaths > self._retries:
            return False
        return isinstance(job.future.exception(), BrokenProcessPool)

    def _begin_again(self, job: _Job) -> None:
        if self._died(job):
            job.deaths += 1
            if job.deaths <= self._retries:
                job.future = None

    def _told(self, job: _Job) -> Any:
        assert job.future is not None
        error = job.future.exception()
        if error is not None:
            # Its process died, or what it gave back cannot be sent.
            reason = f"its process failed ({type(error).__name__}: {printable(error, 200)})"
            return TaskError(self._name(job.task), reason)
        result, fault = job.future.result()
        return result if fault is None else TaskError(self._name(job.task), **fault)
