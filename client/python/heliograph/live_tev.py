"""Keeps a session's film up to date in tev or HDRView."""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np

from .errors import HeliographError, InvalidArgument
from .frames import Frame
from .session_core import SessionCore
from .tev import TevReport, TevSender
from .tiles import Planes, Tiles

_INTERVAL_S = 0.1  # between two pictures
_SHOWN = ("R", "G", "B", "display.R", "display.G", "display.B", "error", "samples")


class LiveTev:
    """What Session.show_in_tev answers: a film that follows the session in a viewer until close(), or until the session
    ends; the viewer keeps the last picture. A context manager.

    Pictures are decoded and sent by threads of their own, the newest alone and of it the tiles that changed.
    """

    def __init__(self, core: SessionCore, name: str | None, address: str) -> None:
        self.name = f"heliograph session {core.id[:8]}" if name is None else name  # of the image in the viewer
        if not isinstance(self.name, str) or not self.name or "\0" in self.name:
            raise InvalidArgument("name: must not be empty and hold no NUL", problems=())
        try:
            self._sender = TevSender(address, interval=_INTERVAL_S)
        except (ValueError, TypeError, AttributeError) as problem:
            raise InvalidArgument(str(problem), problems=()) from None
        self._core = core
        self._changed = threading.Condition()
        self._newest: Frame | None = None
        self._over = False
        self._known: dict[object, object] = {}  # window of a tile to the bytes that were sent
        self._thread = threading.Thread(target=self._run, name="heliograph-tev", daemon=True)
        try:
            core.observe(self._observe)
        except HeliographError:
            self._sender.finish(0)
            raise
        self._thread.start()
        frame = core.snapshot()
        if frame is not None:
            self._observe([frame])
        if core.over:
            self._observe([])

    def _observe(self, events: Sequence[Frame]) -> None:
        with self._changed:
            for event in events:
                now = self._newest
                if event.kind != "preview" and event.tiles.files and (now is None or event.view >= now.view):
                    self._newest = event
            self._over = self._over or not events
            self._changed.notify_all()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._newest is not None or self._over)
                frame, self._newest = self._newest, None
            if frame is None:
                break
            try:
                self._send(frame.tiles)
            except (HeliographError, ValueError):
                pass  # a broken tile is told to whoever asks for the picture
            with self._changed:
                self._changed.wait_for(lambda: self._over, _INTERVAL_S)
        self._sender.finish()
        self._core.forget(self._observe)

    def _send(self, tiles: Tiles) -> None:
        sent: dict[object, object] = {}
        for window, data in tiles.files:
            sent[window] = data
            if self._known.get(window) is data:
                continue
            planes = _shown(Tiles(tiles.frame, window, ((window, data),)).planes())
            self._sender.begin(self.name, *tiles.frame, list(planes))
            self._sender.update(window.x0, window.y0, planes)
        self._known = sent

    @property
    def report(self) -> TevReport:
        """Connections and tiles so far, and what went wrong first."""
        return self._sender.report

    def close(self) -> None:
        """Sends what is left and ends the threads; waits 2 s at most for the viewer. The session goes on. May be called
        again."""
        self._core.forget(self._observe)
        self._observe([])
        if threading.current_thread() is not self._thread:
            self._thread.join(5)

    def __enter__(self) -> LiveTev:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _shown(planes: Planes) -> Planes:
    """With "error", the root mean square of the three standard errors, and without what a viewer has no use for."""
    variance = [planes[name] for name in ("variance.R", "variance.G", "variance.B") if name in planes]
    if variance:
        planes["error"] = np.sqrt(np.mean(variance, axis=0, dtype=np.float32))
    return {name: planes[name] for name in _SHOWN if name in planes}
