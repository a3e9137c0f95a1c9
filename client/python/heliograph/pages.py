"""Pages of a notebook that show one session: what each is sent, and what it asks for.

Without input or output, so that it needs no notebook: `send` takes a message and its buffers, receive() takes the
messages of the pages. widget/link.js is the other side.

    page to kernel    open, drawn (picture), camera (move, camera), close
    kernel to page    picture (buffers: EXR files of its tiles), moved (move), problem (text), ended (text)

Every message has the page's name in `page`. A page has at most two pictures that it has not drawn; a picture that is
older than what a page shows, or that a newer one replaced meanwhile, is never sent. Tiles that a page has are not sent
again.
"""

from __future__ import annotations

import contextlib
import math
import threading
import time
import weakref
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from .camera import Camera
from .errors import HeliographError, invalid
from .exr import Bytes
from .frames import Frame
from .session_core import SessionCore, SessionMethods
from .stats import Stats

MOST_IN_FLIGHT = 2  # pictures that a page has not drawn
MOST_PAGES = 8
FORGOTTEN_S = 30.0  # after which a page that draws nothing makes room: its window was closed without a word
_LONGEST_NAME = 64

Send = Callable[[dict[str, Any], Sequence[Bytes]], None]


class _Page:
    def __init__(self) -> None:
        self.number = 0  # of the last picture
        self.in_flight: set[int] = set()
        self.shown: Frame | None = None  # the last picture that was sent
        self.move = 0  # of the last camera that it sent
        self.heard = time.monotonic()
        self.told_end = False


class Pages:
    """Thread safe: events come in the thread that receives, messages in those of the kernel."""

    def __init__(self, session: SessionMethods, send: Send) -> None:
        self._core: SessionCore | None = session._core  # None: it ended, and no page shows its last picture any more
        self._session = weakref.ref(session)
        # Until the last page closes: a session on show is not forgotten.
        self._held: SessionMethods | None = session
        self._send = send
        self._lock = threading.RLock()
        self._pages: dict[str, _Page] = {}
        self._newest: Frame | None = None
        self._closed = False
        self._end = ""  # how the session ended
        self._refusals = session._core.refusals  # that the pages know of
        session._core.observe(self._observe)
        with self._lock:
            self._take([session._core.snapshot()])
            self._see_end()

    @property
    def names(self) -> list[str]:
        """Of the pages that are open."""
        with self._lock:
            return list(self._pages)

    def close(self) -> None:
        """Sends nothing any more."""
        with self._lock:
            self._closed = True
            self._pages.clear()
            core, self._core = self._core, None
            self._newest = self._held = None
        if core is not None:
            core.forget(self._observe)

    # ---- events

    def _observe(self, events: Sequence[Frame]) -> None:
        with self._lock:
            if self._closed:
                return
            self._take(events)
            self._see_end()
            refusals = self._core.refusals if self._core is not None else self._refusals
            refused, self._refusals = refusals != self._refusals, refusals
            for name in list(self._pages):
                try:
                    if refused:
                        self._send({"kind": "problem", "page": name, "text": refusals[1]}, ())
                    self._supply(name)
                except Exception:  # the notebook is gone; the session goes on
                    self._pages.pop(name, None)

    def _see_end(self) -> None:
        core = self._core
        if core is not None and core.over and not self._end:
            self._end = f"The session ended: {core.error}" if core.error is not None else "The session is closed."
            self._held = None

    def _take(self, events: Sequence[Frame | None]) -> None:
        for event in events:
            now = self._newest
            if event is None or not event.tiles.files:
                continue
            if now is not None:
                if event.view < now.view:  # the end of a picture that a newer view replaced
                    continue
                if event.view == now.view and event.kind == "preview" and now.kind != "preview":
                    continue
            self._newest = event

    def _supply(self, name: str) -> None:
        """Sends the page what it lacks, as far as it may."""
        page = self._pages[name]
        core, newest = self._core, self._newest
        if (
            core is not None
            and newest is not None
            and newest is not page.shown
            and len(page.in_flight) < MOST_IN_FLIGHT
        ):
            before = page.shown
            page.number += 1
            page.in_flight.add(page.number)
            page.shown = newest
            message, files = _picture(core, newest, before)
            self._send({**message, "page": name, "picture": page.number, "move": page.move}, files)
        if self._end and not page.told_end and page.shown is newest:
            page.told_end = True
            self._send({"kind": "ended", "page": name, "text": self._end}, ())

    # ---- messages

    def receive(self, message: Any) -> None:
        """Takes a message of a page. What is wrong with it is told there; nothing is raised."""
        name = message.get("page") if isinstance(message, Mapping) else None
        if not isinstance(name, str) or not 0 < len(name) <= _LONGEST_NAME:
            return  # no page to answer to
        try:
            self._receive(name, message)
        except Exception as error:
            text = str(error) if isinstance(error, HeliographError) else f"{type(error).__name__}: {error}"
            with contextlib.suppress(Exception):
                self._send({"kind": "problem", "page": name, "text": text}, ())

    def _receive(self, name: str, message: Mapping[str, Any]) -> None:
        kind = message.get("kind")
        with self._lock:
            if self._closed:
                return
            if kind == "close":
                self._drop(name)
                return
            page = self._page(name, anew=kind == "open")
        if kind == "drawn":
            with self._lock:
                page.in_flight.discard(_integer(message, "picture"))
        elif kind == "camera":
            move = _integer(message, "move")
            with self._lock:
                page.move = max(page.move, move)
            try:
                camera, core = _read_camera(message.get("camera")), self._core
                if core is not None:
                    core.set_camera(camera)
            finally:
                self._send({"kind": "moved", "page": name, "move": move}, ())
        elif kind != "open":
            raise invalid("kind", kind, "'open', 'drawn', 'camera', 'close'")
        with self._lock:
            if name in self._pages:
                self._supply(name)

    def _page(self, name: str, anew: bool) -> _Page:
        """The page of this name; one that was not known, or that another page took the place of, is opened."""
        now = time.monotonic()
        page = self._pages.get(name)
        if page is None or anew:
            for other, its in list(self._pages.items()):
                if its.in_flight and now - its.heard > FORGOTTEN_S:
                    self._drop(other)
            while len(self._pages) >= MOST_PAGES:
                self._drop(min(self._pages, key=lambda other: self._pages[other].heard))
            page = self._pages[name] = _Page()
            self._see_end()
            self._held = None if self._end else self._session()
        page.heard = now
        return page

    def _drop(self, name: str) -> None:
        self._pages.pop(name, None)
        if not self._pages:
            self._held = None
            if self._end:
                self._core = self._newest = None


