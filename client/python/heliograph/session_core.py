"""A session's state and rules, without input or output: what is sent, what came, what wait() waits for."""

from __future__ import annotations

import os
import threading
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Unpack

from .address import is_near
from .budget import Until, limits_of, make_budget
from .camera import Camera, Lens
from .errors import (
    FailedPrecondition,
    HeliographError,
    HeliographWarning,
    InvalidArgument,
    NotFound,
    RenderFailed,
    ResourceExhausted,
    Unavailable,
    invalid,
)
from .frames import Frame, FrameBuffer, FrameFeed, check_buffer
from .image import Image
from .outbox import Outbox
from .reattachment import Reattachment
from .scene import SceneValues
from .settings import (
    Channel,
    Compression,
    Denoiser,
    PixelType,
    Settings,
    Size,
    make_format,
    make_settings,
    read_gaze,
    read_stops,
    read_timeout,
)
from .stats import Stats, make_stats
from .tev import DEFAULT_ADDRESS
from .v1 import frame_stream_pb2 as stream
from .v1 import render_service_pb2 as service
from .v1 import types_pb2 as types

if TYPE_CHECKING:
    from .live_tev import LiveTev
    from .notebook import Widget


class SessionPlan(NamedTuple):
    """What session() was asked for."""

    request: service.CreateSessionRequest
    camera: Camera
    exposure: float
    gaze: tuple[float, float] | None
    tile_format: types.TileFormat
    buffer: int
    patience: float


def plan_session(
    scene: SceneValues,
    peer: str,
    *,
    size: Size | None,
    until: Until | None,
    camera: Camera | str | int | None,
    exposure: float,
    gaze: tuple[float, float] | None,
    buffer: int,
    grace: float,
    patience: float,
    channels: Channel | Iterable[Channel],
    denoiser: Denoiser | None,
    pixel_type: PixelType,
    compression: Compression | None,
    settings: Mapping[str, Any],
) -> SessionPlan:
    """InvalidArgument: anything that is not allowed, before the daemon makes a session."""
    view = scene.camera(camera)
    read_stops(exposure)
    point = read_gaze(gaze)
    check_buffer(buffer)
    request = service.CreateSessionRequest(scene_id=scene.id, grace_s=read_timeout("grace", grace, zero=True))
    request.settings.CopyFrom(make_settings(size, settings))
    scene.complete(request.settings, view)
    request.budget.CopyFrom(make_budget(until))
    if compression is None:
        compression = "none" if is_near(peer) else "zip"
    tile_format = make_format(channels, pixel_type, compression, denoiser)
    seconds = read_timeout("patience", patience, zero=True)
    return SessionPlan(request, view, float(exposure), point, tile_format, buffer, seconds)


#: Takes the events that have just come; none: the stream ended.
Observer = Callable[[Sequence[Frame]], None]

_MOST_OBSERVERS = 64
_MOST_UNPROVEN = 64  # changes that the daemon has not answered and that are told apart


class _State(NamedTuple):
    """What the daemon may refuse: size and settings by their ranges and its limits, a scene that it does not hold."""

    view: int  # the first that shows it
    scene: SceneValues
    settings: types.RenderSettings


