"""Pictures for the eye: exposure, 8-bit sRGB and PNG files, with the numbers of the command's --png."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
import numpy.typing as npt

_MIDDLE_GREY = 0.18
_DARKEST_SHARE = 1e-4  # of the mean: below it a pixel says nothing about exposure
_LARGEST_EXPOSURE = 2.0**40


def auto_exposure(rgb: npt.NDArray[Any]) -> float:
    """Factor that brings the log-average luminance (Reinhard 2002, eq. 1) of the pixels that see light to middle grey.

    rgb: H x W x 3, linear Rec.709. Pixels that are black, not finite, or darker than 1e-4 of the mean do not count. 1
    where none counts; held to [2^-40, 2^40].
    """
    wide = rgb.astype(np.float64)
    luminance = 0.2126 * wide[..., 0] + 0.7152 * wide[..., 1] + 0.0722 * wide[..., 2]
    lit = luminance[np.isfinite(luminance) & (luminance > 0)]
    lit = lit[lit >= _DARKEST_SHARE * lit.sum() / max(luminance.size, 1)]
    if lit.size == 0:
        return 1.0
    factor = _MIDDLE_GREY / np.exp(np.log(lit).mean())
    return float(np.clip(factor, 1 / _LARGEST_EXPOSURE, _LARGEST_EXPOSURE))


def srgb_bytes(rgb: npt.NDArray[Any], exposure: float) -> npt.NDArray[np.uint8]:
    """Clamps exposure * rgb to [0, 1] (NaN: 0), encodes as sRGB and rounds to 8 bits. The shape stays."""
    with np.errstate(over="ignore", invalid="ignore"):
        linear = (rgb.astype(np.float64) * exposure).astype(np.float32)
    linear = np.clip(np.nan_to_num(linear, nan=0.0, posinf=1.0, neginf=0.0), 0, 1)
    encoded = np.where(
        linear <= np.float32(0.0031308),
        np.float32(12.92) * linear,
        np.float32(1.055) * np.power(linear, np.float32(1 / 2.4)) - np.float32(0.055),
    )
    return np.floor(255 * encoded.astype(np.float32) + np.float32(0.5)).astype(np.uint8)


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
    parts += [chunk(b"IDAT", zlib.compress(rows.tobytes(), 4)), chunk(b"IEND", b"")]
    return b"".join(parts)
