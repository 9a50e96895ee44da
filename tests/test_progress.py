"""Progress of long calls: what a terminal, a log and a notebook show, and when.

The two seconds are a parameter here, so that no test waits for them.
"""

import io
import sys
import threading
import time
import types
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import hizvk
from hizvk import progress
from hizvk.progress import Progress
from hizvk.scenes import box_mesh

ERASED = "\r\x1b[K"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def until(holds: Callable[[], bool]) -> None:
    """Waits for what another thread does."""
    end = time.monotonic() + 10.0
    while not holds():
        assert time.monotonic() < end, "nothing was shown"
        time.sleep(0.002)


def test_a_terminal_has_a_bar_that_leaves_nothing() -> None:
    terminal = Terminal()
    with Progress(None, "a label", 4, after_s=0.0, stream=terminal) as steps:
        until(lambda: "] a label: 0 of 4, 0 s" in terminal.getvalue())
        steps.step("two")
        steps.step("three")
        until(lambda: "three" in terminal.getvalue())
    drawn = terminal.getvalue()
    assert "[" + "-" * 30 + "] a label: 0 of 4" in drawn
    assert "[" + "#" * 15 + "-" * 15 + "] a label: 2 of 4, 0 s, 0 s left  three" in drawn
    assert drawn.endswith(ERASED)


def test_a_line_fits_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "20")
    terminal = Terminal()
    with Progress(None, "a very long label indeed", 4, after_s=0.0, stream=terminal):
        until(lambda: terminal.getvalue() != "")
    assert max(map(len, terminal.getvalue().split(ERASED))) == 19


@pytest.mark.parametrize("asked", [None, True])
def test_a_short_call_shows_nothing(asked: bool | None) -> None:
    terminal = Terminal()
    with Progress(asked, "a label", 2, stream=terminal) as steps:
        steps.step()
    assert terminal.getvalue() == ""
    assert progress.QUIET_S == 2.0


def test_where_there_is_no_terminal() -> None:
    for asked, expected in ((None, ""), (False, ""), (True, "a label\n")):
        pipe = io.StringIO()
        with Progress(asked, "a label", 2, after_s=0.0, stream=pipe) as steps:
            steps.step()
        assert pipe.getvalue().splitlines()[:1] == expected.splitlines(), asked


def test_a_log_has_a_line_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress._Log, "every_s", 0.01)
    pipe = io.StringIO()
    with Progress(True, "a label", stream=pipe, after_s=0.01) as steps:
        steps.step("next")
        until(lambda: pipe.getvalue().count("a label: 1 done, 0 s  next\n") >= 2)


def test_no_stream_at_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", None)  # pythonw
    with Progress(True, "a label", 1) as steps:
        steps.step()


def test_false_starts_no_thread() -> None:
    before = threading.active_count()
    with Progress(False, "a label", stream=Terminal()), Progress(print, "a label"):
        assert threading.active_count() == before


def test_a_function_is_told_each_step_on_the_callers_thread() -> None:
    told: list[Any] = []

    def tell(done: int, total: int | None) -> None:
        told.append((done, total, threading.current_thread() is threading.main_thread()))

    with Progress(tell, "a label", 3) as steps:
        assert list(steps.over("ab")) == ["a", "b"]
        steps.step("more", 5)
    assert told == [(1, 3, True), (2, 3, True), (7, 7, True)]


def test_an_error_of_the_function_ends_the_call() -> None:
    def stop(done: int, total: int | None) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), Progress(stop, "a label", 3) as steps:
        steps.step()
    terminal = Terminal()
    with Progress(None, "the next one", 3, after_s=0.0, stream=terminal):
        until(lambda: "the next one" in terminal.getvalue())


@pytest.mark.parametrize("outer", [None, False, lambda done, total: None])
def test_a_call_within_another_is_silent(outer: Any) -> None:
    terminal = Terminal()
    with (
        Progress(outer, "outer", 2, after_s=0.0, stream=Terminal()),
        Progress(None, "inner", 2, after_s=0.0, stream=terminal) as inner,
    ):
        assert inner._thread is None
    with Progress(None, "after", 2, after_s=0.0, stream=terminal):
        until(lambda: "after" in terminal.getvalue())
    assert "inner" not in terminal.getvalue()


def test_two_threads_share_one_line() -> None:
    terminal = Terminal()
    with Progress(None, "first", 2, after_s=0.0, stream=terminal):
        until(lambda: "first" in terminal.getvalue())

        def other() -> None:
            with Progress(None, "second", 2, after_s=0.0, stream=terminal):
                time.sleep(0.05)

        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
    assert "second" not in terminal.getvalue()


def notebook(monkeypatch: pytest.MonkeyPatch, kernel: object) -> list[tuple[str, str]]:
    """A stand-in for IPython; the list gets what is displayed, and how."""
    shown: list[tuple[str, str]] = []

    class Handle:
        def update(self, what: dict[str, str], raw: bool) -> None:
            assert raw
            shown.append(("update", what["text/plain"]))

    def display(what: dict[str, str], raw: bool, display_id: bool) -> Handle:
        assert raw
        assert display_id
        shown.append(("display", what["text/plain"]))
        return Handle()

    ipython, module = types.ModuleType("IPython"), types.ModuleType("IPython.display")
    vars(ipython)["get_ipython"] = lambda: types.SimpleNamespace(kernel=kernel)
    vars(module)["display"] = display
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    return shown


