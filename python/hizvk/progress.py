"""How far a long call is: one convention for every ``progress`` parameter.

- None, the default: after two seconds a bar on the terminal, or a line in a notebook.
  Where standard error is neither, nothing is shown.
- True: the same, and elsewhere a line at the start and another every half minute, as for a log.
- False: nothing.
- A function: it is called after each step with the number of steps done, and how many there are or
  None.
  It is called on the caller's thread, and an error that it raises ends the call.

A call within another one shows nothing of its own by default.
"""

from __future__ import annotations

import contextvars
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, Final, Protocol, TextIO, TypeAlias, TypeVar

import numpy as np

from ._processes import per_process

if TYPE_CHECKING:
    from typing import Self

__all__ = ["Progress", "ProgressLike", "check_progress"]

_T = TypeVar("_T")

#: What a ``progress`` parameter takes.
ProgressLike: TypeAlias = bool | Callable[[int, int | None], object] | None

#: Seconds within which nothing is shown.
QUIET_S: Final = 2.0
#: Into how many parts a call without steps of its own is cut.
MOST_PARTS: Final = 16
#: Characters of the bar.
WIDTH: Final = 30

#: Whether a call that reports its progress is under way in this context.
_is_inside: contextvars.ContextVar[bool] = contextvars.ContextVar("_is_inside", default=False)
#: Of this process: what is held while something is shown, so that two bars never share a line.
_screens: dict[int, threading.Lock] = {}


