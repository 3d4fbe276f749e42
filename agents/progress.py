"""Progress bar, learning curve and checkpoints of a training run."""

from __future__ import annotations

import csv
import os
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from stable_baselines3.common.callbacks import BaseCallback

from drill_env._files import make_folder, replacing


class TrainingProgress(BaseCallback):
    """Shows the mean return of the last episodes, keeps a curve and checkpoints.

    Args:
        total: steps of the whole training.
        folder: where ``checkpoint.zip`` and ``curve.csv`` go.
        every: steps between checkpoints.
        console: where the bar is drawn.

    Attributes:
        seconds: that the training took, known once it has ended.
        cpu_seconds: likewise, of all threads.
        interrupted: whether an interrupt has asked to stop.
    """

    def __init__(self, total: int, folder: Path, every: int, console: Console) -> None:
        super().__init__()
        self._total, self._folder, self._every = total, make_folder(folder), every
        self._bar = Progress(
            TextColumn("training"), BarColumn(), TextColumn("{task.completed:,} steps"),
            TextColumn("return {task.fields[score]}"), TimeRemainingColumn(), console=console,
        )  # fmt: skip
        self._due = every
        self._curve: list[tuple[int, float]] = []
        self.seconds = self.cpu_seconds = 0.0
        self._began = (0.0, 0.0)
        self.interrupted = False

    @contextmanager
    def interruptible(self) -> Iterator[None]:
        """Inside, the first interrupt ends the training after its step, the second at once.

        An exception raised in the midst of a library's clean-up would be lost.
        """
        former = signal.getsignal(signal.SIGINT)

        def ask(_number: int, _frame: Any) -> None:
            self.interrupted = True
            signal.signal(signal.SIGINT, former)
            # Not through a stream, which this may have interrupted in the midst of a write.
            os.write(2, b"\nending after this step; interrupt again to stop at once\n")

        if not callable(former):
            # Ignored by whoever started this, or none of Python's: they stay so.
            yield
            return
        signal.signal(signal.SIGINT, ask)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, former)

    def _on_training_start(self) -> None:
        self._due = self.model.num_timesteps + self._every
        self._began = (time.perf_counter(), time.process_time())
        self._bar.start()
        self._task = self._bar.add_task("", total=self._total, score="-")

    def _on_step(self) -> bool:
        self._bar.update(self._task, completed=self.model.num_timesteps)
        return not self.interrupted

    def _on_rollout_end(self) -> None:
        episodes = self.model.ep_info_buffer
        if episodes:
            mean = float(np.mean([episode["r"] for episode in episodes]))
            self._curve.append((self.model.num_timesteps, mean))
            self._bar.update(self._task, score=f"{mean:.1f}")
        if self.model.num_timesteps >= self._due:
            self.save()
            self._due += self._every

    def save(self) -> None:
        """Write the checkpoint and the curve, each whole or not at all."""
        with replacing(self._folder / "checkpoint.zip") as name:
            self.model.save(name)
        curve = self._folder / "curve.csv"
        old = []
        if curve.is_file() and self._curve:
            with curve.open(encoding="utf-8") as stream:
                first = self._curve[0][0]
                old = [row for row in list(csv.reader(stream))[1:] if int(row[0]) < first]
        with replacing(curve) as name, name.open("w", encoding="utf-8", newline="") as stream:
            csv.writer(stream).writerows([("steps", "mean_return"), *old, *self._curve])

    def _on_training_end(self) -> None:
        self._bar.stop()
        self.seconds = round(time.perf_counter() - self._began[0], 1)
        self.cpu_seconds = round(time.process_time() - self._began[1], 1)
        self.save()