def _picture(core: SessionCore, frame: Frame, before: Frame | None) -> tuple[dict[str, Any], list[Bytes]]:
    """The message, and the tiles that a page does not have that shows `before`."""
    tiles = frame.tiles
    preview = frame.kind == "preview"
    same = before is not None and (before.kind == "preview") == preview and before.number == frame.number
    known = dict(before.tiles.files) if same and before is not None else {}
    message = {
        "kind": "picture",
        "preview": preview,
        "frame": frame.number,
        "view": frame.view,
        "size": list(tiles.frame),
        "region": list(tiles.window),
        "seed": str(frame.seed),
        "status": _status(frame.stats, frame.message),
        "camera": _camera_message(core.camera),
        "bounds": [_xyz(corner) for corner in core.scene.bounds],
    }
    return message, [data for window, data in tiles.files if known.get(window) is not data]


def _integer(message: Mapping[str, Any], field: str) -> int:
    value = message.get(field)
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise invalid(field, value, "whole numbers from 0 on")
    return value


def _status(stats: Stats, message: str) -> dict[str, Any]:
    error = stats.error
    return {
        "samples": stats.samples,
        "seconds": stats.seconds,
        "error": error if error is not None and math.isfinite(error) else None,
        "all_black": stats.all_black,
        "reuse_share": stats.reuse_share,
        "ended_by": stats.ended_by,
        "message": message,
    }


# A camera is a message CameraView in the names of the protocol, and the pivot.


def _xyz(vector: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyz", map(float, vector)))


def _camera_message(camera: Camera) -> dict[str, Any]:
    view = camera.view
    target = [p + f for p, f in zip(camera.position, camera.forward)]
    return {
        "view": {
            "position": _xyz(camera.position),
            "look_at": {"target": _xyz(target), "up": _xyz(camera.up)},
            "vertical_fov": view.vertical_fov,
            "orthographic_half_height": view.orthographic_half_height,
            "lens_radius": view.lens_radius,
            "focus_distance": view.focus_distance,
            "aspect": view.aspect,
        },
        "pivot": list(camera.pivot),
    }


def _read_camera(message: Any) -> Camera:
    """InvalidArgument: no camera, or one out of range."""
    try:
        view, pivot = message["view"], message["pivot"]
        place = [view["position"], view["look_at"]["target"], view["look_at"]["up"]]
        position, target, up = ([part[axis] for axis in "xyz"] for part in place)
        fov = float(view.get("vertical_fov") or 0)
        half_height = float(view.get("orthographic_half_height") or 0)
        lens_radius, focus_distance, aspect = (
            float(view.get(name) or 0) for name in ("lens_radius", "focus_distance", "aspect")
        )
    except (KeyError, TypeError, ValueError, AttributeError):
        raise invalid("camera", message, "a CameraView with look_at, and a pivot of three numbers") from None
    return Camera(
        position,
        target,
        up,
        fov=math.degrees(fov) if fov and not half_height else None,
        half_height=half_height or None,
        lens_radius=lens_radius,
        focus_distance=focus_distance or None,
        aspect=aspect,
        pivot=pivot,
    )
