"""Keyword arguments to the protocol's RenderSettings and TileFormat.

Fields and choices are read from the protocol's descriptors, so that a field or a mode that is added there is known
here.
"""

from __future__ import annotations

import numbers
import operator
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal, TypedDict, Union

from .errors import InvalidArgument, Problem, invalid, invalid_all
from .v1 import types_pb2 as types

Mode = Literal["pt", "adaptive", "reproject", "combined"]
Integrator = Literal["path", "light", "bdpt", "pt+bdpt", "lvc", "vcm", "photon"]
PixelType = Literal["float", "half"]
#: (width, height) in pixels.
Size = Union[tuple[int, int], Sequence[int]]


class Adaptive(TypedDict, total=False):
    """Settings of the modes with adaptive counts."""

    min_samples: int  # of a pixel before counts differ, even, [4, 65536], paper: [2, 65536]
    max_samples: int  # paper: iterations, (min_samples, 2^20]
    measure: Literal["rmse", "relmse"]  # the error that the counts make small


class Reprojection(TypedDict, total=False):
    """Settings of the modes that reuse pictures."""

    stored_hits: Literal[1, 4]  # paper: first hits kept per pixel
    max_error: float  # paper: radiance, (0, 1e6]
    mapping: Literal["reverse"]


class LightCache(TypedDict, total=False):
    """Settings of integrators that store light vertices."""

    connections: int  # of a camera vertex, [1, 64]
    radius: float  # within which the first pass merges, of the scene's radius, [1e-6, 0.1]
    shrinking: float  # 0.75


class Technique(TypedDict, total=False):
    """The one bidirectional technique that is rendered alone."""

    light_vertices: int  # at least 0
    camera_vertices: int  # at least 1
    unweighted: Literal[False]


class FoveationPaper(TypedDict, total=False):
    """Settings of foveation "paper". What was published is kept unless one of the last four mends it."""

    disk: float  # radius of what is not blurred, over the way from the gaze to the farthest corner, [0.01, 1]; 0.15
    without_antialiasing: bool  # no temporal anti-aliasing outside the disk
    reject_history: bool  # no history of another surface
    fixed_disk: bool  # the radius over half of the picture's diagonal, wherever the gaze is
    mean_rate: bool  # the mean rate before in place of the last picture's
    surface_motion: bool  # motion of what a pixel shows now, not of what it showed before


class Settings(TypedDict, total=False):
    """How a picture is rendered; what is left out has the daemon's default, or what the scene's file asks for.

    Names and ranges are those of RenderSettings in proto/heliograph/v1/types.proto. Choices are words.
    """

    mode: Mode  # "pt" (default), "adaptive", "reproject", "combined"
    integrator: Integrator  # "path" (default), "light", "bdpt", "pt+bdpt", "lvc", "vcm", "photon"
    seed: int  # [0, 2^64)
    max_segments: int  # of a path, the camera's included, [1, 65535]
    roulette_from: int  # first vertex at which Russian roulette may end a path, [1, 65535]
    roulette: Literal["root", "throughput"]  # "root" (default), "throughput"
    region: Sequence[int]  # x0, y0, x1, y1 in pixels, half open: what is rendered of the film
    filter: Literal["box", "tent", "gaussian"]  # "box" (default), "tent", "gaussian"
    filter_scale: float  # pixels, (0, 16]: the tent's radius, the Gaussian's standard deviation
    variant: Literal["bounded", "paper"]  # "bounded" (default), "paper"
    adaptive: Adaptive
    reprojection: Reprojection
    light_cache: LightCache
    technique: Technique
    device: str  # what traces the paths: "cpu" (default), "vulkan", "vulkan:N"; of mode "pt" with integrator "path"
    preview_rate: float  # previews a second while the camera moves, [0, 120]; sessions only
    preview_budget_ms: float  # wall time of a preview, [5, 1000]
    preview_upscaling: bool  # previews trace surfaces in a quarter of the pixels, and along edges
    # "none" (default); "density": samples go to the gaze; "paper": previews as published (Mrad 2022) around it, a
    # baseline. Sessions and comparisons only.
    foveation: Literal["none", "density", "paper"]
    viewing_distance: float  # density: of the eye from the picture, in heights of the picture, [0.25, 20]
    foveation_paper: FoveationPaper


