"""What a stream of frames says, put together: events, pictures, how far the newest view is.

No input or output happens here: the threads of heliograph.session and the tasks of heliograph.aio feed it.
"""

from __future__ import annotations

import dataclasses
from collections import deque
from collections.abc import Sequence

from .errors import BrokenTile, invalid
from .image import Image
from .stats import Stats, make_stats
from .tiles import Assembly, Lazy, Tiles
from .v1 import frame_stream_pb2 as stream
from .v1 import types_pb2 as types
from .wire import exr_of

_MOST_BUFFERED = 1024


@dataclasses.dataclass(frozen=True)
class Frame:
    """One event of a session.

    kind: "film": the picture is whole and newer than at the event before; "preview": a whole picture for the eye
    while the camera moves, biased and with the layer display alone; "end": the film's picture ended, and
    stats.ended_by says why.
    view: number of the change of camera, settings, budget or scene that it shows; Session.view is that of the newest.
    number: of the frame within the session.
    """

    kind: str
    view: int
    number: int
    stats: Stats
    final: bool  # every tile is the last of its frame
    message: str  # of an end: why it failed
    unsampled: tuple[str, ...]
    notices: tuple[str, ...]
    seed: int
    _tiles: Tiles
    _planes: Lazy

    @property
    def image(self) -> Image:
        """The picture at this moment, decoded when first asked for. BrokenTile: a tile is no EXR of its window."""
        return Image(
            self._planes(),
            window=self._tiles.window,
            frame=self._tiles.frame,
            stats=self.stats,
            unsampled=self.unsampled,
            notices=self.notices,
            seed=self.seed,
            view=self.view,
        )

    @property
    def tiles(self) -> Tiles:
        """The picture as the EXR files of its tiles, for programs that pass them on."""
        return self._tiles


class _Open:
    """A frame that has begun."""

    def __init__(self, begin: types.FrameBegin) -> None:
        self.begin = begin
        self.assembly = Assembly(begin.settings, begin.tag.revision, begin.preview)

    def event(self, kind: str, stats: Stats, message: str = "") -> Frame:
        tiles = self.assembly.snapshot()
        return Frame(
            kind,
            self.begin.tag.view_id,
            self.begin.tag.frame,
            stats,
            self.assembly.final,
            message,
            tuple(self.begin.unsampled),
            tuple(self.begin.notices),
            self.begin.settings.seed,
            tiles,
            Lazy(tiles),
        )


class FrameFeed:
    """Takes the answers of StreamFrames one by one. Not thread safe."""

    def __init__(self) -> None:
        self.opened: stream.Opened | None = None
        self.settings: types.RenderSettings | None = None  # of the newest frame of the film, complete
        self.progress: types.Progress | None = None  # of it
        self.end: Frame | None = None  # the last end of a frame of the film that was not superseded
        self.notices: deque[tuple[bool, str]] = deque(maxlen=64)  # whether it is a warning, and the text
        self._film: _Open | None = None
        self._preview: _Open | None = None

    def add(self, response: stream.StreamResponse) -> list[Frame]:
        """The events that a response makes. BrokenTile: it cannot be trusted, nor what follows."""
        kind = response.WhichOneof("response")
        if kind == "tile":
            return self._tile(response.tile, exr_of(response))
        if kind == "frame_begin":
            opened = _Open(response.frame_begin)
            if response.frame_begin.preview:
                self._preview = opened
            else:
                self._film = opened
                self.settings = response.frame_begin.settings
                self.progress = None
        elif kind == "frame_end":
            return self._ended(response.frame_end)
        elif kind == "progress":
            self.progress = response.progress
        elif kind == "opened":
            self.opened = response.opened
        elif kind == "notice":
            self.notices.append((response.notice.severity != stream.Notice.SEVERITY_INFO, response.notice.text))
        return []  # or something that a newer daemon says

    def _tile(self, tile: types.Tile, exr: bytes | memoryview) -> list[Frame]:
        target = self._preview if tile.preview else self._film
        if target is None:
            raise BrokenTile("a tile came before its frame", problems=())
        if not target.assembly.add(tile, exr) or tile.preview:  # previews are shown when they are whole: at their end
            return []
        return [target.event("film", self._stats(target.assembly.samples))]

    def _stats(self, samples: int) -> Stats:
        stats = make_stats(self.progress) if self.progress is not None else Stats()
        # The tiles tell what the picture holds; reports may be behind or ahead of them.
        return dataclasses.replace(stats, samples=samples)

    def _ended(self, end: types.FrameEnd) -> list[Frame]:
        preview = self._preview
        if preview is not None and end.tag.frame == preview.begin.tag.frame:
            self._preview = None
            whole = end.reason == types.END_REASON_PREVIEW and preview.assembly.complete
            return [preview.event("preview", make_stats(end.totals, end))] if whole else []
        film = self._film
        if film is None or end.tag.frame != film.begin.tag.frame:
            return []
        event = film.event("end", make_stats(end.totals, end), end.message)
        if end.reason != types.END_REASON_SUPERSEDED:
            self.end = event
        return [event]

    @property
    def view(self) -> int:
        """Of the newest frame of the film; 0: none has begun."""
        return self._film.begin.tag.view_id if self._film is not None else 0

    def latest(self) -> Frame | None:
        """The film as it is now; None: not all of it has come yet."""
        if self._film is None or not self._film.assembly.complete:
            return None
        return self._film.event("film", self._stats(self._film.assembly.samples))


def check_buffer(size: int) -> None:
    """InvalidArgument: not in [0, 1024]."""
    if isinstance(size, bool) or not isinstance(size, int) or not 0 <= size <= _MOST_BUFFERED:
        raise invalid("buffer", size, f"[0, {_MOST_BUFFERED}]; 0: the newest of each kind")


class FrameBuffer:
    """Events that wait for whoever iterates: bounded, and the oldest go first. Not thread safe.

    size 0: the newest of each kind alone, so that a slow reader sees the present state and an unread buffer costs at
    most three pictures. Else at most `size` events, every one of which is kept until the buffer is full; one of
    1280x720 pixels, uncompressed floats, holds up to 26 MB.
    """

    def __init__(self, size: int = 0) -> None:
        self._events: deque[Frame] = deque()
        self.size = size
        self.dropped = 0  # events that nobody saw

    def resize(self, size: int) -> None:
        """InvalidArgument: not in [0, 1024]."""
        check_buffer(size)
        self.size = size
        while size and len(self._events) > size:
            self._events.popleft()
            self.dropped += 1

    def add(self, events: Sequence[Frame]) -> None:
        for event in events:
            if self.size == 0:
                # An end shows all that the film's pictures before it showed.
                obsolete = {event.kind, "film"} if event.kind == "end" else {event.kind}
                kept = [waiting for waiting in self._events if waiting.kind not in obsolete]
            else:
                kept = list(self._events)[-(self.size - 1) :] if self.size > 1 else []
            self.dropped += len(self._events) - len(kept)
            self._events = deque(kept)
            self._events.append(event)

    def forget_before(self, view: int) -> None:
        """A newer view was sent: with size 0, what waits of older ones is no present state."""
        if self.size == 0:
            kept = [event for event in self._events if event.view >= view]
            self.dropped += len(self._events) - len(kept)
            self._events = deque(kept)

    def take(self) -> Frame | None:
        return self._events.popleft() if self._events else None

    def __len__(self) -> int:
        return len(self._events)
