"""A search that ends early: by its time, by a report that asks for it, by an interrupt."""

from __future__ import annotations

import signal
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest

from benchmarks.concealed.recordings import Hidden
from drill_env import InputError, Rig, _jit
from drill_env._watch import Watch, over_by
from drill_env.cli._common import first_interrupt, stages
from drill_env.diagnosis.base import base_fit
from drill_env.diagnosis.diagnose import diagnose
from drill_env.diagnosis.extended import evaluate
from drill_env.diagnosis.joint import descend_jointly
from drill_env.diagnosis.options import DiagnosisOptions
from drill_env.effects import LIBRARY
from drill_env.identification.samples import prepare
from tests.made_recordings import made


def test_a_search_ends_when_its_time_is_over_and_stays_ended():
    watch = Watch(lambda text: None, 0.05)
    assert not watch("one")
    clock, cpu = time.monotonic(), time.process_time()
    # Threads that other tests left may work, too: of CPU more may go by than by the clock.
    while min(time.monotonic() - clock, time.process_time() - cpu) < 0.06:
        pass
    assert watch("two")
    assert watch("three")
    assert watch.ended == "0.05 s"


def test_neither_an_idle_process_nor_a_second_thread_ends_a_search(monkeypatch):
    """It ends when its time is over by the clock and by what it worked."""
    clock, cpu = [0.0], [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    monkeypatch.setattr(time, "process_time", lambda: cpu[0])
    watch = Watch(lambda text: None, 10.0)
    told: list[str] = []
    bar = SimpleNamespace(
        disable=False, add_task=lambda text, total: 0,
        update=lambda task, description: told.append(description),
    )  # fmt: skip
    tell = stages(bar, 10.0)  # type: ignore[arg-type]
    clock[0], cpu[0] = 11.0, 9.0
    assert not watch("other processes had the machine")
    clock[0], cpu[0] = 9.0, 17.0
    assert not watch("two threads worked")
    tell("trying")
    # The time that is shown is the time that ends it.
    assert told == ["trying (9 of at most 10 s)"]
    clock[0], cpu[0] = 10.5, 17.0
    assert watch("both")


def test_compiling_takes_none_of_the_time():
    """Else the first search on a machine would try less than the second."""

    def compiled(name: str) -> float:
        scope = {"entry": _jit.entry, "__name__": "drill_env.made_up"}
        exec(f"@entry\ndef {name}(x):\n    return x * x * x", scope)
        return scope[name](2.0)

    # The first one of a process loads the compiler, too.
    compiled("first")
    watch = Watch(lambda text: None, 0.02)
    began = time.process_time()
    assert compiled("cube") == 8.0
    assert time.process_time() - began > 0.03
    assert not watch("one")


def test_a_search_ends_when_its_report_asks_for_it():
    told = []

    def report(text):
        told.append(text)
        return text == "two"

    watch = Watch(report)
    assert [watch(text) for text in ("one", "two", "three")] == [False, True, True]
    assert told == ["one", "two", "three"]


def test_no_time_is_an_error():
    with pytest.raises(InputError, match="seconds is 0"):
        DiagnosisOptions(seconds=0)


@pytest.fixture
def handled():
    """How interrupts are handled where nobody ignores them; in the background shells do."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield signal.default_int_handler
    signal.signal(signal.SIGINT, before)


def test_the_first_interrupt_asks_and_the_second_one_interrupts(capsys, handled):
    with first_interrupt() as asked:
        assert not asked.is_set()
        signal.raise_signal(signal.SIGINT)
        assert asked.is_set()
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is handled
    assert "interrupt again" in capsys.readouterr().err


def test_what_the_shell_ignores_stays_ignored(handled):
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with first_interrupt() as asked:
        signal.raise_signal(signal.SIGINT)
        assert not asked.is_set()
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN


def offered(*names):
    return DiagnosisOptions(leave_out=tuple(n for n in LIBRARY if n not in names))


@pytest.fixture(scope="module")
def recordings():
    """Two of a rig with an unbalance."""
    hidden = (Hidden("unbalance", {"torque": 0.03, "phase": 0.5}),)
    return [made(Rig.paper(), hidden, (7, i), seconds=15.0) for i in range(2)]


@pytest.mark.parametrize(("last", "found"), [("looking for more", ["unbalance"]), ("fitting", [])])
def test_what_is_known_by_then_is_judged(recordings, last, found):
    """Asked to end before a second effect is looked for, and before anything is."""
    told = []

    def report(text):
        told.append(text)
        return text.startswith(last)

    result = diagnose(
        recordings[:1], Rig.paper(), recordings[1:], options=offered("unbalance", "whirl_drag"),
        report=report,
    ).result  # fmt: skip
    assert not result.complete
    assert "ended early, when it was asked to" in result.sentences[-1]
    assert told[-1] == "judging held-out recordings"
    if found:
        assert [effect.id for effect in result.effects] == found
    else:
        # One candidate was tried; where the others are left out, the next one is told.
        assert 1 <= sum(text.startswith("trying") for text in told) <= 2


def test_a_descent_ends_within_when_the_time_is_over(recordings):
    """One candidate may take longer than all that is left."""
    samples = [prepare(r, Rig.paper()) for r in recordings]
    setting, start = base_fit(samples, Rig.paper().replace(km=4.0), ("km", "Jl"))
    far = evaluate(
        setting, setting.coordinates.vector(setting.coordinates.base), (), start.noise,
        start.starts, start.motions,
    )  # fmt: skip
    watch = Watch(lambda text: None, 0.0)
    whole = descend_jointly(setting, far, limit=10, enough=1e-6)
    part = descend_jointly(replace(setting, over=over_by(watch)), far, limit=10, enough=1e-6)
    assert whole.value < part.value < far.value
    assert watch.ended == "0 s"
