"""Drawing surface, charts and window on pygame, which is imported on first use."""

from __future__ import annotations

import os
from math import ceil, floor, log10
from types import ModuleType
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from gymnasium.error import DependencyNotInstalled
from numpy.typing import NDArray

from drill_env._types import FloatArray

if TYPE_CHECKING:
    import pygame

Color: TypeAlias = tuple[int, int, int]
Point: TypeAlias = tuple[float, float]
Box: TypeAlias = tuple[float, float, float, float]
"""Left, top, width, height."""

WIDTH, HEIGHT = 960, 540
"""The picture's own units; every size of output shows the same layout."""

PAPER: Color = (250, 250, 247)
WHITE: Color = (255, 255, 255)
INK: Color = (38, 44, 52)
MUTED: Color = (122, 130, 140)
GRID: Color = (225, 227, 228)
STAND: Color = (208, 212, 216)
ALARM: Color = (206, 46, 40)
VOLTAGE: Color = (30, 128, 104)

_SUPERSAMPLE = 2
# pygame draws its own font at this share of the size asked for.
_DEFAULT_FONT_SHRINK = 0.6875
_ANCHORS = {"left": 0.0, "center": 0.5, "right": 1.0}


def load_pygame() -> ModuleType:
    """Import pygame, an optional dependency.

    Returns:
        The module.

    Raises:
        DependencyNotInstalled: it is missing.
    """
    # pygame greets on stdout, where it would mix with a command's output.
    os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
    try:
        import pygame
    except ImportError as error:
        message = "pygame is not installed, run `pip install drill-env[render]`"
        raise DependencyNotInstalled(message) from error
    return pygame


def mix(a: Color, b: Color, share: float) -> Color:
    """Blend two colours.

    Args:
        a: colour at share 0.
        b: colour at share 1.
        share: share of `b`, clipped to 0..1.

    Returns:
        The blended colour.
    """
    s = min(max(share, 0.0), 1.0)
    red, green, blue = (round(x + s * (y - x)) for x, y in zip(a, b, strict=True))
    return red, green, blue


def minus(string: str) -> str:
    """Set a formatted number with a proper minus sign.

    Args:
        string: the number.

    Returns:
        The number, to be shown.
    """
    return string.replace("-", "\u2212")


def ticks(low: float, high: float, count: int) -> list[float]:
    """Round values inside a range.

    Args:
        low: lower end.
        high: upper end, above `low`.
        count: largest number of intervals wanted.

    Returns:
        Multiples of 1, 2 or 5 times a power of ten, ascending.
    """
    raw = (high - low) / count
    power = 10.0 ** floor(log10(raw))
    step = next(m * power for m in (1.0, 2.0, 5.0, 10.0) if m * power >= raw * (1.0 - 1e-9))
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


