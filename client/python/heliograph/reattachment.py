"""How long, and how often, a daemon that restarts is asked for what it had."""

from __future__ import annotations

import time

from .errors import Cancelled, HeliographError, Unavailable

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.1, 2.0  # between two tries


class Reattachment:
    """Not thread safe. seconds: of one restart; 0: none is waited for. planned: only where the daemon said that it
    restarts; otherwise after any lost connection."""

    def __init__(self, seconds: float, *, planned: bool = True) -> None:
        self._seconds = seconds
        self._planned = planned
        self._lost_at: float | None = None  # None: nothing is lost
        self._pause = FIRST_PAUSE_S

    def pause(self, error: HeliographError) -> float | None:
        """A call failed: seconds before the next try; None: there is none.

        A daemon that restarts says when to ask again; one that ends otherwise does not, and keeps no sessions. One that
        goes away cancels its streams or breaks the connection.
        """
        if self._seconds <= 0 or not isinstance(error, (Unavailable, Cancelled)):
            return None
        if self._lost_at is None:
            if self._planned and (isinstance(error, Cancelled) or error.retry_after_s is None):
                return None
            self._lost_at = time.monotonic()
        left = self.left()
        if left <= 0:
            return None
        pause = min(self._pause, left)
        self._pause = min(2 * self._pause, LONGEST_PAUSE_S)
        return pause

    def left(self) -> float:
        """Seconds."""
        lost_at = time.monotonic() if self._lost_at is None else self._lost_at
        return max(0.0, self._seconds - (time.monotonic() - lost_at))

    def found(self) -> None:
        self._lost_at, self._pause = None, FIRST_PAUSE_S
