"""The picture of the rig: off-screen arrays and the window."""

import sys
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from drill_env.environment._render import STICK_BOX, Frame, Renderer, Traces

FRAME = Frame(
    t=1.0,
    theta_u=3.0,
    theta_l=1.0,
    omega_u=5.0,
    omega_l=2.0,
    setpoint=4.0,
    voltage=3.5,
    voltage_limit=5.0,
    stuck_u=False,
    stuck_l=False,
    reward=-0.5,
)
BRAKE_PAD = (433, 281)


def picture(*frames, **options):
    pytest.importorskip("pygame")
    renderer = Renderer("rgb_array", fps=25, **options)
    image = None
    for frame in frames:
        image = renderer.draw(frame)
    renderer.close()
    assert image is not None
    return image


def run(count):
    return [
        replace(FRAME, t=k / 25, omega_l=5 + 5 * np.sin(k / 9), theta_u=k / 5, stuck_l=k % 40 < 9)
        for k in range(count)
    ]


def crop(image, box):
    left, top, width, height = (int(x) for x in box)
    return image[top : top + height, left : left + width]


@pytest.mark.parametrize("size", [(960, 540), (480, 270), (640, 480), (300, 900)])
def test_array_has_the_asked_shape(size):
    image = picture(FRAME, size=size)
    assert image.shape == (size[1], size[0], 3)
    assert image.dtype == np.uint8
    assert image.flags.c_contiguous
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50


def test_same_frames_give_the_same_pixels():
    frames = run(80)
    np.testing.assert_array_equal(picture(*frames, window_s=2.0), picture(*frames, window_s=2.0))


def test_reset_forgets_the_traces():
    pytest.importorskip("pygame")
    renderer = Renderer("rgb_array", fps=25)
    for frame in run(50):
        renderer.draw(frame)
    renderer.reset()
    after = renderer.draw(FRAME)
    np.testing.assert_array_equal(after, picture(FRAME))


def test_arrays_do_not_share_memory():
    pytest.importorskip("pygame")
    renderer = Renderer("rgb_array", fps=25)
    first = renderer.draw(FRAME)
    assert first is not None
    kept = first.copy()
    renderer.draw(replace(FRAME, theta_u=0.0))
    np.testing.assert_array_equal(first, kept)


def test_drawing_a_frame_twice_changes_nothing():
    np.testing.assert_array_equal(picture(FRAME, FRAME), picture(FRAME))


@pytest.mark.parametrize(
    "change",
    [
        {"theta_u": 3.2, "theta_l": 1.2},
        {"theta_u": 3.2},
        {"theta_l": 1.2},
        {"omega_u": 5.5},
        {"omega_l": 2.5},
        {"setpoint": 9.0},
        {"voltage": -3.5},
        {"voltage_limit": 4.0},
        {"stuck_u": True},
        {"stuck_l": True},
        {"reward": 0.5},
    ],
    ids=lambda change: "+".join(change),
)
def test_every_field_shows(change):
    # Two frames, since a set point is a curve without a marker.
    second = replace(FRAME, t=2.0)
    plain, changed = picture(FRAME, second), picture(FRAME, replace(second, **change))
    if "setpoint" in change:
        changed = picture(replace(FRAME, **change), replace(second, **change))
    assert np.any(plain != changed)


def test_stick_is_flagged_at_the_brake():
    free, stuck = picture(FRAME), picture(replace(FRAME, stuck_l=True))
    label = crop(stuck, STICK_BOX)
    assert np.all(crop(free, STICK_BOX) == crop(free, STICK_BOX)[0, 0])
    red, green, blue = label.reshape(-1, 3).mean(axis=0)
    assert red > 200 > 120 > max(green, blue)
    assert label.min(axis=2).max() > 230, "white letters on red"
    assert np.ptp(free[BRAKE_PAD].astype(int)) < 40, "grey pad"
    red, green, blue = (int(x) for x in stuck[BRAKE_PAD])
    assert red > 2 * max(green, blue)


