"""Shows pictures in tev or HDRView, over the socket on which these viewers listen.

:func:`show_in_tev` sends one picture. :class:`TevSender` keeps a picture in the viewer up to date while it comes into
being, from a thread of its own, whatever becomes of the viewer. Only numpy is needed.

A packet is little endian: u32 length of the whole packet, i8 type, payload. A string is UTF-8 and ends with NUL, a bool
is a byte, pixels are float32. The viewer answers nothing.
"""

from __future__ import annotations

import atexit
import errno
import itertools
import logging
import os
import selectors
import socket
import struct
import threading
import time
import weakref
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["DEFAULT_ADDRESS", "TevReport", "TevSender", "TevUnreachable", "show_in_tev"]

#: Where tev listens unless it is told otherwise.
DEFAULT_ADDRESS = "127.0.0.1:14158"

_log = logging.getLogger("heliograph.tev")

_CLOSE_IMAGE, _CREATE_IMAGE, _UPDATE_IMAGE, _VECTOR_GRAPHICS = 2, 4, 6, 8
_STROKE_COLOR, _STROKE, _BEGIN_PATH, _RECTANGLE = 4, 5, 6, 18
_BORDER_COLOR = (1.0, 0.6, 0.0, 0.8)  # red, green, blue, alpha

_LARGEST_SIDE = 1 << 20
_MOST_CHANNELS = 64
_BAND_BYTES = 8 << 20  # pixels of one packet of show_in_tev
_LOOK = 0.1  # seconds, at most, between two looks at what was asked for
_LAST_TRY = 0.2  # seconds that a connection may take once the sender is to end

_UNIX = getattr(socket, "AF_UNIX", None)  # None: a system without such sockets

_FloatArray = npt.NDArray[np.float32]
_Window = tuple[int, int, int, int]  # x0, y0, x1, y1, half open


class TevUnreachable(ConnectionError):
    """No viewer answers at the address, it went away, or it reads nothing."""


# ---- addresses


@dataclass(frozen=True)
class _Address:
    text: str
    endpoints: tuple[tuple[int, Any], ...]  # family, address


def _resolve(text: str) -> _Address:
    malformed = ValueError(
        f"address: {text!r} is not HOST:PORT with a port in [1, 65535], such as {DEFAULT_ADDRESS}, [IPV6]:PORT, "
        "or unix:PATH with a path of at most 107 bytes"
    )
    if text.startswith("unix:"):
        path = text[5:]
        if _UNIX is None or not path or "\0" in path or len(os.fsencode(path)) > 107:
            raise malformed
        return _Address(text, ((_UNIX, path),))
    host, colon, port = text.rpartition(":")
    if host.startswith("[") and host.endswith("]"):
        host = host[1:-1]
    elif any(c in host for c in ":[]/ \t"):
        raise malformed
    if not colon or not host or not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535):
        raise malformed
    try:
        found = socket.getaddrinfo(host, int(port), type=socket.SOCK_STREAM)
    except (OSError, UnicodeError) as problem:
        raise ValueError(f"address: the host of {text!r} cannot be found: {problem}") from None
    return _Address(text, tuple((family, name) for family, _, _, _, name in found))


# ---- packets


@dataclass(frozen=True)
class _Picture:
    name: str
    width: int
    height: int
    channels: tuple[str, ...]

    def check(self) -> None:
        if not self.name or "\0" in self.name:
            raise ValueError("name: must not be empty and hold no NUL")
        for what, side in (("width", self.width), ("height", self.height)):
            if not 1 <= side <= _LARGEST_SIDE:
                raise ValueError(f"{what}: {side} is not in [1, {_LARGEST_SIDE}]")
        if not 1 <= len(self.channels) <= _MOST_CHANNELS:
            raise ValueError(f"channels: {len(self.channels)} of them, allowed are 1 to {_MOST_CHANNELS}")
        for channel in self.channels:
            if not channel or "\0" in channel:
                raise ValueError("channels: a name is empty or holds a NUL")
            if channel[0] in "0123456789":
                raise ValueError(f"channels: {channel!r} begins with a digit")
        if len(set(self.channels)) != len(self.channels):
            raise ValueError("channels: two have the same name")


def _text(value: str) -> bytes:
    return value.encode() + b"\0"


