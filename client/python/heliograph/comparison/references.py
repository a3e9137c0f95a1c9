"""Pictures that modes are compared with: files, arrays and images, as the EXR files that the daemon is sent."""

from __future__ import annotations

import contextlib
import dataclasses
import io
import os
import pathlib
from collections.abc import Iterable, Mapping
from typing import Any, BinaryIO, Union

import numpy as np
import numpy.typing as npt

from .. import exr
from ..errors import HeliographError, NotFound, invalid
from ..exr import Window
from ..image import Image

#: A picture of one view: the path of an EXR file, an array H x W x 3 of radiance, or an Image.
ReferencePicture = Union[str, os.PathLike[str], npt.NDArray[Any], Image]

_LONGEST_HEADER = 1 << 20
_ALLOWED = "the path of an EXR file, an array of H x W x 3 finite numbers, or an Image of a whole film"


@dataclasses.dataclass(frozen=True)
class ReferenceFile:
    """An EXR file on this disk or in memory."""

    name: str  # for messages
    path: str  # empty: in memory
    data: bytes
    size: tuple[int, int] | None  # (width, height); None: not known here

    def open(self) -> BinaryIO:
        """OSError: it cannot be read."""
        return open(self.path, "rb") if self.path else io.BytesIO(self.data)


@dataclasses.dataclass(frozen=True)
class LoadedReference:
    """One that the daemon holds."""

    id: str
    path: str  # empty: it was sent from memory
    sha256: bytes  # of the file


def read_references(reference: ReferencePicture | Iterable[ReferencePicture], views: int) -> tuple[ReferenceFile, ...]:
    """One for each view. NotFound: no such file. InvalidArgument: anything else than pictures, another number."""
    one = isinstance(reference, (str, os.PathLike, Image)) or (
        isinstance(reference, np.ndarray) and reference.ndim == 3
    )
    pictures: list[Any] = [reference]
    if not one:
        try:
            if isinstance(reference, Mapping):
                raise TypeError
            pictures = list(reference)  # type: ignore[arg-type]
        except TypeError:
            raise invalid("reference", reference, f"{_ALLOWED}, or for each view one of these") from None
    if len(pictures) != views:
        raise invalid("reference", f"{len(pictures)} pictures", f"{views}, one for each view")
    return tuple(_read(picture, "reference" if one else f"reference[{view}]") for view, picture in enumerate(pictures))


def _read(picture: ReferencePicture, name: str) -> ReferenceFile:
    if isinstance(picture, (str, os.PathLike)):
        return _read_file(pathlib.Path(picture))
    if isinstance(picture, Image):
        if picture.window != Window(0, 0, *picture.frame):
            raise invalid(name, str(picture.window), f"{_ALLOWED}; this is a part of {picture.frame}")
        names = ["R", "G", "B"]
        if "variance.R" in picture:
            names += ["variance.R", "variance.G", "variance.B"]
        return _encode({channel: picture[channel] for channel in names}, name)
    try:
        array = np.asarray(picture, np.float32)
    except (TypeError, ValueError):
        raise invalid(name, type(picture).__name__, _ALLOWED) from None
    if array.ndim != 3 or array.shape[2] != 3 or 0 in array.shape:
        raise invalid(name, f"an array of shape {array.shape}", _ALLOWED)
    return _encode({channel: array[..., index] for index, channel in enumerate("RGB")}, name)


def _read_file(path: pathlib.Path) -> ReferenceFile:
    try:
        with open(path, "rb") as file:
            head = file.read(_LONGEST_HEADER)
    except OSError as error:
        raise NotFound(f"reference: {path}: {error.strerror or 'cannot be read'}", problems=()) from None
    size = None
    with contextlib.suppress(HeliographError):  # the daemon reads more kinds of files, and says what is wrong
        size = exr.read_header(head).frame
    return ReferenceFile(str(path), str(path), b"", size)


def _encode(planes: dict[str, npt.NDArray[np.float32]], name: str) -> ReferenceFile:
    height, width = planes["R"].shape
    for channel, plane in planes.items():
        if not np.isfinite(plane).all():
            y, x = np.argwhere(~np.isfinite(plane))[0]
            raise invalid(name, f"{plane[y, x]} in channel {channel} of pixel ({x}, {y})", "finite numbers")
    data = exr.encode(planes, Window(0, 0, width, height), (width, height), compression="none")
    return ReferenceFile(name, "", data, (width, height))
