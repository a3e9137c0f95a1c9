"""Cameras and their moves, with the formulas of the C++ client (client/camera_motion.cpp)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, TypedDict

from .errors import Problem, invalid, invalid_all
from .v1 import types_pb2 as types

Vector = tuple[float, float, float]

_PARALLEL = 1e-9  # squared sine below which two directions count as parallel
_LARGEST = 1e12  # magnitude of a coordinate
_RANGE = "three finite numbers in [-1e12, 1e12]"
_STEEPEST = math.asin(0.9998)  # elevation of the view at which pitch ends, radians


def read_vector(name: str, value: Any) -> Vector:
    """Three coordinates. InvalidArgument: anything else, or out of [-1e12, 1e12]."""
    try:
        x, y, z = (float(part) for part in value)
    except (TypeError, ValueError):
        raise invalid(name, value, _RANGE) from None
    if not all(abs(part) <= _LARGEST for part in (x, y, z)):
        raise invalid(name, value, _RANGE)
    return x, y, z


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        try:
            value = float(value)  # numpy's numbers
        except (TypeError, ValueError):
            raise invalid(name, value, "a finite number") from None
        if not math.isfinite(value):
            raise invalid(name, value, "a finite number")
    return float(value)


def _add(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _subtract(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _scale(a: Vector, s: float) -> Vector:
    return a[0] * s, a[1] * s, a[2] * s


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _unit(a: Vector) -> Vector:
    return _scale(a, 1 / math.sqrt(_dot(a, a)))


def _rotated(v: Vector, axis: Vector, angle: float) -> Vector:
    """Rodrigues' formula; axis is unit, angle in radians."""
    c, s = math.cos(angle), math.sin(angle)
    return _add(_add(_scale(v, c), _scale(_cross(axis, v), s)), _scale(axis, _dot(axis, v) * (1 - c)))


def _vertical(forward: Vector, up: Vector) -> Vector:
    y = (0.0, 1.0, 0.0)
    across = _cross(forward, y)
    return y if _dot(across, across) > _PARALLEL else up


def _assign(to: types.Vec3, value: Sequence[float]) -> None:
    to.x, to.y, to.z = value


def _vector(message: types.Vec3) -> Vector:
    return message.x, message.y, message.z


class Lens(TypedDict, total=False):
    """Arguments of Camera.with_lens."""

    fov: float | None
    half_height: float | None
    lens_radius: float | None
    focus_distance: float | None
    aspect: float | None


