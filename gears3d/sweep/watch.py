"""Keeps an eye on the points that run: which one, for how long, and what makes it stop."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from math import inf
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gears3d.lumped.batch import Batch


class TooLongError(Exception):
    """A point ran for longer than it may."""


class Watch:
    """Times points and tells how far a block has come.

    Args:
        limit: of a point [s].
        tell: called now and then with the number of the point that runs and how many of the block are done.
        stopped: whether everything is to stop.
    """

    def __init__(
        self,
        limit: float = inf,
        tell: Callable[[int, int], None] | None = None,
        stopped: Callable[[], bool] | None = None,
    ) -> None:
        self.limit, self._tell, self._stopped = limit, tell, stopped
        self._begin = time.monotonic()
        self._point = self._done = 0
        self._interrupted = False

    def start(self, point: int, done: int) -> None:
        """Note that a point begins.

        Args:
            point: its number.
            done: points of the block before it.
        """
        self._begin, self._point, self._done = time.monotonic(), point, done
        self.check()

    def check(self, _: float = 0.0) -> None:
        """Look at the clock; models call it with the simulated time that they have reached.

        Raises:
            TooLongError: the point has had its time.
            KeyboardInterrupt: everything is to stop.
        """
        if self._tell is not None:
            self._tell(self._point, self._done)
        if self._stopped is not None and self._stopped():
            raise KeyboardInterrupt
        if time.monotonic() - self._begin > self.limit:
            raise TooLongError

    @contextmanager
    def over(self, batch: Batch, points: Sequence[int]) -> Iterator[None]:
        """Watch a batch from a thread of its own while the block runs.

        Args:
            batch: stopped at a point that takes too long, or altogether.
            points: numbers of its points.

        Yields:
            Nothing.
        """
        over = threading.Event()
        thread = threading.Thread(target=self._look, args=(batch, points, over), daemon=True)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()
        if self._interrupted or (self._stopped is not None and self._stopped()):
            raise KeyboardInterrupt

    def _look(self, batch: Batch, points: Sequence[int], over: threading.Event) -> None:
        from gears3d.lumped.batch import ALL

        place, begin = -1, time.monotonic()
        while not over.wait(min(0.05, 0.2 * self.limit)):
            now = int(batch.cursor[0])
            if now != place:
                place, begin = now, time.monotonic()
            try:
                if self._tell is not None:
                    self._tell(int(points[min(now, len(points) - 1)]), int(batch.cursor[1]))
            except KeyboardInterrupt:  # belongs to the thread that waits for the batch
                self._interrupted = True
            if self._interrupted or (self._stopped is not None and self._stopped()):
                batch.stop[0] = ALL
            elif time.monotonic() - begin > self.limit:
                batch.stop[0] = now
