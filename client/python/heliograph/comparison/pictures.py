"""Pictures of a comparison: put together from tiles, or read from the folder that it was loaded from when asked for."""

from __future__ import annotations

import pathlib
import zlib
from collections.abc import Iterator, Mapping
from typing import NamedTuple, Union

import numpy as np
import numpy.typing as npt

from .. import exr
from ..errors import BrokenTile, HeliographError, InvalidArgument, NotFound
from ..exr import Window
from ..tiles import window_of
from ..v1 import compare_pb2 as messages

Array = npt.NDArray[np.float32]
_MOST_PIXELS = 1 << 31


class PictureKey(NamedTuple):
    """Which picture it is."""

    mode: str  # empty: the reference
    view: int


#: A picture in memory, H x W x 3, or the EXR file that holds it.
Stored = Union[Array, pathlib.Path]


class PictureFeed:
    """Takes the tiles of pictures, which come one picture after the other. Not thread safe."""

    def __init__(self, width: int, height: int) -> None:
        self._frame = (width, height)
        self._canvas: Array | None = None
        self._covered = 0

    def add(self, message: messages.CompareResponse.Picture) -> Array | None:
        """The picture that is whole now. BrokenTile: a tile that does not pass its checks, or too few of them."""
        width, height = self._frame
        if self._canvas is None:
            self._canvas, self._covered = np.full((height, width, 3), np.nan, np.float32), 0
        if message.HasField("tile"):
            self._draw(message.tile.exr, window_of(message.tile.window), message.tile.crc32)
        if not message.last:
            return None
        picture, self._canvas = self._canvas, None
        if self._covered != width * height:
            raise BrokenTile("a picture of the comparison ended before all of its tiles had come", problems=())
        return picture

    def _draw(self, data: bytes, window: Window, crc32: int) -> None:
        assert self._canvas is not None
        place = f"tile {window}"
        if zlib.crc32(data) != crc32:
            raise BrokenTile(f"{place}: checksum {zlib.crc32(data):08x} where {crc32:08x} was announced", problems=())
        try:
            header, planes = exr.decode(data, max(window.width * window.height, 1))
        except HeliographError as error:
            raise BrokenTile(f"{place}: {error}", problems=()) from None
        film = Window(0, 0, *self._frame)
        if header.window != window or window.x0 < 0 or window.y0 < 0 or window.x1 > film.x1 or window.y1 > film.y1:
            raise BrokenTile(f"{place} holds the window {header.window} of the film {film}", problems=())
        if not {"R", "G", "B"} <= set(planes):
            raise BrokenTile(f"{place} has the channels {', '.join(planes)} and not R, G and B", problems=())
        target = self._canvas[window.y0 : window.y1, window.x0 : window.x1]
        for index, channel in enumerate("RGB"):
            target[..., index] = planes[channel]
        self._covered += window.width * window.height


def read_picture(path: pathlib.Path) -> Array:
    """H x W x 3. NotFound, InvalidArgument: the file."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise NotFound(f"{path}: {error.strerror or 'cannot be read'}", problems=()) from None
    try:
        _, planes = exr.decode(data, _MOST_PIXELS)
        return np.stack([np.asarray(planes[channel], np.float32) for channel in "RGB"], axis=-1)
    except InvalidArgument as error:
        raise InvalidArgument(f"{path}: {error}", problems=()) from None
    except KeyError:
        raise InvalidArgument(f"{path}: has the channels {', '.join(planes)} and not R, G and B", problems=()) from None


def encode_picture(picture: Array) -> bytes:
    """An EXR file with R, G and B, float."""
    height, width, _ = picture.shape
    planes = {channel: picture[..., index] for index, channel in enumerate("RGB")}
    return exr.encode(planes, Window(0, 0, width, height), (width, height), compression="zip")


class Pictures(Mapping[str, Array]):
    """Pictures by the name of their mode: H x W x 3, radiance; of a path V x H x W x 3, NaN where a view is missing.

    Those of a comparison that was loaded are read from its folder whenever they are asked for.
    """

    def __init__(self, stored: Mapping[PictureKey, Stored], modes: tuple[str, ...], views: int) -> None:
        self._stored = stored
        self._modes = modes
        self._views = views

    def of(self, mode: str) -> Array | None:
        """None: there is none. mode: empty: of the reference."""
        found: dict[int, Array] = {}
        for view in range(self._views):
            stored = self._stored.get(PictureKey(mode, view))
            if stored is not None:
                found[view] = read_picture(stored) if isinstance(stored, pathlib.Path) else stored
        if not found:
            return None
        first = next(iter(found.values()))
        if self._views == 1:
            return first
        whole = np.full((self._views, *first.shape), np.nan, np.float32)
        for view, picture in found.items():
            if picture.shape != first.shape:
                raise InvalidArgument(f"the pictures of '{mode or 'reference'}' differ in size", problems=())
            whole[view] = picture
        return whole

    def __getitem__(self, mode: str) -> Array:
        picture = self.of(mode) if mode in self._modes else None
        if picture is None:
            there = ", ".join(repr(name) for name in self) or "none: compare(..., pictures=True) asks for them"
            raise NoPicture(f"there is no picture of the mode {mode!r}; there are {there}", problems=())
        return picture

    def __iter__(self) -> Iterator[str]:
        there = {key.mode for key in self._stored}
        return (mode for mode in self._modes if mode in there)

    def __len__(self) -> int:
        return len(list(iter(self)))


class NoPicture(NotFound, KeyError):
    """The comparison has no picture of this mode."""