Channel = Literal["alpha", "depth", "normal", "albedo", "history", "density", "display"]
Compression = Literal["none", "zip", "zips", "rle", "piz", "dwaa"]
Denoiser = Literal["oidn"]

_HELD = "a number that a float can hold"

#: Names of the channels that a picture may have besides R, G, B, variance and samples.
CHANNELS: tuple[Channel, ...] = ("alpha", "depth", "normal", "albedo", "history", "density", "display")


def short_name(value: Any) -> str:
    """Of MODE_PT "pt": without the enumeration's prefix, in lower case, "-" for "_"; of INTEGRATOR_PT_BDPT
    "pt+bdpt"."""
    if value.name == "INTEGRATOR_PT_BDPT":
        return "pt+bdpt"
    prefix = value.type.values_by_number[0].name.removesuffix("UNSPECIFIED")
    name: str = value.name
    return name.removeprefix(prefix).lower().replace("_", "-")


def choices(enum: Any) -> dict[str, int]:
    """Short names and numbers of an enumeration, without UNSPECIFIED."""
    return {short_name(value): value.number for value in enum.values if value.number != 0}


def enum_name(enum: Any, number: int) -> str:
    """Short name of a value; "unspecified" for 0, the number for one that this package does not know."""
    value = enum.values_by_number.get(number)
    return short_name(value) if value else str(number)


def _fill(
    message: Any, values: Mapping[str, Any], place: str, problems: list[Problem], without: frozenset[str] = frozenset()
) -> None:
    """Sets the fields of `message` that `values` names; problems are added, with `place` before their names."""
    fields = message.DESCRIPTOR.fields_by_name
    for name, value in values.items():
        where = place + name
        field = fields.get(name)
        if field is None or name in without:
            known = ", ".join(sorted(set(fields) - without))
            problems.append(Problem(where, repr(value), f"no such setting; there are {known}"))
        elif value is None:
            continue
        elif field.enum_type is not None:
            allowed = choices(field.enum_type)
            if isinstance(value, str) and value in allowed:
                setattr(message, name, allowed[value])
            else:
                problems.append(Problem(where, repr(value), ", ".join(repr(choice) for choice in allowed)))
        elif field.message_type is not None and field.message_type.name == "Rect":
            _fill_region(getattr(message, name), value, where, problems)
        elif field.message_type is not None:
            inner = getattr(message, name)
            if isinstance(value, Mapping):
                inner.SetInParent()
                _fill(inner, value, where + ".", problems)
            else:
                problems.append(
                    Problem(where, repr(value), "a dict with any of " + ", ".join(inner.DESCRIPTOR.fields_by_name))
                )
        else:
            _fill_number(message, field, value, where, problems)


def _fill_number(message: Any, field: Any, value: Any, where: str, problems: list[Problem]) -> None:
    kind = {field.CPPTYPE_DOUBLE: "a number", field.CPPTYPE_FLOAT: "a number", field.CPPTYPE_BOOL: "True or False"}.get(
        field.cpp_type, "a whole number"
    )
    number: Any = value
    try:
        if isinstance(value, bool) != (kind == "True or False") or not isinstance(value, numbers.Real):
            raise TypeError
        if kind == "a whole number":
            number = operator.index(number)  # also numpy's
        elif kind == "a number":
            number = float(number)
        setattr(message, field.name, number)
    except TypeError:
        problems.append(Problem(where, repr(value), kind))
    except OverflowError:
        problems.append(Problem(where, repr(value), _HELD))
    except ValueError:
        bits = 64 if field.cpp_type in (field.CPPTYPE_UINT64, field.CPPTYPE_INT64) else 32
        unsigned = field.cpp_type in (field.CPPTYPE_UINT64, field.CPPTYPE_UINT32)
        problems.append(Problem(where, repr(value), f"[0, 2^{bits})" if unsigned else f"[-2^{bits - 1}, 2^{bits - 1})"))


