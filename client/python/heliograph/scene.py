"""Scenes that a daemon holds: values."""

from __future__ import annotations

import dataclasses
import numbers
import warnings
from typing import Any

from .camera import Camera, Vector
from .errors import HeliographWarning, InvalidArgument, NotFound, invalid
from .settings import enum_name
from .v1 import render_service_pb2 as service
from .v1 import types_pb2 as types

_DEFAULT_SIZE = (1280, 720)
_MOST_JOINED_SEGMENTS = 256  # of integrators with light paths


@dataclasses.dataclass(frozen=True)
class Material:
    """name, model; base_color in [0, 1] each, emission in W / (sr m^2), roughness in [0, 1]: None where it has none."""

    name: str
    model: str
    base_color: Vector | None
    emission: Vector | None
    roughness: float | None


@dataclasses.dataclass(frozen=True)
class Light:
    """kind: "point", "spot", "directional"; intensity: W / sr, of a directional light W / m^2."""

    name: str
    kind: str
    intensity: Vector


@dataclasses.dataclass(frozen=True)
class Object:
    """transform: twelve numbers row by row, object to world; material: number of its first one."""

    name: str
    transform: tuple[float, ...]
    triangles: int
    material: int


@dataclasses.dataclass(frozen=True)
class Details:
    """What an edit may name, with present values. environment: radiance factor, None: there is none."""

    materials: tuple[Material, ...]
    lights: tuple[Light, ...]
    objects: tuple[Object, ...]
    environment: Vector | None


class SceneValues:
    """A scene that a daemon holds. Further figures are in `info`, the protocol's SceneInfo.

    warnings, notices, unread: what the loader made of the file, a line each; unread: keys that nothing looked at.
    """

    def __init__(
        self, info: service.SceneInfo, loaded: service.LoadSceneResponse | None = None, notices: tuple[str, ...] = ()
    ) -> None:
        self.info = info
        self.warnings = tuple(loaded.warnings) if loaded else ()
        self.notices = tuple(loaded.notices) if loaded else notices
        self.unread = tuple(loaded.unread) if loaded else ()
        centre = self.centre
        self.cameras: dict[str, Camera] = {}
        self._by_number = [Camera.from_view(camera.view, centre, camera) for camera in info.cameras]
        for message, camera in zip(info.cameras, self._by_number):
            self.cameras.setdefault(message.name, camera)

    @property
    def id(self) -> str:
        """Content hash, hexadecimal: the same files with the same options have the same."""
        return self.info.scene_id

    @property
    def name(self) -> str:
        """Name of the scene's file."""
        return self.info.name

    @property
    def bounds(self) -> tuple[Vector, Vector]:
        """Lowest and highest corner, scene's unit."""
        low, high = self.info.bounds_min, self.info.bounds_max
        return (low.x, low.y, low.z), (high.x, high.y, high.z)

    @property
    def centre(self) -> Vector:
        """Of the bounds: what the scene's cameras orbit around."""
        low, high = self.bounds
        return (low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2

    def camera(self, choice: Camera | str | int | None = None) -> Camera:
        """A camera of the scene by name or number; None: the first. InvalidArgument: there is no such camera."""
        if isinstance(choice, Camera):
            return choice
        cameras = self.info.cameras
        if choice is None:
            if not cameras:
                raise NotFound("the daemon reports no camera; give camera=heliograph.Camera(...)", problems=())
            return self._by_number[0]
        for number, camera in enumerate(cameras):
            if choice == camera.name and isinstance(choice, str):
                return self._by_number[number]
        if isinstance(choice, numbers.Integral) and not isinstance(choice, bool) and 0 <= choice < len(cameras):
            return self._by_number[choice]
        names = ", ".join(repr(name) for name in list(self.cameras)[:16])
        raise invalid("camera", repr(choice), f"a Camera, one of {names}, or a number in [0, {len(cameras) - 1}]")

    def complete(self, settings: types.RenderSettings, camera: Camera) -> None:
        """Fills in what the file and its camera ask for where the caller asked for nothing, as the command does."""
        joins = settings.integrator not in (types.INTEGRATOR_UNSPECIFIED, types.INTEGRATOR_PATH)
        longest = self.info.max_segments
        if settings.max_segments == 0:
            settings.max_segments = min(longest, _MOST_JOINED_SEGMENTS) if joins else longest
        if settings.roulette_from == 0:
            settings.roulette_from = self.info.roulette_from
        message = camera.source
        if message is not None and settings.filter == types.PIXEL_FILTER_UNSPECIFIED:
            settings.filter, settings.filter_scale = message.filter, message.filter_scale
        if settings.width > 0:
            return
        settings.width, settings.height = _DEFAULT_SIZE
        if message is None:
            return
        if message.width > 0 and message.height > 0:
            settings.width, settings.height = message.width, message.height
            if message.HasField("crop") and not settings.HasField("region"):
                settings.region.CopyFrom(message.crop)
        elif 0.125 <= message.aspect <= 8:  # beyond 8:1 it is more likely a mistake in the file than a wish
            settings.width = int(_DEFAULT_SIZE[1] * message.aspect + 0.5)

    def __repr__(self) -> str:
        info = self.info
        edited = " (edited)" if info.edited_from else ""
        return (
            f"<heliograph.Scene '{info.name}'{edited}: {info.triangles} triangles, {info.materials} materials, "
            f"{info.lights} lights, cameras {list(self.cameras)[:16]}, id {info.scene_id[:12]}>"
        )


@dataclasses.dataclass(frozen=True)
class ServerInfo:
    """A daemon. limits: by name, as of its options; integrators and modes: words for `settings`."""

    version: str
    build: str
    devices: tuple[str, ...]
    modes: tuple[str, ...]
    integrators: tuple[str, ...]
    scene_formats: tuple[str, ...]
    limits: dict[str, int]
    threads: int
    draining: bool
    uptime_s: float
    http_address: str  # of the viewer's page; empty: there is none
    keeps_jobs: bool  # it has a state folder, so that enqueue() and its like work


def make_server_info(message: service.GetServerInfoResponse) -> ServerInfo:
    limits = {field.name: int(getattr(message.limits, field.name)) for field in message.limits.DESCRIPTOR.fields}
    return ServerInfo(
        message.version,
        message.build,
        tuple(f"{device.kind}: {device.name}" for device in message.devices),
        tuple(enum_name(types.Mode.DESCRIPTOR, mode) for mode in message.modes),
        tuple(enum_name(types.Integrator.DESCRIPTOR, integrator) for integrator in message.integrators) or ("path",),
        tuple(message.scene_formats),
        limits,
        message.threads,
        message.draining,
        message.uptime_s,
        message.http_address,
        message.keeps_jobs,
    )


def vector_of(message: Any, field: str) -> Vector | None:
    """A Vec3 as a tuple; None where it is absent."""
    if not message.HasField(field):
        return None
    value = getattr(message, field)
    return value.x, value.y, value.z


def warn_of(scene: SceneValues, stacklevel: int) -> None:
    for text in scene.warnings:
        warnings.warn(text, HeliographWarning, stacklevel=stacklevel)


def check_scene(scene: object, kind: type) -> Any:
    """InvalidArgument: no scene of this package, or one of the other client (blocking or asyncio)."""
    if not isinstance(scene, kind):
        raise InvalidArgument(
            f"scene: {scene!r}; allowed: what load() or edit() of a client answered, or a file's path"
        )
    return scene
