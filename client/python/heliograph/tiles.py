"""Tiles of one frame: each is checked as it comes, the newest of each place is kept, and numpy planes are made on
demand."""

from __future__ import annotations

import dataclasses
import threading
import zlib
from collections import Counter
from typing import Any

import numpy as np
import numpy.typing as npt

from . import exr
from .errors import BrokenTile, HeliographError
from .exr import Window
from .v1 import types_pb2 as types

_MOST_PIXELS = 1 << 31

#: Channels that belong together lie together in memory, so that each group is one H x W x 3 view.
GROUPS: dict[str, tuple[str, str, str]] = {
    "rgb": ("R", "G", "B"),
    "variance": ("variance.R", "variance.G", "variance.B"),
    "display": ("display.R", "display.G", "display.B"),
    "normal": ("N.x", "N.y", "N.z"),
    "albedo": ("albedo.r", "albedo.g", "albedo.b"),
}

Planes = dict[str, npt.NDArray[np.float32]]


def window_of(rect: types.Rect) -> Window:
    return Window(rect.x0, rect.y0, rect.x1, rect.y1)


def in_stack_order(names: list[str]) -> list[str]:
    """The names, whole groups first."""
    grouped = [name for group in GROUPS.values() if set(group) <= set(names) for name in group]
    return grouped + [name for name in names if name not in grouped]


@dataclasses.dataclass(frozen=True)
class Tiles:
    """A picture as EXR files that passed their checks: what a frame looked like at one moment. Decoded by planes()."""

    frame: tuple[int, int]  # width and height of the film, pixels
    window: Window  # region of it that is rendered
    files: tuple[tuple[Window, bytes | memoryview], ...]

    def planes(self) -> Planes:
        """Name to array of window.height x window.width floats; pixels that no tile covered are 0.

        BrokenTile: no EXR of the announced window and film, or other channels than the tiles before it.
        """
        names: list[str] = []
        blocks: list[npt.NDArray[np.float32]] = []  # of each channel, in the order of the files
        planes: Planes = {}
        for window, data in self.files:
            try:
                header, pixels = exr.decode(data, window.width * window.height)
            except HeliographError as error:
                raise BrokenTile(f"tile {window}: {error}", problems=()) from None
            if header.window != window or header.frame != self.frame:
                raise BrokenTile(
                    f"tile {window} holds the window {header.window} of a {header.frame[0]}x{header.frame[1]} film",
                    problems=(),
                )
            if not names:
                names = list(pixels)
                planes = self._allocate(names)
                blocks = [planes[name] for name in names]
            if list(pixels) != names:
                raise BrokenTile(f"tile {window} has other channels than the tiles before it", problems=())
            place = (
                slice(window.y0 - self.window.y0, window.y1 - self.window.y0),
                slice(window.x0 - self.window.x0, window.x1 - self.window.x0),
            )
            for block, plane in zip(blocks, pixels.values()):
                block[place] = plane
        return planes

    def _allocate(self, names: list[str]) -> Planes:
        ordered = in_stack_order(names)
        covered = sum(window.width * window.height for window, _ in self.files)
        whole = covered == self.window.width * self.window.height
        block = (np.empty if whole else np.zeros)((len(ordered), self.window.height, self.window.width), np.float32)
        return {name: block[index] for index, name in enumerate(ordered)}


