"""Independent work on several threads."""

from threading import Barrier, get_ident

import pytest

from drill_env._threads import each, on_one_thread


def test_results_keep_the_order_of_the_items_and_jobs_run_at_once():
    both = Barrier(2, timeout=10.0)

    def job(item: int) -> int:
        # Goes on only when another job is here, too.
        both.wait()
        return item * item

    assert each(job, iter(range(6)), threads=2) == [0, 1, 4, 9, 16, 25]


def test_within_a_job_items_follow_one_another_on_its_thread():
    def job(item: int) -> tuple[int, list[int]]:
        return get_ident(), each(lambda i: get_ident(), range(3), threads=2)

    for own, within in each(job, range(4), threads=2):
        assert own != get_ident()
        assert within == [own] * 3
    # And afterwards several run at once again.
    assert get_ident() not in each(lambda i: get_ident(), range(2), threads=2)


def test_an_error_of_a_job_reaches_the_caller():
    with pytest.raises(ZeroDivisionError):
        each(lambda item: 1 / item, [1, 0, 2], threads=2)


def test_on_one_thread_nothing_leaves_it_until_the_job_is_done():
    def idents(count: int) -> list[int]:
        return each(lambda i: get_ident(), range(count), threads=2)

    assert on_one_thread(idents, 3) == [get_ident()] * 3
    with pytest.raises(TypeError):
        on_one_thread(idents, None)  # type: ignore[arg-type]
    assert get_ident() not in idents(3)