class SessionCore:
    """Guarded by `lock`. `wake` is called, with the lock held, when there is something to send or to see.

    A change that the daemon refuses ends the stream, not the session: resume() goes back to the last settings and scene
    that were rendered, and prepares another stream. The refusal is then raised once, by whoever waits next.

    Nor does a restart of the daemon: reattach() prepares a stream to the same session of the next one. Changes in
    between are sent once that is open, if the session does not have them.
    """

    def __init__(self, session_id: str, scene: SceneValues, plan: SessionPlan) -> None:
        self.lock = threading.RLock()
        self.changed = threading.Condition(self.lock)
        self.id = session_id
        self.scene = scene
        self.camera = plan.camera
        self.settings = plan.request.settings
        self.budget = plan.request.budget
        self.exposure = plan.exposure
        self.gaze = plan.gaze
        self._gaze_moved = False  # since the newest view, which has it
        self.feed = FrameFeed()
        self.buffer = FrameBuffer()
        self.buffer.resize(plan.buffer)
        self.outbox = Outbox()
        self.error: HeliographError | None = None
        self.over = False  # the stream ended
        self.closing = False
        self._view = 0
        self._observers: tuple[Observer, ...] = ()
        self._process = os.getpid()
        self._format = plan.tile_format
        self._refused: HeliographError | None = None
        self.refusals: tuple[int, str] = (0, "")  # how many so far, and what the last one says
        self._proven = _State(0, scene, self.settings)
        self._unproven: list[_State] = []
        self._resumed = False  # and nothing has been rendered since
        self._reattachment = Reattachment(plan.patience)
        self.lost = False  # the daemon restarts, and the session was not found again so far
        self._open()
        self.send_view()

    def _open(self) -> None:
        request = stream.StreamRequest.Open(session_id=self.id, format=self._format)
        self.outbox.put(stream.StreamRequest(open=request))

    def wake(self) -> None:
        self.changed.notify_all()

    # ---- what goes out

    def check_process(self) -> None:
        """FailedPrecondition: made by the process that this one was forked from. Before the lock, for a thread of the
        parent may have held it."""
        if os.getpid() != self._process:
            raise FailedPrecondition(
                "this session was made in the parent process, and gRPC does not survive fork()", problems=()
            )

    @property
    def view(self) -> int:
        return self._view

    def check(self) -> None:
        """FailedPrecondition, or what ended the stream."""
        self.check_process()
        if self.error is not None:
            raise self.error.again()
        if self.closing or self.over:
            raise FailedPrecondition("this session is closed", problems=())

    def check_refused(self) -> None:
        """Raises once what the daemon refused."""
        refused, self._refused = self._refused, None
        if refused is not None:
            raise refused.again()

    def send_view(self) -> None:
        with self.lock:
            self._view += 1
            self._gaze_moved = False
            self.buffer.forget_before(self._view)
            self._put(stream.StreamRequest(view=self._newest_view()))

    def _newest_view(self) -> types.View:
        view = types.View(id=self._view, camera=self.camera.view, exposure=self.exposure)
        if self.gaze is not None:
            view.gaze.x, view.gaze.y = self.gaze
        return view

    def _put(self, request: stream.StreamRequest) -> None:
        with self.lock:
            if not self.lost:
                self.outbox.put(request)
            self.wake()

    def _note(self) -> None:
        """The change that was put last is not proven yet."""
        if len(self._unproven) >= _MOST_UNPROVEN:
            del self._unproven[-1]
        self._unproven.append(_State(self._view, self.scene, self.settings))

    def set_camera(self, camera: Camera) -> None:
        self.check_process()
        with self.lock:
            self.check()
            self.camera = camera
            self.send_view()

    def set_exposure(self, stops: float) -> None:
        number = read_stops(stops)
        self.check_process()
        with self.lock:
            self.check()
            self.exposure = number
            self.send_view()

    def set_gaze(self, gaze: tuple[float, float] | None) -> None:
        point = read_gaze(gaze)
        self.check_process()
        with self.lock:
            self.check()
            self.gaze = point
            self._gaze_moved = True
            self._send_gaze()

    def _send_gaze(self) -> None:
        move = stream.StreamRequest.MoveGaze()
        if self.gaze is not None:
            move.gaze.x, move.gaze.y = self.gaze
        self._put(stream.StreamRequest(gaze=move))

    def set_settings(self, size: Size | None, values: Mapping[str, Any]) -> None:
        """Changes what is named; the rest stays."""
        changed = make_settings(size, values)
        self.check_process()
        with self.lock:
            self.check()
            settings = types.RenderSettings()
            settings.CopyFrom(self.settings)
            for name in (*values, *(("width", "height") if size is not None else ())):
                settings.ClearField(name)
            settings.MergeFrom(changed)
            if size is not None and "region" not in values:
                settings.ClearField("region")  # of the old size
            self.settings = settings
            self._put(stream.StreamRequest(settings=settings))
            self.send_view()  # so that an end tells whether it knew of this
            self._note()

    def set_budget(self, until: Until | None) -> None:
        budget = make_budget(until)
        self.check_process()
        with self.lock:
            self.check()
            self.budget = budget
            self._put(stream.StreamRequest(budget=budget))
            self.send_view()

    def set_scene(self, scene: SceneValues) -> None:
        self.check_process()
        with self.lock:
            self.check()
            self.scene = scene
            self._put(stream.StreamRequest(scene=stream.StreamRequest.SwitchScene(scene_id=scene.id)))
            self.send_view()
            self._note()

    def close(self) -> None:
        """Asks the daemon to end the session; its stream then ends by itself. Never blocks, and may be called again."""
        with self.lock:
            if not self.closing and not self.over:
                self.outbox.put(stream.StreamRequest(close=stream.StreamRequest.Close(close_session=True)))
            self.closing = True
            self.outbox.end()
            self.wake()

    # ---- what comes in

    def receive(self, response: stream.StreamResponse) -> None:
        """BrokenTile: the stream cannot be trusted."""
        with self.lock:
            events = self.feed.add(response)
            if self.lost and response.WhichOneof("response") == "opened":
                self._found(response.opened)
            self._prove(self.feed.view)
            # Whoever takes the newest alone waits for the end of the newest view; pictures of a view before it are
            # still shown, so that a camera that never rests is seen to move.
            every = self.buffer.size > 0
            self.buffer.add([event for event in events if every or event.kind != "end" or event.view >= self._view])
            self.wake()
            told = [text for is_warning, text in self.feed.notices if is_warning]
            self.feed.notices.clear()
            observers = self._observers if events else ()
        for observer in observers:
            observer(events)
        for text in told:
            warnings.warn(text, HeliographWarning, stacklevel=2)

    def _prove(self, view: int) -> None:
        while self._unproven and self._unproven[0].view <= view:
            self._proven = self._unproven.pop(0)
            self._resumed = False

    def resume(self, error: HeliographError | None) -> bool:
        """The stream ended by `error`. True: the daemon refused a change, and the session goes on as it was before,
        over another stream, whose requests are in a new outbox."""
        with self.lock:
            of_change = isinstance(error, (InvalidArgument, ResourceExhausted)) or (
                isinstance(error, NotFound) and any(state.scene is not self._proven.scene for state in self._unproven)
            )
            if error is None or not of_change or not self._unproven or self.closing or self.lost:
                return False
            if self._resumed and len(self._unproven) == 1:
                return False  # what was good before is refused, too
            switched = any(state.scene is not self._proven.scene for state in self._unproven)
            self._resumed = True
            self._refused = error
            self.refusals = (self.refusals[0] + 1, str(error))
            self._unproven = []
            self.scene, self.settings = self._proven.scene, self._proven.settings
            self.outbox.end()
            self.outbox = Outbox()
            self._open()
            if switched:
                self._put(stream.StreamRequest(scene=stream.StreamRequest.SwitchScene(scene_id=self.scene.id)))
            self._put(stream.StreamRequest(settings=self.settings))
            self._put(stream.StreamRequest(budget=self.budget))
            self.send_view()
            self._proven = _State(self._view, self.scene, self.settings)
            self._note()
            return True

    def reattach(self, error: HeliographError | None) -> float | None:
        """The stream ended by `error`. Seconds after which the session is to be attached again, over another stream,
        whose requests are in a new outbox; None: it is over."""
        with self.lock:
            pause = None if self.closing or error is None else self._reattachment.pause(error)
            if pause is None:
                return None
            self.lost = True
            self.outbox.end()
            self.outbox = Outbox()
            self._open()
            self.wake()
            return pause

    def reach_s(self) -> float:
        """Seconds at a time that a daemon which restarts may take to answer."""
        return min(1.0, self._reattachment.left())

    def gone(self, error: HeliographError | None) -> HeliographError | None:
        """What the end of the last stream means."""
        if self.lost and isinstance(error, NotFound):
            return Unavailable(f"the daemon came back without the session: {error}", problems=())
        return error

    def _found(self, opened: stream.Opened) -> None:
        self.lost = False
        self._reattachment.found()
        if opened.view_id >= self._view:
            if self._gaze_moved:  # before the restart, perhaps too late for it, or since
                self._send_gaze()
            return
        if opened.scene_id != self.scene.id:
            self._put(stream.StreamRequest(scene=stream.StreamRequest.SwitchScene(scene_id=self.scene.id)))
        self._put(stream.StreamRequest(settings=self.settings))
        self._put(stream.StreamRequest(budget=self.budget))
        self._put(stream.StreamRequest(view=self._newest_view()))

    def finish(self, error: HeliographError | None) -> None:
        """The stream is over, by an error or well."""
        with self.lock:
            if error is not None and not self.closing and self.error is None:
                self.error = error
            self.over = True
            self.outbox.end()
            self.wake()
            observers = self._observers
        for observer in observers:
            observer(())

    def observe(self, observer: Observer) -> None:
        """Calls it with the events that come, in the thread that receives them and without the lock, beside whoever
        iterates; with none when the stream ends. It must not raise, and while it runs nothing else is received.

        FailedPrecondition: there are 64 already.
        """
        with self.lock:
            if len(self._observers) >= _MOST_OBSERVERS:
                raise FailedPrecondition(
                    f"{_MOST_OBSERVERS} widgets and viewers show this session already", problems=()
                )
            self._observers += (observer,)

    def forget(self, observer: Observer) -> None:
        """Ends observe(). It may be running still."""
        with self.lock:
            self._observers = tuple(other for other in self._observers if other != observer)

    @property
    def left_behind(self) -> bool:
        """The stream ended by an error that the session outlives on the daemon."""
        return self.error is not None and not isinstance(self.error, (Unavailable, NotFound))

    # ---- what is waited for

    def begin_wait(self, *, error: float | None, samples: int | None, seconds: float | None) -> int:
        """Sets the budget, if one is given, and answers the view whose end is waited for."""
        limits = limits_of(error=error, samples=samples, seconds=seconds)
        self.check_process()
        with self.lock:
            self.check_refused()
            self.check()
            if limits:
                self.set_budget(limits)
            elif not (self.budget.time_s or self.budget.samples or self.budget.error):
                raise InvalidArgument(
                    "wait: nothing ends the picture; give error=, samples= or seconds=, or until= to the session",
                    problems=(),
                )
            return self._view

    def awaited(self, view: int) -> Frame | None:
        """The end of a picture of this view or a newer one; None: not yet. RenderFailed, what the daemon refused, or
        what ended the stream."""
        with self.lock:
            self.check_refused()
            end = self.feed.end
            if end is not None and end.view >= view:
                if end.stats.ended_by == "failed":
                    raise RenderFailed(f"the render failed: {end.message}", problems=())
                return end
            self.check()
            return None

    def snapshot(self) -> Frame | None:
        self.check_process()
        with self.lock:
            return self.feed.latest()

    def next_event(self) -> Frame | None:
        with self.lock:
            return self.buffer.take()

    @property
    def stats(self) -> Stats:
        self.check_process()
        with self.lock:
            if self.feed.view < self._view:
                return Stats()
            frame = self.feed.latest()
            if frame is not None:
                return frame.stats
            return make_stats(self.feed.progress) if self.feed.progress is not None else Stats()


