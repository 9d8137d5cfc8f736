"""Progress of long calls."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import Callable, Iterator, NamedTuple

#: Called with the name of the work, the finished runs and all runs.
Progress = Callable[[str, int, int], object]

#: Seconds between two lines where standard error is no terminal.
QUIET_SECONDS = 5.0


class Reporter(NamedTuple):
    """Callbacks of a long call."""

    progress: Progress | None
    note: Callable[[str], object] | None


class _Lines:
    """Progress as a line that is written over on a terminal, and as a line every few seconds elsewhere."""

    def __init__(self) -> None:
        self._over = sys.stderr.isatty()
        self._width = 0
        self._last = 0.0

    def progress(self, work: str, done: int, total: int) -> None:
        now = time.monotonic()
        is_due = self._over or now - self._last >= QUIET_SECONDS
        if not is_due or (done == 0 and not self._over):
            self._last = self._last or now
            return
        self._last = now
        share = 100.0 * done / total if total else 100.0
        self._write(f"{work}: {done} of {total} runs ({share:.0f} %)")

    def note(self, text: str) -> None:
        self.clear()
        print(text, file=sys.stderr)

    def clear(self) -> None:
        if self._over and self._width:
            print("\r" + " " * self._width + "\r", end="", file=sys.stderr, flush=True)
            self._width = 0

    def _write(self, text: str) -> None:
        if self._over:
            print("\r" + text.ljust(self._width), end="", file=sys.stderr, flush=True)
            self._width = len(text)
        else:
            print(text, file=sys.stderr)


@contextmanager
def reporter(progress: bool | Progress) -> Iterator[Reporter]:
    """Callbacks that show progress, call a function, or do nothing."""
    if callable(progress):
        yield Reporter(progress, None)
    elif progress:
        lines = _Lines()
        try:
            yield Reporter(lines.progress, lines.note)
        finally:
            lines.clear()
    else:
        yield Reporter(None, None)