def _packet(kind: int, payload: bytes, following: int = 0) -> bytes:
    length = 5 + len(payload) + following
    if length > 0xFFFFFFFF:
        raise ValueError(f"a packet of {length} bytes is more than 4 GiB")
    return struct.pack("<Ib", length, kind) + payload


def _create_packet(picture: _Picture, grab_focus: bool) -> bytes:
    return _packet(
        _CREATE_IMAGE,
        struct.pack("<b", grab_focus)
        + _text(picture.name)
        + struct.pack("<3i", picture.width, picture.height, len(picture.channels))
        + b"".join(map(_text, picture.channels)),
    )


def _update_head(picture: _Picture, window: _Window) -> bytes:
    """All but the pixels, which follow channel by channel, row by row."""
    x0, y0, x1, y1 = window
    area, count = (x1 - x0) * (y1 - y0), len(picture.channels)
    offsets = [channel * area for channel in range(count)]  # in floats, as the strides
    return _packet(
        _UPDATE_IMAGE,
        b"\0"
        + _text(picture.name)
        + struct.pack("<i", count)
        + b"".join(map(_text, picture.channels))
        + struct.pack(f"<4i{2 * count}q", x0, y0, x1 - x0, y1 - y0, *offsets, *([1] * count)),
        4 * area * count,
    )


def _borders_packet(picture: _Picture, windows: Iterable[_Window]) -> bytes:
    """Replaces the vector graphics on the image; without windows there are none."""
    rectangles = [
        struct.pack("<b4f", _RECTANGLE, x0, y0, x1 - x0, y1 - y0) for x0, y0, x1, y1 in windows
    ]
    commands = []
    if rectangles:
        commands = [
            struct.pack("<b", _BEGIN_PATH),
            *rectangles,
            struct.pack("<b4f", _STROKE_COLOR, *_BORDER_COLOR),
            struct.pack("<b", _STROKE),
        ]
    head = b"\0" + _text(picture.name) + b"\0" + struct.pack("<i", len(commands))
    return _packet(_VECTOR_GRAPHICS, head + b"".join(commands))


def _close_packet(name: str) -> bytes:
    return _packet(_CLOSE_IMAGE, _text(name))


# ---- sockets


_IN_PROGRESS = (errno.EINPROGRESS, errno.EWOULDBLOCK)


def _wait_for_write(sock: socket.socket) -> bool:
    with selectors.DefaultSelector() as selector:
        selector.register(sock, selectors.EVENT_WRITE)
        return bool(selector.select(_LOOK))


def _connect(address: _Address, keep_waiting: Callable[[float], bool]) -> socket.socket:
    """keep_waiting(seconds so far) is asked at least every 0.1 s. Raises OSError when no endpoint answers."""
    problem: OSError = OSError("there is no endpoint")
    for family, name in address.endpoints:
        sock = socket.socket(family, socket.SOCK_STREAM)
        try:
            sock.setblocking(False)
            begun = time.monotonic()
            error = sock.connect_ex(name)
            if error in _IN_PROGRESS and family != _UNIX:  # a Unix socket whose queue is full is not waited for
                while not _wait_for_write(sock):
                    if not keep_waiting(time.monotonic() - begun):
                        raise TimeoutError(errno.ETIMEDOUT, os.strerror(errno.ETIMEDOUT))
                error = sock.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if error:
                raise OSError(error, os.strerror(error))
            # A port of the system's own range may be given to the very socket that tries it.
            if family != _UNIX:
                if sock.getsockname() == sock.getpeername():
                    raise ConnectionRefusedError(errno.ECONNREFUSED, os.strerror(errno.ECONNREFUSED))
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return sock
        except OSError as failed:
            sock.close()
            problem = failed
    raise problem


def _send(sock: socket.socket, parts: Sequence[Any], keep_waiting: Callable[[float], bool]) -> None:
    """Sends all bytes. keep_waiting(seconds since a byte was taken) is asked whenever nothing is taken, at least every
    0.1 s; TimeoutError when nobody keeps waiting."""
    left = [memoryview(part).cast("B") for part in parts if len(part)]
    taken = time.monotonic()
    while left:
        try:
            sent = sock.sendmsg(left, [], getattr(socket, "MSG_NOSIGNAL", 0))
        except (BlockingIOError, InterruptedError):
            if not keep_waiting(time.monotonic() - taken):
                raise TimeoutError("it read nothing in time") from None
            _wait_for_write(sock)
            continue
        taken = time.monotonic()
        while left and sent >= len(left[0]):
            sent -= len(left.pop(0))
        if sent:
            left[0] = left[0][sent:]


