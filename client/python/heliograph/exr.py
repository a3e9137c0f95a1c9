"""EXR scan line files in numpy: the daemon's tiles, and pictures on the disk.

Reads and writes one flat part without subsampling, uncompressed or by ZIPS and ZIP. Uncompressed rows become numpy
views of the bytes without a copy. Other compressions are read through the package OpenEXR (the extra `exr`).
Format: "Technical Introduction to OpenEXR" and "OpenEXR File Layout" (openexr.com).
"""

from __future__ import annotations

import dataclasses
import struct
import zlib
from collections.abc import Mapping
from typing import Any, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from ._version import __version__
from .bands import each
from .errors import InvalidArgument, Unimplemented

_MAGIC = b"\x76\x2f\x31\x01"
_TILED, _LONG_NAMES, _DEEP, _MULTIPART = 0x200, 0x400, 0x800, 0x1000
_MOST_CHANNELS = 64
_MUCH = 1 << 20  # bytes from which on several threads are worth it
_LONGEST_HEADER = 1 << 20
_TYPES: dict[int, np.dtype[Any]] = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
_NONE, _ZIPS, _ZIP = 0, 2, 3
_LINES = {_NONE: 1, _ZIPS: 1, _ZIP: 16}  # of a chunk
_COMPRESSIONS = {
    1: "RLE",
    4: "PIZ",
    5: "PXR24",
    6: "B44",
    7: "B44A",
    8: "DWAA",
    9: "DWAB",
    10: "HTJ2K256",
    11: "HTJ2K32",
}


#: A file in memory; planes may be views of it.
Bytes = Union[bytes, memoryview]


class Window(NamedTuple):
    """Half-open rectangle [x0, x1) x [y0, y1) of pixels of the film."""

    x0: int
    y0: int
    x1: int
    y1: int

    @property
    def width(self) -> int:
        """Pixels."""
        return self.x1 - self.x0

    @property
    def height(self) -> int:
        """Pixels."""
        return self.y1 - self.y0

    def __str__(self) -> str:
        return f"[{self.x0}, {self.x1}) x [{self.y0}, {self.y1})"


@dataclasses.dataclass(frozen=True)
class Header:
    """What precedes the pixels. `window` is given relative to the corner of the display window."""

    window: Window
    frame: tuple[int, int]  # width and height of the display window
    channels: tuple[tuple[str, np.dtype[Any]], ...]  # in the file's order
    compression: int  # the format's number
    comments: str
    texts: Mapping[str, str]  # all attributes that are strings
    bytes: int  # of magic, version and attributes
    y_origin: int  # of the display window: what chunks count from


class _Template(NamedTuple):
    """A header that was read, and what surrounds its data window: tiles of a picture differ in nothing else."""

    before: bytes
    after: bytes
    header: Header
    origin: tuple[int, int]


_last: _Template | None = None  # replaced as a whole, so threads need no lock


def _refuse(text: str) -> InvalidArgument:
    return InvalidArgument(f"EXR: {text}", problems=())


def _text_at(data: bytes, at: int) -> tuple[str, int]:
    end = data.find(b"\0", at, at + 256)
    if end < 0:
        raise _refuse("the header is broken or cut off: a name has no end")
    return data[at:end].decode("utf-8", "replace"), end + 1


def _read_channels(value: bytes) -> tuple[tuple[str, np.dtype[Any]], ...]:
    channels: list[tuple[str, np.dtype[Any]]] = []
    at = 0
    while at < len(value) and value[at] != 0:
        name, at = _text_at(value, at)
        if at + 16 > len(value):
            raise _refuse("the list of channels is cut off")
        kind, _, x_sampling, y_sampling = struct.unpack_from("<iiii", value, at)
        at += 16
        if kind not in _TYPES or x_sampling != 1 or y_sampling != 1:
            raise _refuse(
                f"channel {name!r} has pixel type {kind} and sampling {x_sampling}x{y_sampling}; "
                "read are half, float and whole numbers without subsampling"
            )
        channels.append((name, _TYPES[kind]))
    if not channels or len(channels) > _MOST_CHANNELS:
        raise _refuse(f"{len(channels)} channels; allowed: 1 to {_MOST_CHANNELS}")
    if len({name for name, _ in channels}) != len(channels):
        raise _refuse("a channel is there twice")
    return tuple(channels)