def _fill_region(rect: Any, value: Any, where: str, problems: list[Problem]) -> None:
    try:
        rect.x0, rect.y0, rect.x1, rect.y1 = (operator.index(side) for side in value)
    except (TypeError, ValueError):
        problems.append(Problem(where, repr(value), "four whole numbers of pixels: x0, y0, x1, y1"))


def read_stops(exposure: Any, automatic: bool = False) -> float:
    """InvalidArgument: not a number in [-64, 64]. automatic: what the message allows besides."""
    try:
        stops = float("nan") if isinstance(exposure, str) else float(exposure)
    except (TypeError, ValueError, OverflowError):
        stops = float("nan")
    if not -64 <= stops <= 64:
        raise invalid("exposure", exposure, "[-64, 64] stops" + (", or None" if automatic else ""))
    return stops


def read_gaze(gaze: Any) -> tuple[float, float] | None:
    """InvalidArgument: neither None nor two numbers in [-1e6, 1e6]."""
    if gaze is None:
        return None
    try:
        x, y = (float("nan") if isinstance(value, (bool, str)) else float(value) for value in gaze)
    except (TypeError, ValueError, OverflowError):
        x = y = float("nan")
    if not (-1e6 <= x <= 1e6 and -1e6 <= y <= 1e6):
        raise invalid("gaze", gaze, "(x, y) in pixels, each in [-1e6, 1e6], or None")
    return x, y


def read_number(name: str, value: Any) -> float:
    """InvalidArgument: no number."""
    if isinstance(value, (bool, str)) or not isinstance(value, numbers.Real):
        raise invalid(name, value, "a number")
    try:
        return float(value)
    except OverflowError:
        raise invalid(name, value, _HELD) from None


def read_timeout(name: str, value: Any, zero: bool = False) -> float:
    """Seconds. InvalidArgument: not a number in (0, 86400], or with `zero` in [0, 86400]."""
    try:
        seconds = -1.0 if isinstance(value, str) else float(value)
    except (TypeError, ValueError, OverflowError):
        seconds = -1.0
    if not (0 <= seconds if zero else 0 < seconds) or seconds > 86400:
        raise invalid(name, value, f"{'[' if zero else '('}0, 86400] s")
    return seconds


def read_size(size: Size | Any) -> tuple[int, int]:
    """(width, height) in pixels. InvalidArgument: not two whole numbers of at least 1; the daemon has the upper
    limit."""
    try:
        width, height = size
        if isinstance(size, str) or width != int(width) or height != int(height) or width < 1 or height < 1:
            raise ValueError
        if max(width, height) >= 2**31:
            raise ValueError
    except (TypeError, ValueError, OverflowError):
        raise invalid("size", size, "two whole numbers of pixels above 0: (width, height)") from None
    return int(width), int(height)


def make_settings(size: Size | None, values: Mapping[str, Any]) -> types.RenderSettings:
    """InvalidArgument names every wrong name and value at once; the daemon checks ranges."""
    settings = types.RenderSettings()
    problems: list[Problem] = []
    if size is not None:
        try:
            settings.width, settings.height = read_size(size)
        except InvalidArgument as error:
            problems.extend(error.problems)
    # Sizes are given by size=.
    _fill(settings, values, "", problems, frozenset({"width", "height"}))
    if problems:
        raise invalid_all(problems)
    return settings


def make_format(
    channels: Channel | Iterable[Channel], pixel_type: PixelType, compression: Compression, denoiser: Denoiser | None
) -> types.TileFormat:
    """The TileFormat with these channels. InvalidArgument: unknown words, all at once."""
    tile_format = types.TileFormat()
    problems: list[Problem] = []
    for name in [channels] if isinstance(channels, str) else channels:
        if name in CHANNELS:
            setattr(tile_format, name, True)
        else:
            problems.append(Problem("channels", repr(name), ", ".join(repr(channel) for channel in CHANNELS)))
    words = {"pixel_type": pixel_type, "compression": compression, "display_denoiser": denoiser}
    _fill(tile_format, words, "", problems)
    if problems:
        raise invalid_all(
            [Problem(p.field.replace("display_denoiser", "denoiser"), p.value, p.allowed) for p in problems]
        )
    if denoiser is not None:
        tile_format.display = True
    return tile_format