# ---- the sender


@dataclass(frozen=True)
class TevReport:
    """What a :class:`TevSender` has done so far.

    Attributes:
        connections: Connections that were made.
        updates: Bundles of tiles that were sent whole.
        tiles: Tiles in these.
        warning: What went wrong first; None where nothing did.
    """

    connections: int = 0
    updates: int = 0
    tiles: int = 0
    warning: str | None = None


class _State:
    """What the thread and the sender share; the thread keeps no sender alive."""

    def __init__(self, address: _Address, interval: float, retry: float, connect: float, blocked: float) -> None:
        self.address = address
        self.interval, self.retry, self.connect_within, self.blocked = interval, retry, connect, blocked
        self.lock = threading.Lock()
        self.wake_here, self.wake_there = socket.socketpair()
        for end in (self.wake_here, self.wake_there):
            end.setblocking(False)
        # Under the lock:
        self.picture: _Picture | None = None
        self.created = False
        self.tiles: dict[_Window, tuple[_FloatArray, bool]] = {}  # disjoint; pixels, and whether they were sent
        self.finish_by: float | None = None  # time.monotonic()
        self.report = TevReport()
        # The thread's own:
        self.sock: socket.socket | None = None
        self.next_try = self.next_update = 0.0
        self.focused = self.borders_shown = False
        self.thread = threading.Thread(target=self.run, name="tev", daemon=True)

    def wake(self) -> None:
        try:
            self.wake_there.send(b"w")
        except OSError:
            pass  # full: it is woken already; closed: it has ended

    def end(self, timeout: float) -> None:
        with self.lock:
            if self.finish_by is None:
                self.finish_by = time.monotonic() + timeout
        self.wake()

    def abandon(self) -> None:
        """In a forked child, which has no such thread: nothing is sent from here."""
        self.lock = threading.Lock()
        self.finish_by = 0.0
        for sock in (self.sock, self.wake_here, self.wake_there):
            if sock is not None:
                sock.close()

    def keep_waiting(self, _waited: float = 0) -> bool:
        with self.lock:
            return self.finish_by is None or time.monotonic() < self.finish_by

    def warn(self, text: str) -> None:
        with self.lock:
            if self.report.warning is not None:
                return
            self.report = replace(self.report, warning=text)
        _log.warning("%s", text)

    def lose(self, what: str) -> None:
        if self.sock is not None:
            self.sock.close()
            self.sock = None
        with self.lock:
            self.created = False
            self.tiles = {window: (pixels, False) for window, (pixels, _) in self.tiles.items()}
            finishing = self.finish_by is not None
        self.next_try = time.monotonic() + self.retry
        then = (
            "it lacks the last state of the picture" if finishing else f"tev is tried again every {self.retry:g} s"
        )
        self.warn(f"tev at {self.address.text} {what}; {then}")

    def connect(self) -> None:
        def keep_waiting(waited: float) -> bool:
            with self.lock:
                finishing = self.finish_by is not None
            within = min(_LAST_TRY, self.connect_within) if finishing else self.connect_within
            return waited < within and self.keep_waiting()

        try:
            self.sock = _connect(self.address, keep_waiting)
        except OSError as problem:
            self.lose(f"does not answer ({problem.strerror or problem})")
            return
        self.borders_shown = False
        with self.lock:
            self.report = replace(self.report, connections=self.report.connections + 1)

    def send(self, *parts: Any) -> None:
        def keep_waiting(waited: float) -> bool:
            if waited >= self.blocked:
                self.warn(
                    f"tev at {self.address.text} has read nothing for {self.blocked:g} s; "
                    "it gets the newest state once it reads"
                )
            return self.keep_waiting()

        assert self.sock is not None
        _send(self.sock, parts, keep_waiting)

    def send_update(self) -> None:
        self.next_update = time.monotonic() + self.interval
        with self.lock:
            picture = self.picture
            create, self.created = not self.created, True
            windows = [window for window, (_, sent) in self.tiles.items() if not sent]
        assert picture is not None
        if create:
            self.borders_shown = False
            focus, self.focused = not self.focused, True
            self.send(_create_packet(picture, focus))
        shown = []
        for window in windows:
            with self.lock:
                if not self.created:
                    return  # another picture has begun
                pixels, sent = self.tiles.get(window, (None, True))
                if sent or pixels is None:
                    continue
                self.tiles[window] = (pixels, True)
            self.send(_update_head(picture, window), pixels.reshape(-1))
            shown.append(window)
        if not shown:
            return
        self.send(_borders_packet(picture, shown))
        self.borders_shown = True
        with self.lock:
            self.report = replace(
                self.report, updates=self.report.updates + 1, tiles=self.report.tiles + len(shown)
            )

    def rest(self, until: float | None) -> None:
        """Until something is new, the connection ends, or that moment has come."""
        with selectors.DefaultSelector() as selector:
            selector.register(self.wake_here, selectors.EVENT_READ)
            if self.sock is not None:
                selector.register(self.sock, selectors.EVENT_READ)
            ready = selector.select(None if until is None else max(0.0, until - time.monotonic()))
        for key, _ in ready:
            if key.fileobj is self.wake_here:
                try:
                    self.wake_here.recv(4096)
                except OSError:
                    pass
                continue
            try:
                gone = self.sock is not None and self.sock.recv(4096) == b""  # nothing is expected
            except (BlockingIOError, InterruptedError):
                gone = False
            except OSError:
                gone = True
            if gone:
                self.lose("has closed the connection")

    def run(self) -> None:
        try:
            self.serve()
        except OSError as problem:
            self.lose(f"cannot be sent to ({problem})")
        if self.sock is not None:
            self.sock.close()
            self.sock = None
        with self.lock:
            self.tiles = {}
            if self.finish_by is None:
                self.finish_by = 0.0

    def serve(self) -> None:
        last_try = False
        while True:
            with self.lock:
                unsent = any(not sent for _, sent in self.tiles.values())
                to_send = self.picture is not None and (not self.created or unsent)
                finish_by = self.finish_by
            now = time.monotonic()
            if finish_by is not None and now >= finish_by:
                return
            if self.sock is None:
                if finish_by is not None and (last_try or not to_send):
                    return
                if finish_by is not None or now >= self.next_try:
                    last_try = finish_by is not None
                    self.connect()
                    continue
            if to_send and self.sock is not None and now >= self.next_update:
                try:
                    self.send_update()
                except OSError as problem:
                    self.lose(f"is gone ({problem.strerror or problem})")
                continue
            if finish_by is not None and not to_send:
                break
            until = self.next_try if self.sock is None else self.next_update if to_send else None
            if finish_by is not None:
                until = finish_by if until is None else min(until, finish_by)
            self.rest(until)
        with self.lock:
            picture = self.picture
        if self.sock is not None and self.borders_shown and picture is not None:
            try:
                self.send(_borders_packet(picture, ()))
            except OSError:
                pass  # the picture is there, and its borders stay


