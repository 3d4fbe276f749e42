"""How long a search goes on, and who may end it."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from drill_env._compiling import spent

Report = Callable[[str], bool | None]
"""Told what is done next; where it returns True, what can be left out is left out."""

ASKED = "asked"
"""That somebody asked for the end."""


def never() -> bool:
    """Nobody ends it."""
    return False


def stopwatch() -> Callable[[], float]:
    """What tells seconds since now: by the clock or of this process' CPU, whichever are fewer.

    By the clock alone a search would try less where the machine does other things, of CPU alone
    where several threads work. Compiling, which is done once, does not count.
    """
    began = _spent_on_work()
    return lambda: min(now - then for now, then in zip(_spent_on_work(), began, strict=True))


class Watch:
    """A report that ends a search when its time is over or when somebody asks for it.

    What ended stays ended: whatever is told after that is left out, too, where it can be.

    Attributes:
        ended: what the search was ended by, empty if it was not.
    """

    def __init__(self, report: Report, seconds: float = math.inf) -> None:
        """Begin.

        Args:
            report: told what is done next, and asked whether to end.
            seconds: of a `stopwatch` after which the search is ended.
        """
        self.report, self.seconds = report, seconds
        self.ended = ""
        self._worked = stopwatch()

    def over(self) -> bool:
        """Whether it is ended, asked within one thing that takes long."""
        if not self.ended and self._worked() > self.seconds:
            self.ended = f"{self.seconds:g} s"
        return bool(self.ended)

    def left(self) -> float:
        """Seconds that are left."""
        return 0.0 if self.over() else self.seconds - self._worked()

    def __call__(self, text: str) -> bool:
        """Tell what is done next; returns whether to leave it out if that is possible."""
        asked = self.report(text) is True
        if not self.ended and asked:
            self.ended = ASKED
        return self.over()


def _spent_on_work() -> tuple[float, float]:
    """Seconds by the clock and of CPU, without those of compiling."""
    return time.monotonic() - spent(), time.process_time() - spent()


def over_by(report: Report) -> Callable[[], bool]:
    """What tells, within one thing that takes long, whether a report ended it."""
    return report.over if isinstance(report, Watch) else never


def left_by(report: Report) -> float:
    """Seconds that a report leaves."""
    return report.left() if isinstance(report, Watch) else math.inf