class Progress:
    """The progress of one call, from ``with`` to its end.

    Parameters
    ----------
    progress : None, bool or function
        What the caller passed.
    label : str
        What is being done.
    total : int, optional
        Number of steps; None if it is not known.
        A total of 1 stands for a call without steps, and shows the seconds alone.
    after_s : float
        Seconds within which nothing is shown.
    stream : file, optional
        None: standard error, or the notebook's output.

    Raises
    ------
    TypeError
        For another `progress`.

    Examples
    --------
    >>> from hizvk.progress import Progress
    >>> with Progress(lambda done, total: print(f"{done} of {total}"), "adding", 2) as steps:
    ...     numbers = [k + 1 for k in steps.over(range(2))]
    1 of 2
    2 of 2
    """

    def __init__(
        self,
        progress: ProgressLike,
        label: str,
        total: int | None = None,
        *,
        after_s: float = QUIET_S,
        stream: TextIO | None = None,
    ) -> None:
        self._call = check_progress(progress)
        self._wanted: bool | None = False
        if self._call is None:
            self._wanted = None if progress is None else bool(progress)
        self.label, self.total, self.done, self.doing = label, total, 0, ""
        self._after_s, self._stream = after_s, stream
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        self._started = time.monotonic()
        view = None if self._wanted is False else self._view()
        self._token = _is_inside.set(True)
        if view is not None:
            view.begin(self)
            self._ended = threading.Event()
            # Notebooks know by the context which cell an output belongs to.
            run = contextvars.copy_context().run
            self._thread = threading.Thread(target=run, args=(self._show, view), daemon=True)
            self._thread.start()
        return self

    def step(self, doing: str = "", count: int = 1) -> None:
        """Counts steps as done; `doing` is the next one."""
        self.done += count
        if self.total is not None:
            self.total = max(self.total, self.done)  # it may have been an estimate
        self.doing = doing
        if self._call is not None:
            self._call(self.done, self.total)

    def show(self, doing: str) -> None:
        """Says what is being done now."""
        self.doing = doing

    @property
    def is_watched(self) -> bool:
        """Whether anything is shown, or a function is told."""
        return self._call is not None or self._thread is not None

    def parts(self, count: int, least: int) -> Iterator[slice]:
        """Parts of `count` things, of about `least` or more; each is a step.

        Parts cost a little more than the whole, so there is one where nobody watches.
        """
        number = min(max(count // least, 1), MOST_PARTS) if self.is_watched else 1
        self.total = number
        for k in range(number):
            yield slice(count * k // number, count * (k + 1) // number)
            self.step()

    def over(self, items: Iterable[_T]) -> Iterator[_T]:
        """The items, each counted as a step once the next one is asked for."""
        for item in items:
            yield item
            self.step()

    def __exit__(self, *error: object) -> None:
        _is_inside.reset(self._token)
        if self._thread is not None:
            self._ended.set()
            self._thread.join()

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self._started

    def text(self) -> str:
        """What a log shows: the label, the steps done, and the seconds."""
        steps = ""
        if self.total != 1:
            of = " done" if self.total is None else f" of {self.total:,}"
            steps = f"{self.done:,}{of}, "
        doing = f"  {self.doing}" if self.doing else ""
        return f"{self.label}: {steps}{self.seconds:.0f} s{self._left()}{doing}"

    def bar(self) -> str:
        """What a terminal and a notebook show: the same behind a bar, if the total is known."""
        if not self.total or self.total == 1:
            return self.text()
        full = min(WIDTH * self.done // self.total, WIDTH)
        return f"[{'#' * full}{'-' * (WIDTH - full)}] {self.text()}"

    def _left(self) -> str:
        """The seconds that are left, if the steps go on as they did."""
        if not self.total or not 0 < self.done < self.total:
            return ""
        return f", {self.seconds / self.done * (self.total - self.done):.0f} s left"

    def _view(self) -> _View | None:
        """What shows it: None for nothing."""
        if self._wanted is None and _is_inside.get():
            return None
        if self._stream is None:
            display = _notebook()
            if display is not None:
                return _Notebook(display)
        stream = sys.stderr if self._stream is None else self._stream
        if stream is None:  # a program without a console
            return None
        is_terminal = getattr(stream, "isatty", None)
        if is_terminal is not None and is_terminal():
            return _Terminal(stream)
        return _Log(stream) if self._wanted else None

    def _show(self, view: _View) -> None:
        """Renews what is shown, on a thread of its own, until the call ends."""
        screen = per_process(_screens, threading.Lock)
        is_ours = False
        wait = self._after_s
        while not self._ended.wait(wait):
            is_ours = is_ours or screen.acquire(blocking=False)
            if is_ours:
                view.draw(self)
            wait = view.every_s
        if is_ours:
            view.end(self)
            screen.release()


class _View(Protocol):
    """A place where progress is shown."""

    every_s: float

    def begin(self, of: Progress) -> None:
        """At the start, on the caller's thread."""

    def draw(self, of: Progress) -> None:
        """Whenever `every_s` has passed."""

    def end(self, of: Progress) -> None:
        """At the end, if anything was drawn."""


class _Terminal:
    """A bar that renews itself and leaves nothing."""

    every_s = 0.1

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def begin(self, of: Progress) -> None:
        """Shows nothing yet."""

    def draw(self, of: Progress) -> None:
        # Loaded here: few calls take two seconds.
        from shutil import get_terminal_size

        self._write(of.bar()[: get_terminal_size().columns - 1])

    def end(self, of: Progress) -> None:
        self._write("")

    def _write(self, line: str) -> None:
        self._stream.write(f"\r\x1b[K{line}")
        self._stream.flush()


class _Log:
    """A line at the start, and then one every half minute."""

    every_s = 30.0

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._last = 0.0

    def begin(self, of: Progress) -> None:
        print(of.label, file=self._stream, flush=True)

    def draw(self, of: Progress) -> None:
        # The first wait is shorter than the others.
        if of.seconds - self._last >= 0.9 * self.every_s:
            self._last = of.seconds
            print(of.text(), file=self._stream, flush=True)

    def end(self, of: Progress) -> None:
        """Adds nothing."""


class _Notebook:
    """A line below the cell that renews itself, and stays."""

    every_s = 0.25

    def __init__(self, display: Callable[..., Any]) -> None:
        self._display = display
        self._handle: Any = None

    def begin(self, of: Progress) -> None:
        """Shows nothing yet."""

    def draw(self, of: Progress) -> None:
        self._renew(of.bar())

    def end(self, of: Progress) -> None:
        of.doing = ""
        self._renew(of.text())

    def _renew(self, line: str) -> None:
        shown = {"text/plain": line}
        if self._handle is None:
            self._handle = self._display(shown, raw=True, display_id=True)
        else:
            self._handle.update(shown, raw=True)


def check_progress(progress: Any) -> Callable[[int, int | None], object] | None:
    """The caller's function; None for True, False and None; a `TypeError` for anything else."""
    if progress is None or isinstance(progress, (bool, np.bool_)):
        return None
    if callable(progress):
        call: Callable[[int, int | None], object] = progress
        return call
    from . import _arguments

    got = _arguments.describe(progress)
    raise TypeError(f"progress: expected None, True, False or a function, got {got}")


def _notebook() -> Callable[..., Any] | None:
    """IPython's `display`, where a notebook shows it."""
    ipython = sys.modules.get("IPython")
    if ipython is None:
        return None
    shell = ipython.get_ipython()
    if shell is None or getattr(shell, "kernel", None) is None:
        return None
    from IPython.display import display  # type: ignore[import-not-found, unused-ignore]

    return display  # type: ignore[no-any-return, unused-ignore]