_live: weakref.WeakSet[_State] = weakref.WeakSet()


def _finish_all() -> None:
    states = list(_live)
    for state in states:
        state.end(2.0)
    for state in states:
        if state.thread.is_alive():
            state.thread.join(2.5)


def _abandon_all() -> None:
    for state in list(_live):
        state.abandon()
    _live.clear()


atexit.register(_finish_all)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_abandon_all)


class TevSender:
    """Keeps a picture in tev or HDRView up to date while it comes into being.

    A daemon thread sends the newest state of each tile, in at most ``1 / interval`` updates a second, and draws the
    borders of the tiles of the last update. No method but :meth:`finish` blocks. One picture's worth of tiles is kept
    at most. When the viewer is absent, goes away or reads nothing, the logger ``heliograph.tev`` warns once. A viewer
    that is absent or gone is tried again every ``retry`` seconds, and then gets the picture and all tiles anew. The
    thread ends with :meth:`finish`, with the object, and with the program, which waits for two seconds at most; a forked
    child has none.

    Thread safe.

    Args:
        address: ``HOST:PORT``, ``[IPV6]:PORT`` or ``unix:PATH``. The host is looked up here.
        interval: Seconds from the start of an update to that of the next, at least.
        retry: Seconds from the end of a connection, or of a try, to the next try.
        connect: Seconds that a connection may take.
        blocked: Seconds without a byte read before that is warned of.

    Raises:
        ValueError: The address has another form, its host is unknown, or a time is not a number above 0.

    Example:
        >>> with TevSender() as tev:
        ...     tev.begin("box 1", 1280, 720, ["R", "G", "B"])
        ...     tev.update(0, 0, {"R": r, "G": g, "B": b})
    """

    def __init__(
        self,
        address: str = DEFAULT_ADDRESS,
        *,
        interval: float = 0.1,
        retry: float = 5.0,
        connect: float = 2.0,
        blocked: float = 5.0,
    ) -> None:
        for name, value in (("interval", interval), ("retry", retry), ("connect", connect), ("blocked", blocked)):
            if not 0 < value < float("inf"):
                raise ValueError(f"{name}: {value} is not a number of seconds above 0")
        self._state = _State(_resolve(address), interval, retry, connect, blocked)
        _live.add(self._state)
        self._ends = weakref.finalize(self, self._state.end, 2.0)
        self._ends.atexit = False  # _finish_all() waits
        self._state.thread.start()

    def begin(self, name: str, width: int, height: int, channels: Sequence[str]) -> None:
        """Tiles belong to this picture from now on.

        Another picture than before, or one of another size or with other channels, is made in the viewer, in place of
        one of the same name, and tiles before it are forgotten; the same again changes nothing.

        Args:
            name: What the viewer calls it; unique among what it shows.
            width: In pixels, [1, 2^20], as ``height``.
            height: In pixels.
            channels: 1 to 64 names, none of which begins with a digit. The viewer groups them by what stands before the
                last dot: ``["R", "G", "B", "display.R", "display.G", "display.B", "error"]``.

        Raises:
            ValueError: One of these is outside of its range.
        """
        picture = _Picture(name, int(width), int(height), tuple(channels))
        picture.check()
        with self._state.lock:
            if picture == self._state.picture:
                return
            self._state.picture = picture
            self._state.created = False
            self._state.tiles = {}
        self._state.wake()

    def update(self, x: int, y: int, planes: Mapping[str, npt.ArrayLike]) -> None:
        """The newest state of a tile; tiles that it overlaps are forgotten.

        Args:
            x: Left column of the tile in the picture, in pixels.
            y: Top row.
            planes: Array of shape (rows, columns) for each channel, all of one shape; copied as float32. A channel that
                is absent is NaN.

        Raises:
            ValueError: No picture has begun, a plane is of no channel or of another shape, or the tile does not lie in
                the picture.
        """
        with self._state.lock:
            picture = self._state.picture
        if picture is None:
            raise ValueError("planes: came before begin()")
        unknown = [name for name in planes if name not in picture.channels]
        if unknown or not planes:
            raise ValueError(f"planes: {unknown} are none of the channels {list(picture.channels)}")
        arrays = {name: np.asarray(plane) for name, plane in planes.items()}
        shapes = {array.shape for array in arrays.values()}
        shape = shapes.pop()
        if shapes or len(shape) != 2:
            raise ValueError("planes: are not arrays of one shape (rows, columns)")
        window = (int(x), int(y), int(x) + shape[1], int(y) + shape[0])
        if not (0 <= window[0] < window[2] <= picture.width and 0 <= window[1] < window[3] <= picture.height):
            raise ValueError(
                f"x, y: a tile of {shape[1]}x{shape[0]} at {x}, {y} does not lie in {picture.width}x{picture.height}"
            )
        pixels = np.full((len(picture.channels), *shape), np.nan, dtype="<f4")
        for name, array in arrays.items():
            pixels[picture.channels.index(name)] = array
        with self._state.lock:
            if self._state.finish_by is not None or self._state.picture != picture:
                return
            tiles = self._state.tiles
            if window not in tiles:
                for other in [other for other in tiles if _overlap(other, window)]:
                    del tiles[other]
            tiles.pop(window, None)  # the newest is sent last
            tiles[window] = (pixels, False)
        self._state.wake()

    def finish(self, timeout: float = 2.0) -> None:
        """Sends what is left, takes the borders away and ends the thread, within ``timeout`` seconds and a few tenths.
        Later calls, and those of the other methods, do nothing."""
        self._state.end(timeout)
        self._state.thread.join(timeout + 1)

    @property
    def report(self) -> TevReport:
        """What was sent so far."""
        with self._state.lock:
            return self._state.report

    def __enter__(self) -> TevSender:
        return self

    def __exit__(self, *_: object) -> None:
        self.finish()