class Assembly:
    """Collects the tiles of one frame. Not thread safe.

    revision: that of FrameBegin; None: the first tile tells it, as in jobs.
    """

    def __init__(self, settings: types.RenderSettings, revision: int | None = None, preview: bool = False) -> None:
        film = Window(0, 0, settings.width, settings.height)
        window = window_of(settings.region) if settings.HasField("region") else film
        inside = 0 <= window.x0 < window.x1 <= film.x1 and 0 <= window.y0 < window.y1 <= film.y1
        if not inside or film.width * film.height > _MOST_PIXELS:
            raise BrokenTile(
                f"the daemon announced a film of {film.width}x{film.height} with region {window}", problems=()
            )
        self.frame = (settings.width, settings.height)
        self.window = window
        self.preview = preview
        self._revision = revision
        self._files: dict[tuple[int, int], tuple[Window, bytes | memoryview]] = {}
        self._passes: dict[tuple[int, int], int] = {}
        self._samples: dict[tuple[int, int], int] = {}
        self._final: dict[tuple[int, int], bool] = {}
        self._tiles_of_pass: Counter[int] = Counter()
        self._covered: npt.NDArray[np.bool_] | None = np.zeros((window.height, window.width), np.bool_)
        self._open_pixels = window.width * window.height
        self._shown_pass = -1

    def add(self, tile: types.Tile, data: bytes | memoryview | None = None) -> bool:
        """Keeps a tile. True: the picture is whole, and every tile has come to a newer pass than at the last True.

        data: the EXR file, where `tile` does not hold it.

        Tiles of an older revision or pass are ignored. BrokenTile: anything else that does not fit; nothing is kept.
        """
        window = window_of(tile.window)
        place = f"tile {window}"
        if tile.preview != self.preview:
            raise BrokenTile(
                f"{place} is {'a preview' if tile.preview else 'the film'}'s, where the other is shown", problems=()
            )
        if self._revision is None:
            self._revision = tile.tag.revision
        if tile.tag.revision < self._revision:
            return False
        if tile.tag.revision > self._revision:
            raise BrokenTile(
                f"{place} is of revision {tile.tag.revision}, which has not begun (revision {self._revision} is shown)",
                problems=(),
            )
        region = self.window
        if not (region.x0 <= window.x0 < window.x1 <= region.x1 and region.y0 <= window.y0 < window.y1 <= region.y1):
            raise BrokenTile(f"{place} lies outside the region {region}", problems=())
        if data is None:
            data = tile.exr
        if not data:
            raise BrokenTile(f"{place} has no EXR file", problems=())
        found = zlib.crc32(data)
        if found != tile.crc32:
            raise BrokenTile(f"{place}: checksum {found:08x} where {tile.crc32:08x} was announced", problems=())

        corner = (window.x0, window.y0)
        before = self._files.get(corner)
        if before is None or before[0] != window:
            self._cover(window, place)
        elif getattr(tile, "pass") < self._passes[corner]:
            return False
        else:
            self._tiles_of_pass[self._passes[corner]] -= 1
        self._files[corner] = (window, data)
        self._passes[corner] = number = getattr(tile, "pass")
        self._tiles_of_pass[number] += 1
        self._samples[corner] = tile.samples_per_pixel
        self._final[corner] = tile.final
        self._tiles_of_pass = +self._tiles_of_pass
        if self._open_pixels:
            return False
        lowest = min(self._tiles_of_pass)
        if lowest <= self._shown_pass:
            return False
        self._shown_pass = lowest
        return True

    def _cover(self, window: Window, place: str) -> None:
        part = None
        if self._covered is not None:
            part = self._covered[
                window.y0 - self.window.y0 : window.y1 - self.window.y0,
                window.x0 - self.window.x0 : window.x1 - self.window.x0,
            ]
        if part is None or part.any():
            raise BrokenTile(f"{place} overlaps another tile", problems=())
        part[...] = True
        self._open_pixels -= window.width * window.height
        if not self._open_pixels:
            self._covered = None

    @property
    def complete(self) -> bool:
        """Every pixel of the region is covered."""
        return not self._open_pixels

    @property
    def final(self) -> bool:
        """And by final tiles only."""
        return self.complete and all(self._final.values())

    @property
    def samples(self) -> int:
        """Samples per pixel: the smallest of the tiles; 0 while incomplete."""
        return min(self._samples.values()) if self.complete else 0

    def snapshot(self) -> Tiles:
        """The picture so far. Costs no copy of pixels."""
        return Tiles(self.frame, self.window, tuple(self._files.values()))


class Lazy:
    """Planes that are decoded when they are first asked for, once, by whichever thread asks."""

    def __init__(self, tiles: Tiles) -> None:
        self._tiles: Tiles | None = tiles
        self._planes: Planes = {}
        self._lock = threading.Lock()

    def __call__(self) -> dict[str, Any]:
        with self._lock:
            if self._tiles is not None:
                self._planes = self._tiles.planes()
                self._tiles = None
            return self._planes
