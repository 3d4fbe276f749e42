"""Many runs: their order, errors, deaths and end, the same at any number of workers."""

from __future__ import annotations

import functools
import os
import threading
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from drill_env import Engine, InputError
from drill_env._engine import SERIAL, TaskError, outcomes, run
from drill_env._threads import each

TWO = Engine(jobs=2)


def spread(number: int) -> bool:
    """Whether independent work within a task leaves its thread."""
    return threading.get_ident() not in each(lambda i: threading.get_ident(), range(2), threads=2)


def numbers(seed: int) -> bytes:
    """Sums whose last digit depends on the order of their parts; the first takes longest."""
    time.sleep(0.3 if seed == 0 else 0.0)
    many = np.random.default_rng(seed).normal(size=(200, 200))
    return (many @ many).tobytes() + np.linalg.svd(many, compute_uv=False).tobytes()


def marked(folder: Path, number: int) -> int:
    (folder / str(number)).touch()
    return number


def faulty(number: int) -> int:
    if number == 2:
        time.sleep(0.3)
        raise ValueError("no root")
    if number == 3:
        raise InputError("rig.toml: no km; add it")
    return 10 * number


def mortal(folder: Path, number: int) -> float:
    """Its process dies, as where the memory is full: once at 3, always at 5."""
    once = folder / "once"
    if number == 3 and not once.exists():
        once.touch()
        os._exit(9)
    if number == 5:
        os._exit(9)
    return float(np.random.default_rng(number).normal())


def endless(folder: Path, number: int) -> int:
    if number:
        (folder / str(number)).write_text(str(os.getpid()))
        time.sleep(120.0)
    return number


def secret(number: int) -> object:
    return threading.Lock() if number == 1 else number


def named(number: int) -> str:
    return f"case {number}"


def test_results_are_the_same_and_in_order_at_any_number_of_workers():
    alone = list(run(numbers, range(8)))
    for seed, one in enumerate(alone):
        assert np.frombuffer(one) == pytest.approx(np.frombuffer(numbers(seed)), abs=1e-9)
    seen: list[tuple[int, int]] = []
    assert list(run(numbers, range(8), TWO, progress=lambda *now: seen.append(now))) == alone
    assert seen == [(done, 8) for done in range(9)]
    assert list(run(numbers, range(8), Engine(jobs=3))) == alone
    assert list(run(numbers, [])) == []


def test_tasks_that_share_the_processors_keep_to_one_thread_each():
    assert list(run(spread, range(2), SERIAL)) == [True, True]
    assert list(run(spread, range(2), TWO)) == [False, False]


def test_no_more_is_begun_than_was_asked_for(tmp_path):
    found = run(functools.partial(marked, tmp_path), range(400), SERIAL)
    assert [next(found), next(found)] == [0, 1]
    assert len(list(tmp_path.iterdir())) == 2
    ahead = tmp_path / "ahead"
    ahead.mkdir()
    with closing(run(functools.partial(marked, ahead), range(400), TWO)) as found:
        assert next(found) == 0
        time.sleep(0.5)
        assert 1 < len(list(ahead.iterdir())) <= 33
        assert next(found) == 1


@pytest.mark.parametrize("engine", [SERIAL, TWO])
def test_the_first_error_in_order_is_raised_under_its_tasks_name(engine):
    found = run(faulty, range(6), engine, name=named)
    assert [next(found), next(found)] == [0, 10]
    with pytest.raises(TaskError, match="^case 2: ValueError: no root") as told:
        next(found)
    assert "in faulty" in told.value.__notes__[0]
    with pytest.raises(InputError, match="^case 3: rig.toml: no km; add it$"):
        list(run(faulty, [3, 2], engine, name=named))


@pytest.mark.parametrize("engine", [SERIAL, TWO])
def test_the_others_go_on_where_errors_are_results(engine):
    found = list(outcomes(faulty, range(6), engine, name=named))
    errors = [(str(e), e.bad_input) for e in found[2:4] if isinstance(e, TaskError)]
    assert errors == [
        ("case 2: ValueError: no root", False), ("case 3: rig.toml: no km; add it", True)
    ]  # fmt: skip
    assert [*found[:2], *found[4:]] == [0, 10, 40, 50]


def test_a_run_whose_process_dies_is_begun_again_and_given_up_only_if_it_kills_alone(tmp_path):
    found = list(outcomes(functools.partial(mortal, tmp_path), range(9), TWO, name=named))
    assert isinstance(found[5], TaskError) and not found[5].bad_input
    assert str(found[5]).startswith("case 5: its process failed")
    whole = [0, 1, 2, 3, 4, 6, 7, 8]
    assert [found[i] for i in whole] == [mortal(tmp_path, i) for i in whole]


def test_a_result_that_cannot_be_sent_is_an_error_of_its_task():
    found = list(outcomes(secret, range(3), TWO, name=named))
    assert [found[0], found[2]] == [0, 2]
    assert isinstance(found[1], TaskError) and "case 1" in str(found[1])


def test_an_interruption_ends_what_runs(tmp_path):
    def interrupt(done: int, total: int) -> None:
        while done == 1 and not (tmp_path / "2").exists():
            time.sleep(0.01)
        if done == 1:
            raise KeyboardInterrupt

    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        list(run(functools.partial(endless, tmp_path), range(3), TWO, progress=interrupt))
    assert time.monotonic() - began < 30.0
    for number in (1, 2):
        pid = (tmp_path / str(number)).read_text()
        state = Path(f"/proc/{pid}/stat")
        assert not state.exists() or state.read_text().split()[2] == "Z"


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"kind": "moon"}, "moon"),
        ({"jobs": 0}, "jobs is 0"),
        ({"retries": 0}, "retries is 0"),
        ({"address": "auto"}, "engine ray"),
    ],
)
def test_bad_engines_are_named(options, text):
    with pytest.raises(InputError, match=text):
        Engine(**options)