def test_a_notebook_has_one_line_that_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = notebook(monkeypatch, kernel=object())
    monkeypatch.setattr(progress._Notebook, "every_s", 0.002)
    with Progress(None, "a label", 2, after_s=0.0) as steps:
        until(lambda: len(shown) > 1)
        steps.step()
        steps.step()
    assert [way for way, _ in shown].count("display") == 1
    assert shown[0] == ("display", "[" + "-" * 30 + "] a label: 0 of 2, 0 s")
    assert shown[-1] == ("update", "a label: 2 of 2, 0 s")


def test_ipython_on_a_terminal_is_no_notebook(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = notebook(monkeypatch, kernel=None)
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    with Progress(None, "a label", 2, after_s=0.0):
        until(lambda: "a label" in terminal.getvalue())
    assert shown == []


def test_other_values_are_refused() -> None:
    for value, got in (("bar", "str 'bar'"), (1, "int 1"), ([], r"list \[\]")):
        with pytest.raises(TypeError, match=f"^progress: expected .*, got {got}$"):
            Progress(value, "a label")  # type: ignore[arg-type]
    with Progress(np.bool_(False), "a label"):  # type: ignore[arg-type]
        pass


# -- the calls ------------------------------------------------------------------------------------


def box(low: Any, high: Any) -> tuple[Any, Any]:
    vertices, triangles = box_mesh([low], [high])
    return vertices, triangles


CAMERA = hizvk.Camera.look_at((0, 0, 9), (0, 0, 0), fov_y_deg=60, size=(18, 32), near=0.1)
SPHERES = hizvk.Spheres(np.random.default_rng(3).uniform(-3, 3, (3000, 3)), 0.25)
DEPTH = np.full(CAMERA.size, 9.0)
BALLS = hizvk.Spheres(np.zeros((600, 3)), np.linspace(0.5, 2.0, 600))


def many_boxes() -> tuple[Any, Any]:
    low = np.random.default_rng(4).uniform(-1, 0.9, (100, 3))
    return box_mesh(low, low + 0.2)


CALLS: dict[str, tuple[Callable[..., Any], int]] = {
    "classify": (
        lambda **more: hizvk.reference.classify(SPHERES, CAMERA, DEPTH, kind="z", **more), 2,
    ),
    "unoccluded": (
        lambda **more: hizvk.reference.unoccluded(SPHERES, CAMERA, DEPTH, kind="z", **more), 2,
    ),
    "check_proxy": (
        lambda **more: hizvk.check_proxy(many_boxes(), box((-1, -1, -1), (1, 1, 1)), **more), 4,
    ),
    "check_bounds": (
        lambda **more: hizvk.check_bounds(BALLS, [box((-1, -1, -1), (0, 0, 0))] * 600, **more), 2,
    ),
    "inner_boxes": (
        lambda **more: hizvk.inner_boxes(*box((0, 0, 0), (1, 2, 3)), resolution=4, **more), 3,
    ),
    "inner_prisms": (
        lambda **more: hizvk.inner_prisms(*box((0, 0, 0), (1, 2, 3)), up=(0, 0, 1), **more), 1,
    ),
    "split_mesh": (lambda **more: hizvk.split_mesh(*many_boxes(), cell=0.5, **more), 1),
    "select_occluders": (lambda **more: hizvk.select_occluders([many_boxes()], **more), 4),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_a_watched_call_has_the_same_answer(name: str) -> None:
    call, steps = CALLS[name]
    told: list[Any] = []
    watched = call(progress=lambda done, total: told.append((done, total)))
    assert told == [(k + 1, steps) for k in range(steps)]
    assert same(watched, call()), name


def same(one: Any, other: Any) -> bool:
    if isinstance(one, np.ndarray):
        return bool(np.array_equal(one, other))
    if hasattr(one, "__dict__"):
        return type(one) is type(other) and same(vars(one), vars(other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other)


def test_check_proxy_in_parts_finds_what_the_whole_finds() -> None:
    mesh = box((-1, -1, -1), (1, 1, 1))
    vertices, triangles = many_boxes()
    high = vertices.reshape(-1, 8, 3).max(axis=1)
    out = (high > 1.0).any(axis=1)
    found = hizvk.check_proxy((vertices, triangles), mesh, progress=lambda done, total: None)
    assert 0 < out.sum() < len(out)
    assert np.unique(found.triangles // 12).tolist() == np.flatnonzero(out).tolist()
    outside = (vertices > 1.0).any(axis=1)
    assert found.vertices.tolist() == np.flatnonzero(outside).tolist()
    assert found.protrusion == pytest.approx(vertices.max() - 1.0)


def test_calls_on_a_device(device: hizvk.Device) -> None:
    told: list[Any] = []

    def tell(done: int, total: int | None) -> None:
        told.append((done, total))

    walls = device.occluders(*box((-1, -1, -1), (1, 1, 1)))
    device.render_depth(walls, CAMERA, conservative=True, progress=tell)
    assert told == [(1, 1)]
    told.clear()
    found = hizvk.recommend(
        hizvk.Spheres(SPHERES.centers[:40], 0.25), CAMERA, occluders=walls, device=device,
        repetitions=1, progress=tell,
    )  # fmt: skip
    # How much there is to try is known on the way; the last step says that all is done.
    assert [done for done, _ in told[:-1]] == list(range(1, len(told)))
    assert all(done <= total for done, total in told)
    assert told[-1][0] == told[-1][1]
    # Each candidate was timed once more than asked for; then there is one check.
    assert len(told) > 2 * len(found.candidates)
