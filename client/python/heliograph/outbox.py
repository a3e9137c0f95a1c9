"""Requests of a stream that wait to be sent: of each kind the newest alone, so that a slow link costs no memory."""

from __future__ import annotations

from typing import Any


class Outbox:
    """Not thread safe."""

    def __init__(self) -> None:
        self._waiting: dict[str, Any] = {}
        self.ended = False  # nothing is taken any more

    def put(self, request: Any) -> None:
        """Replaces a request of the same kind that waits still; goes behind the others."""
        if self.ended:
            return
        kind = request.WhichOneof("request")
        self._waiting.pop(kind, None)
        self._waiting[kind] = request

    def take(self) -> Any | None:
        """The next request, or None."""
        for kind in self._waiting:
            return self._waiting.pop(kind)
        return None

    def end(self) -> None:
        """What waits is still sent."""
        self.ended = True

    def __len__(self) -> int:
        return len(self._waiting)
