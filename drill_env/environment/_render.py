"""Picture of the rig and its recent traces."""

from __future__ import annotations

from typing import Literal

import numpy as np
from gymnasium.error import ClosedEnvironmentError
from numpy.typing import NDArray

from drill_env.environment._charts import draw_charts, draw_readouts
from drill_env.environment._drawing import Canvas, Window
from drill_env.environment._frame import Frame, Traces
from drill_env.environment._scene import STICK_BOX, draw_rig

__all__ = ["STICK_BOX", "Frame", "Renderer", "Traces"]


class Renderer:
    """Draws the rig and its traces, on the screen or into arrays."""

    def __init__(
        self,
        mode: Literal["human", "rgb_array"],
        *,
        fps: int,
        window_s: float = 10.0,
        size: tuple[int, int] = (960, 540),
    ) -> None:
        """Prepare the surfaces; a window opens with the first picture.

        Args:
            mode: "human" shows each picture in a window, "rgb_array" returns it.
            fps: frames per second the window keeps to.
            window_s: seconds of traces to show.
            size: width and height of the picture in pixels.

        Raises:
            DependencyNotInstalled: pygame is missing.
        """
        self._mode = mode
        self._fps = fps
        self._size = size
        self._canvas = Canvas(size)
        self._traces = Traces(window_s)
        self._window: Window | None = None
        self._closed = False

    def reset(self) -> None:
        """Clear the traces."""
        self._traces.frames.clear()

    def draw(self, frame: Frame) -> NDArray[np.uint8] | None:
        """Draw one instant.

        Args:
            frame: the instant; its trace is kept for the pictures that follow.

        Returns:
            The picture, shape (height, width, 3), or None in human mode. Once its
            window is closed, human mode draws nothing.

        Raises:
            ClosedEnvironmentError: asked for an array after `close`.
        """
        if self._closed:
            if self._mode == "human":
                return None
            raise ClosedEnvironmentError("the renderer is closed, make a new environment")
        self._traces.add(frame)
        self._canvas.begin()
        draw_rig(self._canvas, frame)
        draw_readouts(self._canvas, frame)
        draw_charts(self._canvas, self._traces, frame)
        picture = self._canvas.finish()
        if self._mode == "rgb_array":
            return self._canvas.pixels()
        if self._window is None:
            self._window = Window(self._size, self._fps)
        if not self._window.show(picture):
            self.close()
        return None

    def close(self) -> None:
        """Close the window; again is harmless."""
        if self._window is not None:
            self._window.close()
        self._window = None
        self._closed = True
