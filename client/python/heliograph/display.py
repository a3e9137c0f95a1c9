"""Pictures for the eye: exposure, 8-bit sRGB and PNG files, with the numbers of the command's --png."""

from __future__ import annotations

import functools
import struct
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

from .bands import each

_MIDDLE_GREY = 0.18
_DARKEST_SHARE = 1e-4  # of the mean: below it a pixel says nothing about exposure
_LARGEST_EXPOSURE = 2.0**40
_BAND = 1 << 16  # values that are worked on at a time


def auto_exposure(rgb: npt.NDArray[Any]) -> float:
    """Factor that brings the log-average luminance (Reinhard 2002, eq. 1) of the pixels that see light to middle grey.

    rgb: H x W x 3, linear Rec.709. Pixels that are black, not finite, or darker than 1e-4 of the mean do not count. 1
    where none counts; held to [2^-40, 2^40].
    """
    weighted = [
        np.multiply(rgb[..., channel], weight, dtype=np.float64)
        for channel, weight in enumerate((0.2126, 0.7152, 0.0722))
    ]
    luminance = weighted[0] + weighted[1] + weighted[2]
    lit = luminance[np.isfinite(luminance) & (luminance > 0)]
    lit = lit[lit >= _DARKEST_SHARE * lit.sum() / max(luminance.size, 1)]
    if lit.size == 0:
        return 1.0
    factor = _MIDDLE_GREY / np.exp(np.log(lit).mean())
    return float(np.clip(factor, 1 / _LARGEST_EXPOSURE, _LARGEST_EXPOSURE))


def _encode(linear: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Levels of numbers in [0, 1]."""
    encoded = np.where(
        linear <= np.float32(0.0031308),
        np.float32(12.92) * linear,
        np.float32(1.055) * np.power(linear, np.float32(1 / 2.4)) - np.float32(0.055),
    )
    levels: npt.NDArray[np.uint8] = np.floor(255 * encoded.astype(np.float32) + np.float32(0.5)).astype(np.uint8)
    return levels


@functools.cache
def _levels() -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
    """For the upper 16 bits of a float: the level of the least number that has them, and the number at which the next
    level begins. A level is wider than these bits tell apart, so that there are two at most."""
    low, high = np.zeros(255, np.uint32), np.full(255, np.float32(1).view(np.uint32))
    wanted = np.arange(1, 256)
    while (high - low > 1).any():  # bits of positive floats are in the order of the numbers
        middle = (low + high) // 2
        reached = _encode(middle.view(np.float32)) >= wanted
        high, low = np.where(reached, middle, high), np.where(reached, low, middle)
    begins = np.append(high.view(np.float32), np.float32(np.nan))  # which no number reaches
    least = (np.arange(1 << 15, dtype=np.uint32) << 16).view(np.float32)
    level = np.searchsorted(begins[:255], least, side="right").astype(np.uint8)
    following = begins[level]
    level[least > 1] = 255
    following[least > 1] = np.nan
    level[np.isnan(least)] = 0
    black = np.zeros(1 << 15, np.uint8)  # numbers below 0
    return np.append(level, black), np.append(following, np.full(1 << 15, np.float32(np.nan)))


def srgb_bytes(rgb: npt.NDArray[Any], exposure: float) -> npt.NDArray[np.uint8]:
    """Clamps exposure * rgb to [0, 1] (NaN: 0), encodes as sRGB and rounds to 8 bits. The shape stays."""
    level, following = _levels()
    shape = np.shape(rgb)
    values = np.atleast_1d(rgb)
    out = np.empty(values.shape, np.uint8)

    def convert(rows: slice) -> None:
        # One channel at a time where they lie apart in memory.
        parts = [(values[rows][..., c], out[rows][..., c]) for c in range(shape[-1])] if len(shape) == 3 else None
        for part, target in parts or [(values[rows], out[rows])]:
            with np.errstate(over="ignore", invalid="ignore"):
                linear = np.multiply(part, exposure, dtype=np.float64).astype(np.float32)
                index = linear.view(np.uint32) >> 16
                target[...] = level[index] + (linear >= following[index])

    step = max(1, _BAND // max(1, values[:1].size))
    each(convert, [slice(y, y + step) for y in range(0, len(values), step)], values.size > 4 * _BAND)
    return out.reshape(shape)


def _deflate(rows: npt.NDArray[np.uint8]) -> bytes:
    """A zlib stream of the bytes, whose bands were compressed by themselves."""
    step = max(1, 4 * _BAND // rows.shape[1])
    starts = range(0, len(rows), step)

    def compress(start: int) -> bytes:
        packer = zlib.compressobj(4, zlib.DEFLATED, -15, 9, zlib.Z_RLE)  # the strategy that was made for PNG
        packed = packer.compress(rows[start : start + step].data)
        return packed + packer.flush(zlib.Z_FINISH if start == starts[-1] else zlib.Z_FULL_FLUSH)

    packed = each(compress, starts, len(starts) > 1)
    return b"".join([b"\x78\x5e", *packed, struct.pack(">I", zlib.adler32(rows.data))])


def encode_png(rgb: npt.NDArray[np.uint8], description: str = "") -> bytes:
    """A PNG file of H x W x 3 bytes of sRGB; `description` becomes its text "Description"."""
    height, width, _ = rgb.shape
    rows = np.empty((height, 1 + 3 * width), np.uint8)
    rows[:, 0] = 2  # each row is told as its difference from the one above
    flat = np.ascontiguousarray(rgb).reshape(height, 3 * width)
    rows[0, 1:] = flat[0]
    rows[1:, 1:] = flat[1:] - flat[:-1]

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    parts = [
        b"\x89PNG\r\n\x1a\n",
        chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
        chunk(b"sRGB", b"\0"),
    ]
    if description:
        parts.append(chunk(b"tEXt", b"Description\0" + description.encode("latin-1", "replace")))
    parts += [chunk(b"IDAT", _deflate(rows)), chunk(b"IEND", b"")]
    return b"".join(parts)