class Camera:
    """Where a picture is taken from. A value: every method answers another camera.

    position, target: world, scene's unit, coordinates in [-1e12, 1e12]. up: must not be parallel to the view.
    fov: full vertical angle, degrees, [0.0975, 179]; None: 0.8 radians (45.8 degrees).
    half_height: of an orthographic view, scene's unit, [1e-12, 1e12]; not together with fov.
    lens_radius: [0, 1e12], 0: a pinhole. focus_distance: [1e-12, 1e12], used with a lens.
    aspect: width / height of what must stay visible, [1e-6, 1e6]; 0: fov is the picture's, whatever its width.
    pivot: what orbit() turns around; None: the target.

    InvalidArgument names each argument that is out of range.
    """

    def __init__(
        self,
        position: Iterable[float],
        target: Iterable[float],
        up: Iterable[float] = (0, 1, 0),
        *,
        fov: float | None = None,
        half_height: float | None = None,
        lens_radius: float = 0,
        focus_distance: float | None = None,
        aspect: float = 0,
        pivot: Iterable[float] | None = None,
    ) -> None:
        view = types.CameraView()
        at = read_vector("target", target)
        _assign(view.position, read_vector("position", position))
        _assign(view.look_at.target, at)
        _assign(view.look_at.up, read_vector("up", up))
        self._view = _with_optics(view, fov, half_height, lens_radius, focus_distance, aspect)
        self.pivot = at if pivot is None else read_vector("pivot", pivot)
        self.source: Any = None  # the SceneCamera that it comes from, which may ask for a size and a filter
        self._axes()

    @classmethod
    def from_view(cls, view: types.CameraView, pivot: Iterable[float], source: Any = None) -> Camera:
        """The camera of a message CameraView, to the bit. source: the message SceneCamera that it comes from."""
        camera = cls.__new__(cls)
        camera._view = types.CameraView()
        camera._view.CopyFrom(view)
        camera.pivot = read_vector("pivot", pivot)
        camera.source = source
        return camera

    @property
    def view(self) -> types.CameraView:
        """As the protocol's message, a copy."""
        view = types.CameraView()
        view.CopyFrom(self._view)
        return view

    @property
    def position(self) -> Vector:
        """World, scene's unit."""
        return _vector(self._view.position)

    @property
    def forward(self) -> Vector:
        """Unit vector along the view."""
        return self._axes()[0]

    @property
    def up(self) -> Vector:
        """Unit vector, perpendicular to forward."""
        return self._axes()[1]

    @property
    def right(self) -> Vector:
        """Unit vector to the right of the picture."""
        return _cross(*self._axes())

    @property
    def fov(self) -> float | None:
        """Full vertical angle in degrees; None: an orthographic view."""
        if self._view.orthographic_half_height > 0:
            return None
        return math.degrees(self._view.vertical_fov or 0.8)

    def _axes(self) -> tuple[Vector, Vector]:
        """forward and up."""
        view = self._view
        if view.WhichOneof("orientation") == "rotation":
            q = view.rotation
            forward = (-2 * (q.x * q.z + q.w * q.y), -2 * (q.y * q.z - q.w * q.x), -(1 - 2 * (q.x * q.x + q.y * q.y)))
            up = (2 * (q.x * q.y - q.w * q.z), 1 - 2 * (q.x * q.x + q.z * q.z), 2 * (q.y * q.z + q.w * q.x))
        elif view.WhichOneof("orientation") == "look_at":
            forward = _subtract(_vector(view.look_at.target), self.position)
            up = _vector(view.look_at.up) if view.look_at.HasField("up") else (0.0, 1.0, 0.0)
        else:
            forward, up = (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)
        length = math.sqrt(_dot(forward, forward))
        if not math.isfinite(length) or length == 0:
            raise invalid("target", _vector(view.look_at.target), "a point that differs from the position")
        forward = _scale(forward, 1 / length)
        across = _subtract(up, _scale(forward, _dot(up, forward)))
        if _dot(up, up) == 0 or _dot(across, across) <= _PARALLEL * _dot(up, up):
            raise invalid("up", up, "a direction that is not parallel to the view")
        return forward, _unit(across)

    def _placed(self, position: Vector, forward: Vector, up: Vector, pivot: Vector | None = None) -> Camera:
        target = _add(position, forward)
        if not all(abs(part) <= _LARGEST for part in position + target):  # also refuses NaN
            raise invalid("position", position, "coordinates in [-1e12, 1e12], also after a move")
        camera = Camera.from_view(self._view, self.pivot if pivot is None else pivot, self.source)
        _assign(camera._view.position, position)
        _assign(camera._view.look_at.target, target)
        _assign(camera._view.look_at.up, up)
        return camera

    def _rotation(self, yaw: float, pitch: float) -> Any:
        """Turns a vector by yaw about the vertical, then by pitch about the axis to the right; degrees."""
        forward, up = self._axes()
        axis = _vertical(forward, up)
        angle = math.radians(_number("yaw", yaw))
        tilt = math.radians(_number("pitch", pitch))
        if tilt != 0:
            elevation = math.asin(max(-1.0, min(1.0, _dot(forward, axis))))
            low, high = min(-_STEEPEST, elevation), max(_STEEPEST, elevation)
            tilt = max(low, min(high, elevation + tilt)) - elevation
        level = _rotated(_cross(forward, up), axis, angle)

        def rotate(v: Vector) -> Vector:
            turned = _rotated(v, axis, angle)
            return _rotated(turned, level, tilt) if tilt != 0 else turned

        return rotate

    def orbit(self, yaw: float, pitch: float = 0, *, pivot: Iterable[float] | None = None) -> Camera:
        """Carried around the pivot, which stays where it is in the picture.

        yaw: degrees about the vertical, positive: counter-clockwise seen from above. pitch: degrees, positive: the
        camera rises; it ends where the view is all but vertical. pivot: a point; None: the camera's own.
        """
        centre = self.pivot if pivot is None else read_vector("pivot", pivot)
        forward, up = self._axes()
        rotate = self._rotation(yaw, -_number("pitch", pitch))
        return self._placed(_add(centre, rotate(_subtract(self.position, centre))), rotate(forward), rotate(up), centre)

    def turn(self, yaw: float, pitch: float = 0) -> Camera:
        """Turned on the spot. yaw: degrees about the vertical, positive: to the left. pitch: degrees, positive:
        upwards."""
        forward, up = self._axes()
        rotate = self._rotation(yaw, pitch)
        return self._placed(self.position, rotate(forward), rotate(up))

    def move(self, right: float = 0, up: float = 0, forward: float = 0) -> Camera:
        """Shifted along its own axes, scene's unit."""
        ahead, above = self._axes()
        offset = _add(
            _add(_scale(_cross(ahead, above), _number("right", right)), _scale(above, _number("up", up))),
            _scale(ahead, _number("forward", forward)),
        )
        return self._placed(_add(self.position, offset), ahead, above)

    def pan(self, right: float = 0, up: float = 0) -> Camera:
        """Shifted in the plane of the picture, scene's unit."""
        return self.move(right=right, up=up)

    def dolly(self, distance: float) -> Camera:
        """Shifted along the view, scene's unit; positive: forwards."""
        return self.move(forward=distance)

    def look_at(
        self, target: Iterable[float], *, position: Iterable[float] | None = None, up: Iterable[float] = (0, 1, 0)
    ) -> Camera:
        """Turned to `target`, which becomes the pivot; from `position`, or from where it stands."""
        at = read_vector("target", target)
        view = self.view
        if position is not None:
            _assign(view.position, read_vector("position", position))
        _assign(view.look_at.target, at)
        _assign(view.look_at.up, read_vector("up", up))
        camera = Camera.from_view(view, at, self.source)
        camera._axes()
        return camera

    def with_lens(
        self,
        *,
        fov: float | None = None,
        half_height: float | None = None,
        lens_radius: float | None = None,
        focus_distance: float | None = None,
        aspect: float | None = None,
    ) -> Camera:
        """Another field of view, lens or projection; ranges as of the constructor, None: as it is."""
        camera = Camera.from_view(self._view, self.pivot, self.source)
        _with_optics(camera._view, fov, half_height, lens_radius, focus_distance, aspect)
        return camera

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Camera) and self._view == other._view and self.pivot == other.pivot

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        def shown(v: Vector) -> str:
            return "(" + ", ".join(f"{part:.6g}" for part in v) + ")"

        lens = (
            f"fov={self.fov:.4g}" if self.fov is not None else f"half_height={self._view.orthographic_half_height:.6g}"
        )
        return (
            f"Camera({shown(self.position)}, {shown(_add(self.position, self.forward))}, up={shown(self.up)}, {lens})"
        )