def test_string_reddens_with_twist():
    def redness(twist):
        string = crop(picture(replace(FRAME, theta_u=1.0 + twist)), (176, 210, 28, 180)).astype(int)
        return (string[..., 0] - string[..., 2]).max()

    steps = [redness(twist) for twist in (0.0, 2.0, 4.0, 7.0)]
    assert steps == sorted(set(steps))
    assert steps[0] < 20 < 100 < steps[-1]
    assert abs(redness(-4.0) - steps[2]) < 10


@pytest.mark.parametrize(
    "change",
    [
        {"setpoint": np.nan, "reward": np.nan},
        {"omega_u": 0.0, "omega_l": 0.0, "setpoint": 0.0, "voltage": 0.0},
        {"omega_u": 1e9, "omega_l": -1e9, "theta_u": 1e9, "voltage": 1e9, "reward": -1e12},
        {"t": 1e6},
    ],
    ids=["nan", "rest", "huge", "late"],
)
def test_odd_values_draw(change):
    frame = replace(FRAME, **change)
    picture(*(replace(frame, t=frame.t + k / 25) for k in range(5)))


def test_trace_forgets_what_left_the_window():
    traces = Traces(10.0)
    for frame in run(5000):
        traces.add(frame)
    t = traces.column("t")
    assert t[-1] == 4999 / 25
    assert t[0] <= t[-1] - 10.0 < t[1]
    assert len(t) <= 252


@pytest.mark.parametrize("step", [1e-5, 1e-3, 0.012, 0.04])
def test_trace_is_bounded_at_any_rate(step):
    traces = Traces(1.0)
    for k in range(20_000):
        traces.add(replace(FRAME, t=k * step))
        assert len(traces.frames) <= 1300
    t = traces.column("t")
    assert np.all(np.diff(t) > 0.0)
    assert t[-1] - t[0] >= min(1.0, 19_999 * step) - 1e-9


def test_time_going_back_starts_anew():
    traces = Traces(10.0)
    for frame in [*run(50), replace(FRAME, t=0.0)]:
        traces.add(frame)
    assert len(traces.frames) == 1


def test_arrays_need_no_display(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setattr(pygame.display, "init", lambda: pytest.fail("display opened"))
    monkeypatch.setattr(pygame.display, "set_mode", lambda *_: pytest.fail("window opened"))
    picture(FRAME)


def test_closed_renderer_gives_no_array():
    pytest.importorskip("pygame")
    renderer = Renderer("rgb_array", fps=25)
    renderer.close()
    renderer.close()
    with pytest.raises(gymnasium.error.ClosedEnvironmentError, match="closed"):
        renderer.draw(FRAME)


def test_window_opens_draws_and_closes_twice(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    renderer = Renderer("human", fps=200)
    assert not pygame.display.get_init()
    for frame in run(3):
        assert renderer.draw(frame) is None
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).transpose(1, 0, 2)
    np.testing.assert_array_equal(shown, picture(*run(3)))
    renderer.close()
    assert not pygame.display.get_init()
    renderer.close()
    assert renderer.draw(FRAME) is None


def test_window_keeps_to_the_frame_rate(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    renderer = Renderer("human", fps=20)
    renderer.draw(FRAME)
    start = pygame.time.get_ticks()
    for k in range(6):
        renderer.draw(replace(FRAME, t=2.0 + k))
    assert pygame.time.get_ticks() - start >= 6 * 50 - 60
    renderer.close()


def test_quit_event_closes_the_window(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    renderer = Renderer("human", fps=200)
    renderer.draw(FRAME)
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    assert renderer.draw(FRAME) is None
    assert not pygame.display.get_init()
    assert renderer.draw(FRAME) is None
    renderer.close()


def test_missing_pygame_names_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(gymnasium.error.DependencyNotInstalled, match=r"drill-env\[render\]"):
        Renderer("rgb_array", fps=25)