class Canvas:
    """Anti-aliased shapes and text in picture units, on an off-screen surface.

    All of it is drawn enlarged and averaged down.
    """

    def __init__(self, size: tuple[int, int]) -> None:
        """Allocate the surfaces.

        Args:
            size: width and height of the output in pixels.
        """
        self._pygame = load_pygame()
        self._pygame.font.init()
        width, height = size
        self._scale = min(width / WIDTH, height / HEIGHT)
        self._origin = (width - self._scale * WIDTH) / 2, (height - self._scale * HEIGHT) / 2
        self._large = self._pygame.Surface((width * _SUPERSAMPLE, height * _SUPERSAMPLE), 0, 32)
        self._final = self._pygame.Surface(size, 0, 32)
        self._fonts: dict[int, pygame.font.Font] = {}

    def begin(self) -> None:
        """Start a new picture."""
        self._large.fill(PAPER)

    def finish(self) -> pygame.Surface:
        """Average the picture down.

        Returns:
            The picture, valid until the next `finish`.
        """
        self._pygame.transform.smoothscale(self._large, self._final.get_size(), self._final)
        return self._final

    def pixels(self) -> NDArray[np.uint8]:
        """Copy the finished picture into an image array.

        Returns:
            Red, green, blue, shape (height, width, 3).
        """
        columns = self._pygame.surfarray.array3d(self._final)
        return np.ascontiguousarray(columns.transpose(1, 0, 2))

    def text(
        self, string: str, at: Point, size: int = 12, color: Color = INK, anchor: str = "left"
    ) -> None:
        """Set a line of text, centred vertically on a point.

        Args:
            string: the text.
            at: the point.
            size: font size in picture units.
            color: text colour.
            anchor: which end lies at the point: left, center or right.
        """
        image = self._font(size).render(string, True, color)
        (x, y), *_ = self._pixels([at])
        left, top = x - _ANCHORS[anchor] * image.get_width(), y - image.get_height() / 2
        self._large.blit(image, (round(left), round(top)))

    def polygon(self, color: Color, points: list[Point] | FloatArray) -> None:
        """Fill a polygon with at least three corners."""
        self._pygame.draw.polygon(self._large, color, self._pixels(points))

    def line(self, color: Color, a: Point, b: Point, width: float = 1.0) -> None:
        """Draw a straight line."""
        self._pygame.draw.line(self._large, color, *self._pixels([a, b]), width=self._width(width))

    def polyline(self, color: Color, points: FloatArray, width: float = 1.0) -> None:
        """Draw a curve through at least two points, shape (n, 2)."""
        pixels, thick = self._pixels(points), self._width(width)
        self._pygame.draw.lines(self._large, color, False, pixels, width=thick)
        if thick > 2:
            # Thick segments are bare rectangles: without round joints, sharp peaks show gaps.
            for point in pixels:
                self._pygame.draw.circle(self._large, color, point, (thick - 1) // 2)

    def ellipse(self, color: Color, center: Point, rx: float, ry: float) -> None:
        """Fill an ellipse."""
        self._pygame.draw.ellipse(
            self._large, color, self._rect((*_corner(center, rx, ry), 2 * rx, 2 * ry))
        )

    def ring(self, color: Color, center: Point, rx: float, ry: float) -> None:
        """Outline an ellipse."""
        rect = self._rect((*_corner(center, rx, ry), 2 * rx, 2 * ry))
        self._pygame.draw.ellipse(self._large, color, rect, self._width(1.0))

    def box(self, color: Color, box: Box, radius: float = 0.0) -> None:
        """Fill a rectangle, with round corners if a radius is given."""
        corner = round(radius * self._scale * _SUPERSAMPLE)
        self._pygame.draw.rect(self._large, color, self._rect(box), border_radius=corner)

    def clip(self, box: Box | None) -> None:
        """Confine the shapes to a box until the next call; None lifts it."""
        self._large.set_clip(None if box is None else self._rect(box))

    def _pixels(self, points: list[Point] | FloatArray) -> list[Point]:
        grid = (np.asarray(points, dtype=np.float64) * self._scale + self._origin) * _SUPERSAMPLE
        # SDL takes 32-bit coordinates; far outside the picture the exact place is moot.
        return [(x, y) for x, y in np.rint(np.clip(grid, -1e4, 1e5)).tolist()]

    def _rect(self, box: Box) -> pygame.Rect:
        (x0, y0), (x1, y1) = self._pixels([box[:2], (box[0] + box[2], box[1] + box[3])])
        return self._pygame.Rect(int(x0), int(y0), int(x1 - x0), int(y1 - y0))

    def _width(self, width: float) -> int:
        return max(1, round(width * self._scale * _SUPERSAMPLE))

    def _font(self, size: int) -> pygame.font.Font:
        if size not in self._fonts:
            # The font pygame ships, not one of the system's: pixels agree between machines.
            height = max(6, round(size * self._scale * _SUPERSAMPLE / _DEFAULT_FONT_SHRINK))
            self._fonts[size] = self._pygame.font.Font(None, height)
        return self._fonts[size]


def _corner(center: Point, rx: float, ry: float) -> Point:
    return center[0] - rx, center[1] - ry


class Window:
    """A window on the screen that keeps to a frame rate."""

    def __init__(self, size: tuple[int, int], fps: int) -> None:
        """Open the window.

        Args:
            size: width and height in pixels.
            fps: frames per second.
        """
        self._pygame = load_pygame()
        self._pygame.display.init()
        self._screen = self._pygame.display.set_mode(size)
        self._pygame.display.set_caption("drill-env")
        self._clock = self._pygame.time.Clock()
        self._fps = fps

    def show(self, picture: pygame.Surface) -> bool:
        """Show a picture and wait for the next frame's time.

        Args:
            picture: what to show.

        Returns:
            Whether the window stays open; False once the user asked to close it.
        """
        if any(event.type == self._pygame.QUIT for event in self._pygame.event.get()):
            return False
        self._screen.blit(picture, (0, 0))
        self._pygame.display.flip()
        self._clock.tick(self._fps)
        return True

    def close(self) -> None:
        """Close the window; again is harmless."""
        self._pygame.display.quit()