def _window_of(box: bytes, origin: tuple[int, int]) -> Window:
    x0, y0, x1, y1 = struct.unpack("<iiii", box)
    window = Window(x0 - origin[0], y0 - origin[1], x1 + 1 - origin[0], y1 + 1 - origin[1])
    if window.width <= 0 or window.height <= 0:
        raise _refuse(f"the window {window} is empty")
    return window


def read_header(file: Bytes) -> Header:
    """InvalidArgument: no EXR file, a broken header, or a kind of file that is not read here."""
    global _last
    known = _last
    if known is not None:
        start = len(known.before)
        head = bytes(file[: known.header.bytes])
        if head.startswith(known.before) and head.startswith(known.after, start + 16):
            return dataclasses.replace(known.header, window=_window_of(head[start : start + 16], known.origin))
    data = bytes(file[:_LONGEST_HEADER])
    if len(data) < 8 or not data.startswith(_MAGIC):
        raise _refuse("not an EXR file")
    version = int.from_bytes(data[4:8], "little")
    for flag, name in ((_TILED, "a tiled file"), (_DEEP, "a deep file"), (_MULTIPART, "a file of several parts")):
        if version & flag:
            raise _refuse(f"{name}; read are flat scan line files of one part")
    if version & ~_LONG_NAMES != 2:
        raise _refuse(f"version {version & 0xFF} with flags {version >> 8:#x}; read is 2")
    attributes: dict[str, tuple[str, int, int]] = {}
    at = 8
    while True:
        if at >= len(data):
            raise _refuse("the header is cut off")
        if data[at] == 0:
            at += 1
            break
        name, at = _text_at(data, at)
        kind, at = _text_at(data, at)
        size = int.from_bytes(data[at : at + 4], "little")
        at += 4
        if at + size > len(data):
            raise _refuse(f"the attribute {name!r} is cut off, or the header longer than {_LONGEST_HEADER} bytes")
        attributes[name] = (kind, at, size)
        at += size

    def value(name: str, kind: str, size: int | None = None) -> bytes:
        found = attributes.get(name)
        if found is None or found[0] != kind or size not in (None, found[2]):
            raise _refuse(f"the attribute {name!r} is missing or no {kind}")
        return data[found[1] : found[1] + found[2]]

    channels = _read_channels(value("channels", "chlist"))
    compression = value("compression", "compression", 1)[0]
    display = struct.unpack("<iiii", value("displayWindow", "box2i", 16))
    origin = display[:2]
    frame = (display[2] + 1 - display[0], display[3] + 1 - display[1])
    if min(frame) < 1:
        raise _refuse("the display window is empty")
    comments = value("comments", "string").decode("utf-8", "replace") if "comments" in attributes else ""
    texts = {
        name: data[start : start + size].decode("utf-8", "replace")
        for name, (kind, start, size) in attributes.items()
        if kind == "string"
    }
    window = _window_of(value("dataWindow", "box2i", 16), origin)
    header = Header(window, frame, channels, compression, comments, texts, at, origin[1])
    start = attributes["dataWindow"][1]
    _last = _Template(data[:start], data[start + 16 : at], header, origin)
    return header


