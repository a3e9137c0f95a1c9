"""Keyword arguments of a client's methods, for type checkers: the methods of a scene pass them on."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any, Required, TypedDict

from .budget import Until
from .camera import Camera
from .comparison import Comparison
from .comparison.regions import Region
from .comparison.request import Measure, Reference
from .edits import Changes
from .progress import CompareProgress, Progress
from .settings import Channel, Compression, Denoiser, PixelType, Settings, Size


class _Picture(Settings, total=False):
    size: Size | None
    camera: Camera | str | int | None
    channels: Channel | Iterable[Channel]
    denoiser: Denoiser | None
    pixel_type: PixelType
    compression: Compression | None


class RenderArguments(_Picture, total=False):
    """Of Client.render."""

    until: Required[Until]
    progress: Progress


class SubmitArguments(_Picture, total=False):
    """Of Client.submit."""

    until: Required[Until]
    views: Iterable[Camera | str | int] | None


class EnqueueArguments(_Picture, total=False):
    """Of Client.enqueue."""

    until: Required[Until]
    views: Iterable[Camera | str | int] | None
    name: str
    priority: int
    client_token: str
    output: str | os.PathLike[str] | None
    overwrite: bool
    require_same_bits: bool


class SessionArguments(_Picture, total=False):
    """Of Client.session."""

    until: Until | None
    exposure: float
    gaze: tuple[float, float] | None
    buffer: int
    grace: float
    patience: float


class CompareArguments(Settings, total=False):
    """Of Client.compare."""

    seeds: int
    samples: Iterable[int] | int | None
    times: Iterable[float] | float | None
    size: Size | None
    camera: Camera | str | int | None
    views: Iterable[Camera | str | int] | None
    reference: Reference
    reference_error: float | None
    reference_samples: int | None
    regions: Mapping[str, Region] | None
    gaze: tuple[float, float] | None
    measures: Measure | Iterable[Measure] | None
    common_seeds: bool
    exclusive: bool
    pictures: bool
    worst_pixels: int
    resume: Comparison | None
    output: str | os.PathLike[str] | None
    mix: bool
    progress: CompareProgress
    timeout: float | None


class EditArguments(TypedDict, total=False):
    """Of Client.edit."""

    materials: Changes | None
    lights: Changes | None
    objects: Changes | None
    environment: dict[str, Any] | None