def _with_optics(
    view: types.CameraView,
    fov: float | None,
    half_height: float | None,
    lens_radius: float | None,
    focus_distance: float | None,
    aspect: float | None,
) -> types.CameraView:
    problems = []

    def take(name: str, field: str, value: Any, low: float, high: float, factor: float = 1, shown: str = "") -> None:
        if value is None:
            return
        try:
            number = float(value)
        except (TypeError, ValueError):
            number = math.nan
        if not low <= number * factor <= high:
            problems.append(Problem(name, repr(value), shown or f"[{low:g}, {high:g}]"))
        else:
            setattr(view, field, number * factor)

    if fov is not None and half_height is not None:
        problems.append(Problem("half_height", repr(half_height), "not together with fov"))
    elif fov is not None:
        view.orthographic_half_height = 0
    elif half_height is not None:
        view.vertical_fov = 0
    take("fov", "vertical_fov", fov, 0.0017, 3.1242, math.pi / 180, "[0.0975, 179] degrees")
    take("half_height", "orthographic_half_height", half_height, 1e-12, 1e12)
    take("lens_radius", "lens_radius", lens_radius, 0, 1e12)
    take("focus_distance", "focus_distance", focus_distance, 1e-12, 1e12)
    if aspect is None or aspect == 0:
        view.aspect = view.aspect if aspect is None else 0
    else:
        take("aspect", "aspect", aspect, 1e-6, 1e6, 1, "[1e-6, 1e6], or 0 for none")
    if problems:
        raise invalid_all(problems)
    return view
