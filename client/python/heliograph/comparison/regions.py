"""Parts of the picture whose errors compare() tells apart."""

from __future__ import annotations

import dataclasses
import math
import operator
from collections.abc import Iterator, Mapping, Sequence
from typing import Union

from ..errors import InvalidArgument, Problem, invalid
from ..settings import read_number
from ..v1 import compare_pb2 as messages
from ..v1 import types_pb2 as types

_DARK_HALF = "dark half"  # a region that every comparison has
_MOST_REGIONS = 16
_MOST_NAME_BYTES = 64
_FARTHEST = 1e6
_ALLOWED = "a name, and four whole numbers of pixels: x0, y0, x1, y1, or a Disk"


@dataclasses.dataclass(frozen=True)
class Disk:
    """Pixels whose centres are nearer to a point than a radius; outside: all others. A region of compare()."""

    x: float  # pixels from the picture's upper left corner, [-1e6, 1e6]
    y: float
    radius: float  # pixels, (0, 1e6]
    outside: bool = dataclasses.field(default=False, kw_only=True)


#: A rectangle x0, y0, x1, y1 in pixels, half open, or a disk.
Region = Union[Sequence[int], Disk]


def add_regions(request: messages.CompareRequest, regions: Mapping[str, Region] | None) -> Iterator[Problem]:
    """What is wrong with them."""
    if regions is not None and not isinstance(regions, Mapping):
        yield Problem("regions", repr(regions), "a dict from names to x0, y0, x1, y1 in pixels, or to a Disk")
        return
    if regions and len(regions) > _MOST_REGIONS:
        yield Problem("regions", f"{len(regions)} regions", f"at most {_MOST_REGIONS}")
    for name, region in (regions or {}).items():
        place = f"regions[{name!r}]"
        if not _is_text(name):
            yield Problem(place, repr(region), _ALLOWED)
            continue
        if name == _DARK_HALF or not 0 < len(name.encode()) <= _MOST_NAME_BYTES:
            yield Problem("regions", name, f"names of 1 to {_MOST_NAME_BYTES} bytes, and not '{_DARK_HALF}'")
        if isinstance(region, Disk):
            problems: list[Problem] = []
            disk = _read_disk(region, place, problems)
            yield from problems
            if not problems:
                request.regions.add(name=name, disk=disk)
            continue
        try:
            x0, y0, x1, y1 = (operator.index(side) for side in region)
            request.regions.add(name=name, rect=types.Rect(x0=x0, y0=y0, x1=x1, y1=y1))
        except (TypeError, ValueError):
            yield Problem(place, repr(region), _ALLOWED)


def _is_text(name: object) -> bool:
    """Without half characters, as a message needs it."""
    try:
        return isinstance(name, str) and name.encode() is not None
    except UnicodeEncodeError:
        return False


def _read_disk(disk: Disk, place: str, problems: list[Problem]) -> messages.CompareRegion.Disk:
    """What is wrong is left out."""
    message = messages.CompareRegion.Disk()
    for name, low, allowed in (
        ("x", -_FARTHEST, "[-1e6, 1e6]"),
        ("y", -_FARTHEST, "[-1e6, 1e6]"),
        ("radius", math.ulp(0), "(0, 1e6]"),
    ):
        try:
            value = read_number(f"{place}.{name}", getattr(disk, name))
            if not low <= value <= _FARTHEST:
                raise invalid(f"{place}.{name}", value, allowed)
            setattr(message, name, value)
        except InvalidArgument as error:
            problems.extend(error.problems)
    if isinstance(disk.outside, bool):
        message.outside = disk.outside
    else:
        problems.append(Problem(f"{place}.outside", repr(disk.outside), "True or False"))
    return message


def check_regions(request: messages.CompareRequest, size: Sequence[int] | None) -> Iterator[Problem]:
    """Those that are no part of the picture. size: None: not known yet."""
    width, height = size or (2**31 - 1, 2**31 - 1)
    bounds = f"0 <= x0 < x1 <= {width}, 0 <= y0 < y1 <= {height}" if size else "0 <= x0 < x1, 0 <= y0 < y1"
    for region in request.regions:
        place = f"regions[{region.name!r}]"
        if region.HasField("disk"):
            if size and not _has_pixel(region.disk, width, height):
                shown = text_of(region).removeprefix(f"{region.name}=")
                yield Problem(place, shown, f"at least one pixel of {width} x {height}")
            continue
        x0, y0, x1, y1 = region.rect.x0, region.rect.y0, region.rect.x1, region.rect.y1
        if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
            yield Problem(place, repr((x0, y0, x1, y1)), bounds)


def _has_pixel(disk: messages.CompareRegion.Disk, width: int, height: int) -> bool:
    sides = ((disk.x, width), (disk.y, height))
    if disk.outside:  # the farthest centre is that of a corner
        away = [max(abs(at - 0.5), abs(at - (side - 0.5))) for at, side in sides]
        return math.hypot(*away) >= disk.radius
    nearest = [min(max(math.floor(at) + 0.5, 0.5), side - 0.5) for at, side in sides]
    return math.hypot(*(centre - at for centre, (at, _) in zip(nearest, sides))) < disk.radius


def text_of(region: messages.CompareRegion) -> str:
    """As the command writes it: "lamp=0,0,8,8", "fovea=disk:48,32,9.5"."""
    if region.HasField("disk"):
        disk = region.disk
        kind = "outside" if disk.outside else "disk"
        return f"{region.name}={kind}:{pixels((disk.x, disk.y, disk.radius))}"
    rect = region.rect
    return f"{region.name}={rect.x0},{rect.y0},{rect.x1},{rect.y1}"


def pixels(numbers: Sequence[float]) -> str:
    """As "48,32.5"."""
    return ",".join(repr(number).removesuffix(".0") for number in numbers)
