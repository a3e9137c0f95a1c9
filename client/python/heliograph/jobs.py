"""Jobs: the request of one, and what its stream of answers says. No input or output happens here."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from .address import is_near
from .budget import Until, make_budget
from .camera import Camera
from .errors import Cancelled, HeliographError, Internal, RenderFailed, invalid
from .frames import Frame
from .image import Image
from .scene import SceneValues
from .settings import Channel, Compression, Denoiser, PixelType, Size, choices, make_format, make_settings
from .stats import Stats, make_stats
from .tiles import Assembly, Lazy
from .v1 import job_pb2 as messages
from .v1 import types_pb2 as types
from .wire import exr_of

_WAITING = 2  # pictures that a job keeps for whoever takes them, before it stops reading


def job_request(
    scene: SceneValues,
    peer: str,
    *,
    size: Size | None,
    until: Until,
    camera: Camera | str | int | None,
    views: Iterable[Camera | str | int] | None,
    channels: Channel | Iterable[Channel],
    denoiser: Denoiser | None,
    pixel_type: PixelType,
    compression: Compression | None,
    settings: Mapping[str, Any],
) -> messages.RunJobRequest:
    """InvalidArgument: anything that is not allowed; what the daemon checks it tells with the first answer."""
    if until is None:
        raise invalid(
            "until",
            until,
            "Error(...), Samples(...), Seconds(...), or a list of them: a picture without an end is a session",
        )
    request = messages.RunJobRequest(scene_id=scene.id)
    request.budget.CopyFrom(make_budget(until))
    request.settings.CopyFrom(make_settings(size, settings))
    if compression is None:
        compression = "none" if is_near(peer) else "zip"
    request.format.CopyFrom(make_format(channels, pixel_type, compression, denoiser))
    if views is None:
        chosen = [scene.camera(camera)]
        request.camera.CopyFrom(chosen[0].view)
        scene.complete(request.settings, chosen[0])
        return request
    if camera is not None:
        raise invalid("camera", camera, "either camera or views")
    chosen = [scene.camera(choice) for choice in views]
    if not chosen:
        raise invalid("views", chosen, "at least one camera")
    request.views.extend(view.view for view in chosen)
    scene.complete(request.settings, chosen[0])
    return request


class JobFeed:
    """Takes the answers of RunJob one by one. Not thread safe."""

    def __init__(self) -> None:
        self.accepted: messages.RunJobResponse.Accepted | None = None
        self.progress: types.Progress | None = None  # of the view in hand
        self.view = 0  # number of the view in hand
        self.over = False
        self._assembly: Assembly | None = None

    def add(self, response: messages.RunJobResponse) -> Frame | None:
        """The picture of a view that is done, as an event "end". BrokenTile: the stream cannot be trusted.

        RenderFailed, Cancelled: the job ended without a picture.
        """
        kind = response.WhichOneof("response")
        if kind == "accepted":
            self.accepted = response.accepted
            self._assembly = Assembly(response.accepted.settings)
        elif kind == "progress":
            self.progress = response.progress
        elif kind == "tile":
            if self._assembly is None:
                raise Internal("a tile came before the job was accepted", problems=())
            self._assembly.add(response.tile, exr_of(response))
        elif kind == "view_result":
            return self._done(response.view_result.end)
        elif kind == "result":
            self.over = True
            return self._done(response.result.end)
        return None

    def _done(self, end: types.FrameEnd) -> Frame:
        assembly, accepted = self._assembly, self.accepted
        if assembly is None or accepted is None:
            raise Internal("a result came before the job was accepted", problems=())
        if end.reason == types.END_REASON_FAILED:
            raise RenderFailed(f"the render failed: {end.message}", problems=())
        if end.reason == types.END_REASON_CANCELLED and not assembly.complete:
            raise Cancelled("the job was cancelled" + (f": {end.message}" if end.message else ""), problems=())
        if not assembly.complete:
            raise Internal("the job ended before all tiles of the picture had come", problems=())
        tiles = assembly.snapshot()
        frame = Frame(
            "end",
            self.view + 1,
            self.view,
            make_stats(end.totals, end),
            assembly.final,
            end.message,
            tuple(accepted.unsampled),
            tuple(accepted.notices),
            accepted.settings.seed,
            tiles,
            Lazy(tiles),
        )
        self.view += 1
        self.progress = None
        self._assembly = Assembly(accepted.settings)
        return frame


class JobState:
    """A job as its reader and those who wait for it see it. Guarded by the lock of whoever owns it."""

    def __init__(self, views: int) -> None:
        self.feed = JobFeed()
        self.cancelled = False  # somebody asked for it: pictures of a path that come now are not kept
        self._path = views > 1
        self._lost = False
        self.done: deque[Frame] = deque()
        self.error: HeliographError | None = None
        self.over = False
        self.newest: Frame | None = None  # of the last view that is done

    @property
    def full(self) -> bool:
        """The reader waits: the daemon then holds back the next view of a path."""
        return len(self.done) >= _WAITING and not self.cancelled

    def add(self, response: messages.RunJobResponse) -> None:
        frame = self.feed.add(response)
        if frame is not None and self.cancelled and self._path:
            self._lost = True
        elif frame is not None:
            self.newest = frame
            self.done.append(frame)

    def finish(self, error: HeliographError | None) -> None:
        self.over = True
        if error is None and self._lost:
            error = Cancelled("the job was cancelled", problems=())
        if error is None and not self.feed.over:
            error = Internal("the daemon ended the job without a result", problems=())
        if self.error is None:
            self.error = error

    @property
    def id(self) -> str:
        return self.feed.accepted.job_id if self.feed.accepted is not None else ""

    @property
    def stats(self) -> Stats:
        if self.feed.progress is not None:
            return make_stats(self.feed.progress)
        return self.newest.stats if self.newest is not None else Stats()

    @property
    def begun(self) -> bool:
        """The daemon accepted it, or refused."""
        return self.feed.accepted is not None or self.over


def image_of(frame: Frame | None) -> Image:
    if frame is None:
        raise Internal("the daemon ended the job without a result", problems=())
    return frame.image


def describe_progress(stats: Stats) -> str:
    """For people: "24 samples, 5.1 M samples/s, error 0.0123"."""
    told = [f"{stats.samples} samples", f"{stats.samples_per_second / 1e6:.3g} M samples/s"]
    if stats.error is not None:
        told.append(f"error {stats.error:.3g}")
    return ", ".join(told)


def choices_of(name: str) -> Sequence[str]:
    """Words that a setting takes, such as choices_of("mode")."""
    field = types.RenderSettings.DESCRIPTOR.fields_by_name.get(name)
    if field is None or field.enum_type is None:
        raise invalid("name", name, "a setting whose values are words")
    return list(choices(field.enum_type))