class SessionMethods:
    """What sessions of both clients have in common: all that does not wait. Changes are sent at once; a newer one of a
    kind replaces an older one that was not sent yet, and the daemon renders the newest."""

    _core: SessionCore

    @property
    def id(self) -> str:
        """The daemon's name of it, hexadecimal."""
        return self._core.id

    @property
    def view(self) -> int:
        """Number of the newest change of camera, settings, budget or scene, from 1 on: a Frame or Image of that view
        shows all of them."""
        return self._core.view

    def _switch(self, scene: SceneValues) -> None:
        if not isinstance(scene, SceneValues):
            raise invalid("scene", scene, "what load() or edit() of a client answered")
        self._core.set_scene(scene)

    @property
    def camera(self) -> LiveCamera:
        """The camera. Its moves are sent at once; assign a Camera, or the name or number of one of the scene's."""
        return LiveCamera(self)

    @camera.setter
    def camera(self, camera: Camera | LiveCamera | str | int) -> None:
        if isinstance(camera, LiveCamera):
            camera = camera.value
        self._core.set_camera(self._core.scene.camera(camera))

    @property
    def exposure(self) -> float:
        """Stops, for JPEG previews alone."""
        return self._core.exposure

    @exposure.setter
    def exposure(self, stops: float) -> None:
        self._core.set_exposure(stops)

    @property
    def gaze(self) -> tuple[float, float] | None:
        """Where somebody looks, (x, y) in pixels from the picture's upper left corner, [-1e6, 1e6]; None: nowhere in
        particular. With foveation="density" samples go there. It may be set as often as it moves: no other picture
        begins, what there is stays, and a picture that is done gets more samples there. One that is set while the
        daemon restarts is sent once the session is found."""
        return self._core.gaze

    @gaze.setter
    def gaze(self, point: tuple[float, float] | None) -> None:
        self._core.set_gaze(point)

    @property
    def settings(self) -> types.RenderSettings:
        """As the daemon has them for the newest picture, complete: a copy of the protocol's message."""
        with self._core.lock:
            found = types.RenderSettings()
            found.CopyFrom(self._core.feed.settings or self._core.settings)
            return found

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) of the film in pixels."""
        return self._core.settings.width, self._core.settings.height

    @property
    def stats(self) -> Stats:
        """Figures of the picture of the present view at this moment; without samples until it has begun."""
        return self._core.stats

    @property
    def reconnecting(self) -> bool:
        """The daemon restarts, and the session is looked for there; changes are sent once it is found."""
        return self._core.lost

    @property
    def dropped(self) -> int:
        """Events that were replaced before anyone saw them."""
        with self._core.lock:
            return self._core.buffer.dropped

    def set(self, *, size: Size | None = None, until: Until | None = None, **settings: Unpack[Settings]) -> None:
        """Changes settings by keyword (heliograph.Settings), the size or the budget; the rest stays.

        InvalidArgument at once: an unknown name or word. A value that the daemon refuses changes nothing: the session
        goes on with the settings that it had, and the next wait() or frames() raises once what was refused.
        """
        if size is not None or settings:
            self._core.set_settings(size, settings)
        if until is not None:
            self._core.set_budget(until)

    def image(self) -> Image | None:
        """The film of the present view as it is now; None: not all of its tiles have come yet. Never one of an older
        view: right after a change of camera, settings, budget or scene it is None, and wait() waits."""
        frame = self._core.snapshot()
        return None if frame is None or frame.view < self._core.view else frame.image

    def show_in_tev(self, name: str | None = None, *, address: str = DEFAULT_ADDRESS) -> LiveTev:
        """Keeps the film up to date in tev or HDRView while it is rendered, and answers what ends that: close().

        Radiance, display where the session has it, standard error and samples, at most ten times a second, always the
        newest state; previews are not sent. It ends with the session, too. A viewer that is absent, gone or blocked is
        warned of once by the logger "heliograph.tev" and tried again every 5 s; rendering does not wait for it.
        name: an image of that name is replaced; None: one of the session's own. address: "HOST:PORT", "[IPV6]:PORT" or
        "unix:PATH". InvalidArgument: the address or the name. FailedPrecondition: 64 viewers and widgets are there.
        """
        from .live_tev import LiveTev

        self._core.check()
        return LiveTev(self._core, name, address)

    def show(self, *, exposure: float = 0, channel: str | None = None) -> Widget:
        """A widget for Jupyter: the picture as it comes, with the camera under the mouse. See heliograph.notebook.show.

        exposure: stops, [-12, 12]. channel: "radiance", "display", "error" and others; None: display where the session
        has it, else radiance. MissingPackage: anywidget is not installed.
        """
        from .notebook import show

        return show(self, exposure=exposure, channel=channel)

    def __repr__(self) -> str:
        width, height = self.size
        state = "closed" if self._core.over or self._core.closing else "open"
        return f"<heliograph.Session {self.id} {width}x{height}, {state}>"


class LiveCamera:
    """The camera of a session: the methods of Camera, each of which moves it, is sent at once and answers this object.

    Arguments, units and errors are those of Camera; FailedPrecondition: the session is closed. `value` is the camera as
    a value, to keep or to render a still from.
    """

    def __init__(self, session: SessionMethods) -> None:
        self._session = session

    @property
    def value(self) -> Camera:
        """As a value."""
        return self._session._core.camera

    def _set(self, camera: Camera) -> LiveCamera:
        self._session._core.set_camera(camera)
        return self

    def orbit(self, yaw: float, pitch: float = 0, *, pivot: Iterable[float] | None = None) -> LiveCamera:
        """As Camera.orbit: degrees."""
        return self._set(self.value.orbit(yaw, pitch, pivot=pivot))

    def turn(self, yaw: float, pitch: float = 0) -> LiveCamera:
        """As Camera.turn: degrees."""
        return self._set(self.value.turn(yaw, pitch))

    def move(self, right: float = 0, up: float = 0, forward: float = 0) -> LiveCamera:
        """As Camera.move: scene's unit."""
        return self._set(self.value.move(right, up, forward))

    def pan(self, right: float = 0, up: float = 0) -> LiveCamera:
        """As Camera.pan: scene's unit."""
        return self._set(self.value.pan(right, up))

    def dolly(self, distance: float) -> LiveCamera:
        """As Camera.dolly: scene's unit."""
        return self._set(self.value.dolly(distance))

    def look_at(
        self, target: Iterable[float], *, position: Iterable[float] | None = None, up: Iterable[float] = (0, 1, 0)
    ) -> LiveCamera:
        """As Camera.look_at."""
        return self._set(self.value.look_at(target, position=position, up=up))

    def with_lens(self, **lens: Unpack[Lens]) -> LiveCamera:
        """As Camera.with_lens."""
        return self._set(self.value.with_lens(**lens))

    @property
    def position(self) -> tuple[float, float, float]:
        """World, scene's unit."""
        return self.value.position

    @property
    def forward(self) -> tuple[float, float, float]:
        """Unit vector along the view."""
        return self.value.forward

    @property
    def up(self) -> tuple[float, float, float]:
        """Unit vector, perpendicular to forward."""
        return self.value.up

    @property
    def pivot(self) -> tuple[float, float, float]:
        """What orbit() turns around; world, scene's unit."""
        return self.value.pivot

    def __repr__(self) -> str:
        return f"<live {self.value!r}>"