def decode(data: Bytes, most_pixels: int) -> tuple[Header, dict[str, npt.NDArray[Any]]]:
    """Header and planes of an EXR file; plane[y, x] is row y of the data window, in the file's pixel type.

    Planes of an uncompressed file whose rows follow one another are views of `data`. most_pixels bounds the data
    window.
    InvalidArgument: a file that is broken or larger. Unimplemented: a compression that needs the extra `exr`.
    """
    header = read_header(data)
    window = header.window
    if window.width * window.height > most_pixels:
        raise _refuse(f"the window {window} has more than {most_pixels} pixels")
    if header.compression not in _LINES:
        return header, _decode_by_library(data, header)
    row = np.dtype([(name, kind, (window.width,)) for name, kind in header.channels])
    lines = _LINES[header.compression]
    chunks = -(-window.height // lines)
    table_end = header.bytes + 8 * chunks
    if table_end > len(data):
        raise _refuse("the table of offsets is cut off")
    offsets = np.frombuffer(data, "<u8", chunks, header.bytes)
    if header.compression == _NONE:
        rows = _view_rows(data, header, row, offsets, table_end)
    else:
        rows = _inflate_rows(data, header, row, offsets, lines)
    return header, {name: rows[name] for name, _ in header.channels}


def _view_rows(
    data: Bytes, header: Header, row: np.dtype[Any], offsets: npt.NDArray[Any], start: int
) -> npt.NDArray[Any]:
    window = header.window
    line = np.dtype([("y", "<i4"), ("bytes", "<i4"), ("pixels", row)])
    if start + line.itemsize * window.height > len(data):
        raise _refuse("pixels are cut off")
    if not np.array_equal(offsets, start + line.itemsize * np.arange(window.height, dtype=np.uint64)):
        raise _refuse("rows do not follow one another")
    rows = np.frombuffer(data, line, window.height, start)
    if (rows["bytes"] != row.itemsize).any() or not np.array_equal(
        rows["y"], np.arange(window.y0, window.y1, dtype=np.int64) + header.y_origin
    ):
        raise _refuse("a row has another place or size than the header says")
    pixels: npt.NDArray[Any] = rows["pixels"]
    return pixels


def _inflate_rows(
    data: Bytes, header: Header, row: np.dtype[Any], offsets: npt.NDArray[Any], lines: int
) -> npt.NDArray[Any]:
    window = header.window
    pixels = np.empty(window.height, row)
    raw = pixels.view(np.uint8).reshape(window.height, row.itemsize)

    def inflate(item: tuple[int, int]) -> None:
        first, offset = item[0] * lines, item[1]
        count = min(lines, window.height - first)
        if offset + 8 > len(data):
            raise _refuse("a chunk lies outside the file")
        y, size = struct.unpack_from("<ii", data, offset)
        if y != window.y0 + first + header.y_origin or size < 0 or offset + 8 + size > len(data):
            raise _refuse("a chunk has another place than the header says, or is cut off")
        expected = count * row.itemsize
        packed = data[offset + 8 : offset + 8 + size]
        if size == expected:  # did not get smaller, and was stored as it is
            raw[first : first + count] = np.frombuffer(packed, np.uint8).reshape(count, row.itemsize)
            return
        try:
            inflated = zlib.decompressobj().decompress(packed, expected + 1)
        except zlib.error as error:
            raise _refuse(f"a chunk cannot be decompressed: {error}") from None
        if len(inflated) != expected:
            raise _refuse(f"a chunk has {len(inflated)} bytes where {expected} are needed")
        _unpredict(inflated, raw[first : first + count].reshape(-1))

    each(inflate, enumerate(offsets.tolist()), pixels.nbytes > _MUCH)
    return pixels


def _unpredict(packed: bytes, out: npt.NDArray[np.uint8]) -> None:
    """Undoes EXR's predictor (each byte minus the one before, plus 128) and puts the two halves back between one
    another."""
    values = np.add.accumulate(np.frombuffer(packed, np.uint8), dtype=np.uint8)
    values[1::2] ^= 0x80  # 128 was added i times to byte i
    half = (len(packed) + 1) // 2
    out[0::2] = values[:half]
    out[1::2] = values[half:]


def _predict(values: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    split: npt.NDArray[np.uint8] = np.concatenate([values[0::2], values[1::2]])
    out = split.copy()
    out[1:] -= split[:-1]
    out[1:] ^= 0x80
    return out


def _deflate(values: npt.NDArray[np.uint8]) -> bytes:
    """Without a search for repetitions, of which noise has none: half the time for a tenth more bytes."""
    packer = zlib.compressobj(4, zlib.DEFLATED, 15, 9, zlib.Z_RLE)
    return packer.compress(values.data) + packer.flush()


def _decode_by_library(data: Bytes, header: Header) -> dict[str, npt.NDArray[Any]]:
    name = _COMPRESSIONS.get(header.compression, f"number {header.compression}")
    try:
        import OpenEXR

        reader = OpenEXR.File
    except (ImportError, AttributeError):
        raise Unimplemented(
            f"EXR: compression {name} needs the package OpenEXR 3.3 or newer: pip install "
            "'heliograph[exr]'; none, zips and zip need nothing"
        ) from None
    import tempfile

    with tempfile.NamedTemporaryFile(suffix=".exr") as file:  # OpenEXR 3.3 and 3.4 read from paths alone
        file.write(data)
        file.flush()
        try:
            found = reader(file.name, separate_channels=True).channels()
        except Exception as error:
            raise _refuse(f"compression {name}: {error}") from None
    planes = {}
    for channel, kind in header.channels:
        plane = np.asarray(found[channel].pixels) if channel in found else None
        if plane is None or plane.shape != (header.window.height, header.window.width):
            raise _refuse(f"channel {channel!r} has other pixels than the header says")
        planes[channel] = plane.astype(kind, copy=False)
    return planes


def _attribute(name: str, kind: str, value: bytes) -> bytes:
    return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value


def encode(
    planes: Mapping[str, npt.NDArray[Any]],
    window: Window,
    frame: tuple[int, int],
    *,
    comments: str = "",
    texts: Mapping[str, str] | None = None,
    compression: str = "zip",
) -> bytes:
    """An EXR file. planes: name to array of window.height x window.width; float16 is written as half, all else as
    float.

    texts: further attributes, by names that are free. compression: "none" or "zip".
    InvalidArgument: no plane, another shape, a name of 0 or more than 255 bytes.
    """
    if not planes or len(planes) > _MOST_CHANNELS:
        raise _refuse(f"{len(planes)} channels; allowed: 1 to {_MOST_CHANNELS}")
    if compression not in ("none", "zip"):
        raise _refuse(f"compression {compression!r}; written are 'none', 'zip'")
    named = sorted((name.encode(), plane) for name, plane in planes.items())
    fields: list[tuple[str, Any, tuple[int]]] = []
    channel_list = b""
    for number, (name, plane) in enumerate(named):
        if not 1 <= len(name) <= 255 or b"\0" in name:
            raise _refuse(f"a channel is named {name!r}; allowed: 1 to 255 bytes without NUL")
        if plane.shape != (window.height, window.width):
            raise _refuse(f"channel {name.decode()!r} has the shape {plane.shape} in the window {window}")
        half = plane.dtype == np.float16
        fields.append((f"c{number}", "<f2" if half else "<f4", (window.width,)))
        channel_list += name + b"\0" + struct.pack("<iiii", 1 if half else 2, 0, 1, 1)
    method = _ZIP if compression == "zip" else _NONE
    version = 2 | (_LONG_NAMES if any(len(name) > 31 for name, _ in named) else 0)
    head = _MAGIC + struct.pack("<I", version)
    head += _attribute("channels", "chlist", channel_list + b"\0")
    if comments:
        head += _attribute("comments", "string", comments.encode())
    head += _attribute("compression", "compression", bytes([method]))
    head += _attribute("dataWindow", "box2i", struct.pack("<iiii", window.x0, window.y0, window.x1 - 1, window.y1 - 1))
    head += _attribute("displayWindow", "box2i", struct.pack("<iiii", 0, 0, frame[0] - 1, frame[1] - 1))
    head += _attribute("lineOrder", "lineOrder", b"\0")
    head += _attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += _attribute("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0))
    head += _attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    for attribute, text in (texts or {}).items():
        head += _attribute(attribute, "string", text.encode())
    head += _attribute("software", "string", f"Heliograph {__version__}".encode()) + b"\0"

    rows = np.empty(window.height, np.dtype(fields))
    for number, (_, plane) in enumerate(named):
        rows[f"c{number}"] = plane
    lines = _LINES[method]
    flat = rows.view(np.uint8).reshape(window.height, -1)

    def pack(first: int) -> bytes:
        raw = flat[first : first + lines].reshape(-1)
        packed = _deflate(_predict(raw)) if method == _ZIP else raw.tobytes()
        if len(packed) >= len(raw):
            packed = raw.tobytes()
        return struct.pack("<ii", window.y0 + first, len(packed)) + packed

    chunks = each(pack, range(0, window.height, lines), method == _ZIP and rows.nbytes > _MUCH)
    offsets, at = [], len(head) + 8 * len(chunks)
    for chunk in chunks:
        offsets.append(at)
        at += len(chunk)
    return b"".join([head, struct.pack(f"<{len(offsets)}Q", *offsets), *chunks])