def _overlap(a: _Window, b: _Window) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


# ---- one picture

_count = itertools.count(1)


def _attribute(image: Any, name: str) -> Any:
    """None where it is absent; a picture may say that as of an attribute or as of a key."""
    try:
        return getattr(image, name, None)
    except LookupError:
        return None


def _channels_of(image: Any) -> dict[str, _FloatArray]:
    if isinstance(image, np.ndarray):
        names = {2: "Y", 3: "RGB", 4: "RGBA"}.get(2 if image.ndim == 2 else image.shape[-1] if image.ndim == 3 else 0)
        if names is None or (image.ndim == 3 and image.shape[-1] == 2):
            raise ValueError(f"image: an array of shape {image.shape} is neither (H, W), (H, W, 3) nor (H, W, 4)")
        stack = image[..., None] if image.ndim == 2 else image
        return {name: stack[..., i].astype("<f4") for i, name in enumerate(names)}
    channels: dict[str, _FloatArray] = {}
    for attribute, prefix in (("rgb", ""), ("display", "display.")):
        value = _attribute(image, attribute)
        if value is None:
            continue
        array = np.asarray(value)
        if array.ndim != 3 or array.shape[-1] != 3:
            raise ValueError(f"image.{attribute}: shape {array.shape} is not (H, W, 3)")
        channels |= {prefix + name: array[..., i].astype("<f4") for i, name in enumerate("RGB")}
    sigma = _attribute(image, "sigma")
    if sigma is not None:
        error = np.asarray(sigma, dtype=np.float32)
        # As everywhere: root mean square over the channels.
        channels["error"] = error if error.ndim == 2 else np.sqrt(np.mean(np.square(error), axis=-1))
    samples = _attribute(image, "samples")
    if samples is not None:
        channels["samples"] = np.asarray(samples, dtype=np.float32)
    if not channels:
        raise ValueError("image: is no array, and has none of rgb, display, sigma and samples")
    shapes = {array.shape for array in channels.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 2:
        raise ValueError(f"image: its channels have the shapes {sorted(shapes)}, not one (H, W)")
    return channels


def show_in_tev(
    image: Any, name: str | None = None, address: str = DEFAULT_ADDRESS, *, timeout: float = 10.0
) -> str:
    """Shows one picture in tev or HDRView.

    Args:
        image: An array of shape (H, W), (H, W, 3) or (H, W, 4); or an object with ``rgb`` and ``display`` of shape
            (H, W, 3), ``sigma`` of shape (H, W) or (H, W, 3) and ``samples`` of shape (H, W), each of which may be
            absent or None. They become the channels R, G, B; display.R, display.G, display.B; error, which is
            ``sigma``, root mean square over its channels; samples.
        name: What the viewer calls it; an image of that name is replaced. Default: another name each time.
        address: ``HOST:PORT``, ``[IPV6]:PORT`` or ``unix:PATH`` of the viewer.
        timeout: Seconds for all of it.

    Returns:
        The picture's name in the viewer.

    Raises:
        ValueError: The image has none of these shapes, or the address another form.
        TevUnreachable: No viewer answers, it went away, or it did not read all of the picture in time.
    """
    planes = _channels_of(image)
    height, width = next(iter(planes.values())).shape
    picture = _Picture(name or f"heliograph {os.getpid()}-{next(_count)}", width, height, tuple(planes))
    picture.check()
    to = _resolve(address)
    deadline = time.monotonic() + timeout

    def keep_waiting(_waited: float) -> bool:
        return time.monotonic() < deadline

    try:
        with _connect(to, keep_waiting) as sock:
            _send(sock, [_create_packet(picture, True)], keep_waiting)
            rows = max(1, _BAND_BYTES // (4 * width * len(planes)))
            for y in range(0, height, rows):
                band = np.stack([plane[y : y + rows] for plane in planes.values()])
                pixels = np.ascontiguousarray(band, dtype="<f4")
                window = (0, y, width, y + pixels.shape[1])
                _send(sock, [_update_head(picture, window), pixels.reshape(-1)], keep_waiting)
    except OSError as problem:
        raise TevUnreachable(f"tev at {address} does not take the picture: {problem.strerror or problem}") from problem
    return picture.name
