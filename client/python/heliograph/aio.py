"""The package for asyncio: the same names, whose methods that wait are coroutines, over grpc.aio.

    import asyncio, heliograph.aio as hg
    async def main():
        async with await hg.serve() as c:
            image = await c.render("cornell-box.gltf", size=(640, 360), until=hg.Error(0.01))
    asyncio.run(main())

Values (Image, Camera, budgets, errors) are those of heliograph. Use a client in one event loop alone.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import pathlib
import time as clock
import weakref
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable, Coroutine, Iterable, Sequence
from typing import Any, TypeVar, Union, Unpack

import grpc
import grpc.aio

from . import CHANNELS as CHANNELS
from . import operations
from ._version import __version__ as __version__
from .address import check_address, read_token
from .arguments import (
    CompareArguments,
    EditArguments,
    EnqueueArguments,
    RenderArguments,
    SessionArguments,
    SubmitArguments,
)
from .budget import Error as Error
from .budget import Limit as Limit
from .budget import Samples as Samples
from .budget import Seconds as Seconds
from .budget import Until as Until
from .calls import Call, Operation, Upload
from .camera import Camera as Camera
from .client_methods import ClientMethods, check_compare, listed
from .comparison import Comparison as Comparison
from .comparison import Disk as Disk
from .comparison.request import Modes, Plan
from .comparison.run import ComparisonRun, keeping
from .connection import channel_options, check_process, keep_from_children, tell_ignored, unreachable
from .daemon import Daemon as Daemon
from .edits import Changes
from .errors import (
    BrokenTile,
    Cancelled,
    DeadlineExceeded,
    FailedPrecondition,
    HeliographError,
    HeliographWarning,
    Internal,
    InvalidArgument,
    MissingChannel,
    MissingPackage,
    NotFound,
    PermissionDenied,
    Problem,
    RenderFailed,
    ResourceExhausted,
    Unavailable,
    Unimplemented,
    from_rpc,
    invalid,
)
from .exr import Window as Window
from .files import AtomicFile
from .frames import Frame as Frame
from .image import Image as Image
from .jobs import JobFeed, JobState, image_of
from .kept_jobs import JobEvent as JobEvent
from .kept_jobs import JobInfo as JobInfo
from .kept_jobs import JobResult as JobResult
from .kept_jobs import (
    KeptJobValues,
    PictureFeed,
    ResultFeed,
    States,
    WatchFeed,
    check_going_on,
    image_of_result,
    make_job_info,
    read_states,
    result_request,
    tiles_request,
)
from .kept_jobs import TimeLeft as TimeLeft
from .outbox import Outbox
from .progress import CompareProgress, ComparisonReporter, Progress, Reporter
from .reattachment import LONGEST_PAUSE_S, Reattachment
from .replay import Replay as Replay
from .scene import Details, Light, Material, Object, SceneValues, ServerInfo, check_scene, make_server_info, warn_of
from .session_core import SessionCore, SessionMethods, SessionPlan
from .settings import Channel, PixelType, read_timeout
from .settings import Settings as Settings
from .stats import Stats as Stats
from .stats import make_stats
from .tls import Tls, explain, read_tls
from .v1 import durable_job_pb2 as kept
from .v1 import job_pb2 as jobs
from .v1 import render_service_pb2 as service
from .v1 import render_service_pb2_grpc as api
from .wire import add_streams

__all__ = [
    "BrokenTile",
    "CHANNELS",
    "Camera",
    "Cancelled",
    "Client",
    "Comparison",
    "Daemon",
    "DeadlineExceeded",
    "Details",
    "Disk",
    "Error",
    "FailedPrecondition",
    "Frame",
    "HeliographError",
    "HeliographWarning",
    "Image",
    "Internal",
    "InvalidArgument",
    "Job",
    "JobEvent",
    "JobInfo",
    "JobResult",
    "KeptJob",
    "Light",
    "Limit",
    "Material",
    "MissingChannel",
    "MissingPackage",
    "NotFound",
    "Object",
    "PermissionDenied",
    "Problem",
    "RenderFailed",
    "Replay",
    "ResourceExhausted",
    "Samples",
    "Scene",
    "Seconds",
    "ServerInfo",
    "Session",
    "Settings",
    "Stats",
    "TimeLeft",
    "Unavailable",
    "Unimplemented",
    "Until",
    "Window",
    "__version__",
    "compare",
    "connect",
    "serve",
]

T = TypeVar("T")
_CLOSE_S = 10.0  # that the daemon gets to end a session


class _Connection:
    """A channel to one daemon."""

    def __init__(self, address: str, token: str, timeout: float, tls: Tls | None = None) -> None:
        check_process()
        self.peer = address
        self.tls = tls
        self.timeout = timeout
        self.metadata = (("authorization", f"Bearer {token}"),) if token else ()
        options = channel_options(timeout)
        self.channel = (
            grpc.aio.insecure_channel(address, options)
            if tls is None
            else grpc.aio.secure_channel(address, tls.credentials(), options + tls.options())
        )
        self.stub: Any = api.RenderServiceStub(self.channel)  # type: ignore[no-untyped-call]
        add_streams(self.stub, self.channel)
        keep_from_children(self)
        self._process = os.getpid()
        self._closed = False

    def check(self) -> None:
        if os.getpid() != self._process:
            raise FailedPrecondition(
                "this client was made in the parent process, and gRPC does not survive fork()", problems=()
            )
        if self._closed:
            raise FailedPrecondition("this client is closed", problems=())

    async def close(self) -> None:
        self._closed = True
        await self.channel.close(None)

    async def call(self, call: Call, timeout: float | None = None, wait: bool = False) -> Any:
        self.check()
        if timeout is None and call.quick:
            timeout = self.timeout
        request = _messages(call.request) if isinstance(call.request, Upload) else call.request
        rpc = getattr(self.stub, call.method)(request, timeout=timeout, metadata=self.metadata, wait_for_ready=wait)
        try:
            answer = await rpc
        except grpc.RpcError as error:
            if isinstance(call.request, Upload) and call.request.error is not None:
                raise call.request.error from None
            raise from_rpc(error, self.peer) from None
        except asyncio.CancelledError:
            rpc.cancel()
            if isinstance(call.request, Upload) and call.request.error is not None:  # grpc.aio's way to tell of it
                raise call.request.error from None
            raise
        tell_ignored(await rpc.trailing_metadata(), self.peer)
        return answer

    async def run(self, operation: Operation[T], reads_files: bool = False) -> T:
        """reads_files: the operation takes its steps in another thread, so that the loop goes on."""

        async def step(advance: Callable[..., Any], *arguments: Any) -> tuple[bool, Any]:
            if reads_files:
                return await asyncio.to_thread(_advance, advance, *arguments)
            return _advance(advance, *arguments)

        done, value = await step(operation.__next__)
        while not done:
            try:
                answer = await self.call(value)
            except HeliographError as error:
                done, value = await step(operation.throw, error)
            else:
                done, value = await step(operation.send, answer)
        result: T = value
        return result

    def open(self, method: str, request: Any, timeout: float | None = None) -> Any:
        self.check()
        return getattr(self.stub, method)(request, timeout=timeout, metadata=self.metadata)

    async def reach(self, seconds: float) -> None:
        """As heliograph.connection.Connection.reach."""
        if seconds > 0:
            with contextlib.suppress(HeliographError):
                await self.call(Call("GetServerInfo", service.GetServerInfoRequest()), seconds, True)

    async def greet(self, wait: float) -> service.GetServerInfoResponse:
        call = Call("GetServerInfo", service.GetServerInfoRequest())
        end = clock.monotonic() + wait
        while True:
            try:
                info: service.GetServerInfoResponse = await self.call(
                    call, max(wait, 0.1) if wait else self.timeout, wait > 0
                )
                return info
            except HeliographError as error:
                if isinstance(error, Unavailable) and clock.monotonic() < end:
                    await asyncio.sleep(0.05)
                    continue
                failure = unreachable(error, self.peer)
                raise await asyncio.to_thread(explain, failure, self.peer, self.tls) from None


def _advance(advance: Callable[..., Any], *arguments: Any) -> tuple[bool, Any]:
    """False and the next call, or True and the result: StopIteration does not pass through a future."""
    try:
        return False, advance(*arguments)
    except StopIteration as done:
        return True, done.value


async def _messages(upload: Upload) -> AsyncIterator[Any]:
    """Files are read and hashed in another thread."""
    messages = iter(upload)
    while (message := await asyncio.to_thread(lambda: next(messages, None))) is not None:
        yield message


class _Bell:
    """Wakes every coroutine that waits, from any thread."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._event = asyncio.Event()

    def ring(self) -> None:
        try:
            running = asyncio.get_running_loop()
        except RuntimeError:
            running = None
        if running is self._loop:
            self._event.set()
        elif not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._event.set)

    async def wait_for(self, condition: Callable[[], T | None], timeout: float | None, what: str) -> T:
        """The first answer of condition() that is not None. DeadlineExceeded after `timeout` seconds."""
        end = None if timeout is None else clock.monotonic() + timeout
        while True:
            found = condition()
            if found is not None:
                return found
            left = None if end is None else end - clock.monotonic()
            if left is not None and left <= 0:
                raise DeadlineExceeded(f"{what} within {timeout:g} s", problems=())
            self._event.clear()
            try:
                await asyncio.wait_for(self._event.wait(), left)
            except TimeoutError:
                pass


class _Core(SessionCore):
    def __init__(self, *arguments: Any) -> None:
        self.bell = _Bell()
        super().__init__(*arguments)

    def wake(self) -> None:
        self.bell.ring()


class Session(SessionMethods):
    """As heliograph.Session; frames, wait, edit and close are for `async for` and `await`."""

    def __init__(self, client: Client, connection: _Connection, core: _Core) -> None:
        self._client = client
        self._core: _Core = core
        self._task = asyncio.create_task(_read_session(core, connection))
        self._finalizer = weakref.finalize(self, core.close)
        self._finalizer.atexit = False  # the loop is gone by then

    @property
    def scene(self) -> Scene:
        """The scene that is rendered. Assign another to switch; modes that reuse pictures keep what an edit left
        true."""
        scene: Scene = self._core.scene  # type: ignore[assignment]
        return scene

    @scene.setter
    def scene(self, scene: Scene) -> None:
        self._switch(scene)

    def frames(self, *, buffer: int | None = None, timeout: float | None = None) -> AsyncIterator[Frame]:
        """As heliograph.Session.frames."""
        if timeout is not None:
            timeout = read_timeout("timeout", timeout, zero=True)
        if buffer is not None:
            self._core.buffer.resize(buffer)
        return self._iterate(timeout)

    async def _iterate(self, timeout: float | None) -> AsyncIterator[Frame]:
        core = self._core

        def next_event() -> Frame | bool | None:
            core.check_refused()
            event = core.next_event()
            if event is None and core.error is not None:
                raise core.error.again()
            return event if event is not None else (False if core.over or core.closing else None)

        while True:
            event = await core.bell.wait_for(next_event, timeout, "no event")
            if not isinstance(event, Frame):
                return
            yield event

    async def wait(
        self,
        *,
        error: float | None = None,
        samples: int | None = None,
        seconds: float | None = None,
        timeout: float | None = None,
    ) -> Image:
        """As heliograph.Session.wait."""
        if timeout is not None:
            timeout = read_timeout("timeout", timeout, zero=True)
        core = self._core
        view = core.begin_wait(error=error, samples=samples, seconds=seconds)
        frame = await core.bell.wait_for(lambda: core.awaited(view), timeout, "the picture was not done")
        return frame.image

    async def edit(
        self,
        *,
        materials: Changes | None = None,
        lights: Changes | None = None,
        objects: Changes | None = None,
        environment: dict[str, Any] | None = None,
    ) -> None:
        """As heliograph.Session.edit."""
        self._core.check()
        self.scene = await self._client.edit(
            self.scene, materials=materials, lights=lights, objects=objects, environment=environment
        )

    async def close(self) -> None:
        """Ends the session on the daemon. May be called again."""
        if self._finalizer.detach() is None:
            return
        self._core.close()
        try:
            await asyncio.wait_for(asyncio.shield(self._task), _CLOSE_S)
        except TimeoutError:
            self._task.cancel()
        except asyncio.CancelledError:
            self._task.cancel()
            raise
        if self._core.left_behind:
            with contextlib.suppress(HeliographError):
                await self._client._connection.run(operations.close_session(self.id))

    async def __aenter__(self) -> Session:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()


async def _requests(core: _Core, outbox: Outbox) -> AsyncIterator[Any]:
    while True:
        request = await core.bell.wait_for(lambda: outbox.take() or (False if outbox.ended else None), None, "")
        if request is False:
            return
        yield request


async def _read_session(core: _Core, connection: _Connection) -> None:
    failure = await _receive_session(core, connection)
    while core.resume(failure) or await _wait_for_daemon(core, connection, failure):
        failure = await _receive_session(core, connection)
    core.finish(core.gone(failure))


async def _wait_for_daemon(core: _Core, connection: _Connection, failure: HeliographError | None) -> bool:
    """Whether the session is to be attached again, now."""
    pause = core.reattach(failure)
    if pause is None:
        return False
    with contextlib.suppress(DeadlineExceeded):
        await core.bell.wait_for(lambda: True if core.closing else None, pause, "")
    if not core.closing:
        await connection.reach(core.reach_s())
    return not core.closing


async def _receive_session(core: _Core, connection: _Connection) -> HeliographError | None:
    """All answers; what ended them, None: they ended well."""
    failure: HeliographError | None = None
    call = None
    try:
        call = connection.open("StreamFrames", _requests(core, core.outbox))
        async for response in call:
            core.receive(response)
    except grpc.RpcError as error:
        failure = from_rpc(error, connection.peer)
        if isinstance(failure, Cancelled) and core.closing:
            failure = None
    except HeliographError as error:
        failure = error
    except asyncio.CancelledError:
        failure = Cancelled("the connection was closed", problems=())
    except Exception as error:  # a fault of this package must reach whoever waits
        failure = Internal(f"{type(error).__name__}: {error}", problems=())
    finally:
        if call is not None:
            call.cancel()
    return failure


class Job:
    """As heliograph.Job; result, images and cancel are for `await` and `async for`."""

    def __init__(self, connection: _Connection, request: Any, views: int) -> None:
        self.views = views
        self._connection = connection
        self._state = JobState(views)
        self._bell = _Bell()
        self._task = asyncio.create_task(_read_job(self._state, self._bell, connection, request))
        self._finalizer = weakref.finalize(self, _cancel, self._task, asyncio.get_running_loop())
        self._finalizer.atexit = False

    async def _begin(self) -> None:
        await self._bell.wait_for(lambda: self._state.begun or None, None, "")
        if self._state.error is not None:
            raise self._state.error.again()

    @property
    def id(self) -> str:
        """The daemon's name of it."""
        return self._state.id

    @property
    def stats(self) -> Stats:
        """Figures of the view in hand."""
        return self._state.stats

    @property
    def done(self) -> bool:
        """Nothing more will come from the daemon."""
        return self._state.over

    async def result(self, timeout: float | None = None) -> Image:
        """As heliograph.Job.result."""
        if self.views != 1:
            raise FailedPrecondition(f"this job has {self.views} views: iterate images()", problems=())
        await self._await(lambda: self._state.over or None, timeout)
        if self._state.newest is None and self._state.error is not None:
            raise self._state.error.again()
        return image_of(self._state.newest)

    async def images(self, timeout: float | None = None) -> AsyncIterator[Image]:
        """As heliograph.Job.images."""
        while True:
            await self._await(lambda: True if self._state.done or self._state.over else None, timeout)
            if not self._state.done:
                if self._state.error is not None:
                    raise self._state.error.again()
                return
            frame = self._state.done.popleft()
            self._bell.ring()
            yield frame.image

    async def _await(self, condition: Callable[[], bool | None], timeout: float | None) -> None:
        if timeout is not None:
            timeout = read_timeout("timeout", timeout, zero=True)
        await self._bell.wait_for(condition, timeout, "the job was not done")

    async def cancel(self) -> None:
        """As heliograph.Job.cancel."""
        if self.done:
            return
        self._state.cancelled = True
        self._bell.ring()
        with contextlib.suppress(NotFound):
            await self._connection.run(operations.cancel_job(self.id))

    async def close(self) -> None:
        """Cancels the job, if it goes on. May be called again."""
        self._finalizer.detach()
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    async def __aenter__(self) -> Job:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()


async def _read_job(state: JobState, bell: _Bell, connection: _Connection, request: Any) -> None:
    failure: HeliographError | None = None
    call = connection.open("RunJob", request)
    try:
        async for response in call:
            state.add(response)
            bell.ring()
            await bell.wait_for(lambda: True if not state.full or state.feed.over else None, None, "")
    except grpc.RpcError as error:
        failure = from_rpc(error, connection.peer)
    except HeliographError as error:
        failure = error
    except asyncio.CancelledError:
        failure = Cancelled("the job was closed", problems=())
    except Exception as error:  # a fault of this package must reach whoever waits
        failure = Internal(f"{type(error).__name__}: {error}", problems=())
    finally:
        call.cancel()
        state.finish(failure)
        bell.ring()


def _cancel(task: asyncio.Task[None], loop: asyncio.AbstractEventLoop) -> None:
    if not loop.is_closed():
        loop.call_soon_threadsafe(task.cancel)


class KeptJob(KeptJobValues):
    """As heliograph.KeptJob; the methods are for `await`, watch for `async for`."""

    def __init__(self, connection: _Connection, info: JobInfo, submitted: kept.SubmitJobResponse | None = None) -> None:
        super().__init__(info, submitted)
        self._connection = connection

    async def info(self) -> JobInfo:
        """As heliograph.KeptJob.info."""
        return self._hear(await self._connection.run(operations.job_info(self.id)))

    def watch(
        self, *, from_seq: int = 1, progress: bool = True, timeout: float | None = None, patience: float = 60
    ) -> AsyncIterator[JobEvent]:
        """As heliograph.KeptJob.watch."""
        return self._watch(WatchFeed(self.id, from_seq=from_seq, progress=progress, timeout=timeout, patience=patience))

    async def _watch(self, feed: WatchFeed) -> AsyncIterator[JobEvent]:
        async with contextlib.aclosing(_watch(self._connection, feed)) as events:
            async for event in events:
                if feed.job is not None:
                    self._hear(feed.job)
                yield event

    async def wait(
        self,
        timeout: float | None = None,
        *,
        through_pauses: bool = False,
        progress: Progress = False,
        patience: float = 60,
    ) -> JobInfo:
        """As heliograph.KeptJob.wait."""
        feed = WatchFeed(
            self.id,
            progress=progress is not False,
            timeout=timeout,
            patience=patience,
            late="the job was not done",
        )
        with Reporter(progress) as reporter:
            async with contextlib.aclosing(_watch(self._connection, feed, begins=True)) as events:
                async for event in events:
                    if feed.job is None:
                        continue
                    self._hear(feed.job)
                    if event is not None and event.info is not None:
                        reporter.update(event.info.stats)
                    if check_going_on(feed.job, through_pauses):
                        break
        return await self.info()

    async def pause(self) -> JobInfo:
        """As heliograph.KeptJob.pause."""
        return self._hear(await self._connection.run(operations.pause_job(self.id)))

    async def resume(self) -> JobInfo:
        """As heliograph.KeptJob.resume."""
        return self._hear(await self._connection.run(operations.resume_job(self.id)))

    async def cancel(self) -> JobInfo:
        """As heliograph.KeptJob.cancel."""
        return self._hear(await self._connection.run(operations.cancel_kept_job(self.id)))

    async def set_priority(self, priority: int) -> JobInfo:
        """As heliograph.KeptJob.set_priority."""
        return self._hear(await self._connection.run(operations.set_job_priority(self.id, priority)))

    async def fetch(self, view: int = 0, *, patience: float = 60) -> Image:
        """As heliograph.KeptJob.fetch; the file is decoded in another thread."""

        async def attempt() -> tuple[JobResult, list[bytes]]:
            chunks: list[bytes] = []
            return await self._fetch(view, chunks.append), chunks

        result, chunks = await self._again(attempt, patience)
        return await asyncio.to_thread(lambda: image_of_result(b"".join(chunks), result, self.latest, self.notices))

    async def fetch_to(self, path: str | os.PathLike[str], view: int = 0, *, patience: float = 60) -> pathlib.Path:
        """As heliograph.KeptJob.fetch_to; the file is written in another thread."""

        async def attempt() -> pathlib.Path:
            with AtomicFile(path, ".exr") as file:
                await self._fetch(view, file.write)
                return await asyncio.to_thread(file.commit)

        return await self._again(attempt, patience)

    async def picture(
        self,
        view: int = 0,
        *,
        window: Sequence[int] | None = None,
        channels: Channel | Iterable[Channel] = (),
        pixel_type: PixelType = "float",
    ) -> Image:
        """As heliograph.KeptJob.picture; the tiles are decoded in another thread."""
        request = tiles_request(self.id, view, window, channels, pixel_type)
        feed = PictureFeed(request, self.latest)
        call = self._connection.open("GetResult", request, self._connection.timeout)
        try:
            async for response in call:
                feed.add(response)
        except grpc.RpcError as error:
            raise operations.of_kept_jobs(from_rpc(error, self._connection.peer)) from None
        except BaseException:
            call.cancel()
            raise
        return await asyncio.to_thread(lambda: feed.image(self.latest, self.notices))

    async def _again(self, attempt: Callable[[], Awaitable[T]], patience: float) -> T:
        """As heliograph.KeptJob._again."""
        waits = Reattachment(read_timeout("patience", patience, zero=True), planned=False)
        while True:
            try:
                return await attempt()
            except HeliographError as error:
                pause = waits.pause(error)
                if pause is None:
                    raise
            await asyncio.sleep(pause)
            await self._connection.reach(min(LONGEST_PAUSE_S, waits.left()))

    async def _fetch(self, view: int, take: Callable[[bytes], None]) -> JobResult:
        """take: called in another thread."""
        request = result_request(self.id, view)
        feed = ResultFeed(self.id, request.view)

        def add(response: kept.GetResultResponse) -> None:
            chunk = feed.add(response)
            if chunk:
                take(chunk)

        call = self._connection.open("GetResult", request)
        try:
            async for response in call:
                await asyncio.to_thread(add, response)
        except grpc.RpcError as error:
            raise operations.of_kept_jobs(from_rpc(error, self._connection.peer)) from None
        except BaseException:
            call.cancel()
            raise
        return feed.finish()


async def _watch(connection: _Connection, feed: WatchFeed, begins: bool = False) -> AsyncGenerator[Any, None]:
    """As heliograph.kept_job.watch."""
    while True:
        call = connection.open("WatchJob", feed.request(), feed.seconds_left())
        try:
            async for response in call:
                event = feed.add(response)
                if event is not None or (begins and response.WhichOneof("response") == "watching"):
                    yield event
            feed.check_over()
            return
        except grpc.RpcError as error:
            failure = operations.of_kept_jobs(from_rpc(error, connection.peer))
        finally:
            call.cancel()
        await asyncio.sleep(feed.failed(failure))
        await connection.reach(feed.reach_s())


class Scene(SceneValues):
    """As heliograph.Scene."""

    def __init__(
        self,
        client: Client,
        info: service.SceneInfo,
        loaded: service.LoadSceneResponse | None = None,
        notices: tuple[str, ...] = (),
    ) -> None:
        super().__init__(info, loaded, notices)
        self._client = client

    def render(self, **arguments: Unpack[RenderArguments]) -> Awaitable[Image]:
        """As Client.render."""
        return self._client.render(self, **arguments)

    def session(self, **arguments: Unpack[SessionArguments]) -> Awaitable[Session]:
        """As Client.session."""
        return self._client.session(self, **arguments)

    def submit(self, **arguments: Unpack[SubmitArguments]) -> Awaitable[Job]:
        """As Client.submit."""
        return self._client.submit(self, **arguments)

    def enqueue(self, **arguments: Unpack[EnqueueArguments]) -> Awaitable[KeptJob]:
        """As Client.enqueue."""
        return self._client.enqueue(self, **arguments)

    def compare(self, modes: Modes, **arguments: Unpack[CompareArguments]) -> Awaitable[Comparison]:
        """As Client.compare."""
        return self._client.compare(self, modes, **arguments)

    def edit(self, **changes: Unpack[EditArguments]) -> Awaitable[Scene]:
        """As Client.edit."""
        return self._client.edit(self, **changes)

    def inspect(self) -> Awaitable[Details]:
        """As Client.inspect."""
        return self._client.inspect(self)

    def unload(self) -> Awaitable[None]:
        """As Client.unload."""
        return self._client.unload(self)


SceneLike = Union[Scene, str, "os.PathLike[str]"]


class Client(
    ClientMethods[
        Scene,
        Coroutine[Any, Any, Image],
        Coroutine[Any, Any, Job],
        Coroutine[Any, Any, KeptJob],
        Coroutine[Any, Any, Session],
        Coroutine[Any, Any, Comparison],
    ]
):
    """As heliograph.Client, with coroutines; an asynchronous context manager. Arguments and errors are told there.

    render, submit, enqueue, session and compare are coroutines, too: `async with await client.session(...) as session`.
    """

    def __init__(self, connection: _Connection, info: ServerInfo, daemon: Daemon | None = None) -> None:
        self._connection = connection
        self._open: weakref.WeakSet[Session | Job] = weakref.WeakSet()
        self.daemon = daemon
        self._first_info = info

    @property
    def address(self) -> str:
        """Of the daemon: "HOST:PORT" or "unix:PATH"."""
        return self._connection.peer

    async def info(self) -> ServerInfo:
        """As heliograph.Client.info."""
        return await self._connection.run(operations.server_info())

    async def load(
        self,
        path: str | os.PathLike[str],
        *,
        environment: str | os.PathLike[str] | Sequence[float] | None = None,
        on_server: bool = False,
        time: float = 0,
        animation: str = "",
        strict: bool = False,
    ) -> Scene:
        """As heliograph.Client.load."""
        info, loaded = await self._connection.run(
            operations.load(path, environment, on_server, time, animation, strict), reads_files=True
        )
        scene = Scene(self, info, loaded)
        warn_of(scene, 3)
        return scene

    async def scenes(self) -> list[Scene]:
        """As heliograph.Client.scenes."""
        return [Scene(self, info) for info in await self._connection.run(operations.scenes())]

    async def files(self, folder: str | os.PathLike[str] = "") -> list[pathlib.PurePosixPath]:
        """As heliograph.Client.files."""
        return await self._connection.run(operations.files(folder))

    async def inspect(self, scene: SceneLike) -> Details:
        """As heliograph.Client.inspect."""
        return await self._connection.run(operations.describe(await self._scene(scene)))

    async def edit(
        self,
        scene: Scene,
        *,
        materials: Changes | None = None,
        lights: Changes | None = None,
        objects: Changes | None = None,
        environment: dict[str, Any] | None = None,
    ) -> Scene:
        """As heliograph.Client.edit."""
        check_scene(scene, Scene)
        info, notices = await self._connection.run(operations.edit(scene, materials, lights, objects, environment))
        return Scene(self, info, notices=notices)

    async def unload(self, scene: Scene) -> None:
        """As heliograph.Client.unload."""
        await self._connection.run(operations.unload(check_scene(scene, Scene)))

    async def _scene(self, scene: SceneLike) -> Scene:
        if isinstance(scene, (str, os.PathLike)):
            return await self.load(scene)
        found: Scene = check_scene(scene, Scene)
        return found

    async def _render(
        self, scene: SceneLike, make_request: Callable[[Scene], jobs.RunJobRequest], progress: Progress
    ) -> Image:
        request = make_request(await self._scene(scene))
        feed, frame = JobFeed(), None
        with Reporter(progress) as reporter:
            call = self._connection.open("RunJob", request)
            try:
                async for response in call:
                    frame = feed.add(response) or frame
                    if feed.progress is not None and response.HasField("progress"):
                        reporter.update(make_stats(feed.progress))
            except grpc.RpcError as error:
                raise from_rpc(error, self.address) from None
            except BaseException:
                call.cancel()
                raise
        return image_of(frame)

    async def _submit(self, scene: SceneLike, make_request: Callable[[Scene], jobs.RunJobRequest]) -> Job:
        request = make_request(await self._scene(scene))
        job = Job(self._connection, request, len(request.views) or 1)
        self._open.add(job)
        await job._begin()
        return job

    async def _enqueue(self, scene: SceneLike, make_request: Callable[[Scene], kept.SubmitJobRequest]) -> KeptJob:
        answer = await self._connection.run(operations.submit_job(make_request(await self._scene(scene))))
        return KeptJob(self._connection, make_job_info(answer.job), answer)

    async def _session(self, scene: SceneLike, make_plan: Callable[[Scene], SessionPlan]) -> Session:
        loaded = await self._scene(scene)
        plan = make_plan(loaded)
        created = await self._connection.run(operations.create_session(plan.request))
        try:
            session = Session(self, self._connection, _Core(created.session_id, loaded, plan))
        except BaseException:
            with contextlib.suppress(HeliographError):
                await self._connection.run(operations.close_session(created.session_id))
            raise
        self._open.add(session)
        return session

    async def _compare(
        self, scene: SceneLike, make_plan: Callable[[Scene | None], Plan], progress: CompareProgress
    ) -> Comparison:
        if isinstance(scene, (str, os.PathLike)):
            await asyncio.to_thread(make_plan, None)
        loaded = await self._scene(scene)
        run = ComparisonRun(await asyncio.to_thread(make_plan, loaded))  # it looks into files, and encodes arrays
        with keeping(run), ComparisonReporter(progress) as reporter:
            while True:
                references = [
                    await self._connection.run(operations.load_reference(file), reads_files=True) for file in run.files
                ]
                call = self._connection.open("Compare", run.request(references), run.seconds_left())
                try:
                    async for response in call:
                        told = run.add(response)
                        if told is not None:
                            reporter.update(told)
                    tell_ignored(await call.trailing_metadata(), self.address)
                    return run.result()
                except grpc.RpcError as error:
                    failure = run.failed(from_rpc(error, self.address))
                    if failure is not None:
                        raise failure from None
                except BaseException:
                    call.cancel()
                    raise

    async def replay(self, token: str) -> Replay:
        """As heliograph.Client.replay."""
        return Replay(await self._connection.run(operations.replay(token)))

    async def job(self, job_id: str) -> KeptJob:
        """As heliograph.Client.job."""
        return KeptJob(self._connection, await self._connection.run(operations.job_info(job_id)))

    def jobs(self, states: States = None) -> AsyncIterator[KeptJob]:
        """As heliograph.Client.jobs, for `async for`."""
        return self._jobs(read_states(states))

    async def _jobs(self, states: list[int]) -> AsyncIterator[KeptJob]:
        token = ""
        while True:
            page, token = await self._connection.run(operations.job_page(states, token))
            for info in page:
                yield KeptJob(self._connection, info)
            if not token:
                return

    def watch_jobs(
        self, *, from_seq: int = 0, progress: bool = False, timeout: float | None = None, patience: float = 60
    ) -> AsyncIterator[JobEvent]:
        """As heliograph.Client.watch_jobs, for `async for`."""
        feed = WatchFeed(from_seq=from_seq, progress=progress, timeout=timeout, patience=patience)
        return _watch(self._connection, feed)

    async def close(self) -> None:
        """As heliograph.Client.close."""
        try:
            for opened in list(self._open):
                await opened.close()
        finally:
            await self._connection.close()
            if self.daemon is not None:
                await asyncio.to_thread(self.daemon.stop)

    async def __aenter__(self) -> Client:
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    def __repr__(self) -> str:
        return f"<heliograph.aio.Client {self.address}, heliographd {self._first_info.version}>"


async def connect(
    address: str,
    *,
    token: str | None = None,
    token_file: str | os.PathLike[str] | None = None,
    tls: bool | None = None,
    ca: str | os.PathLike[str] | None = None,
    certificate: str | os.PathLike[str] | None = None,
    key: str | os.PathLike[str] | None = None,
    tls_name: str | None = None,
    wait: float = 0,
    timeout: float = 30,
) -> Client:
    """As heliograph.connect."""
    check_address(address)
    secret = read_token(token, token_file)
    encryption = read_tls(tls, ca, certificate, key, tls_name)
    connection = _Connection(address, secret, read_timeout("timeout", timeout), encryption)
    try:
        info = make_server_info(await connection.greet(read_timeout("wait", wait, zero=True)))
    except BaseException:
        await connection.close()
        raise
    return Client(connection, info)


async def serve(
    program: str | os.PathLike[str] | None = None,
    *,
    scene_roots: str | os.PathLike[str] | Iterable[str | os.PathLike[str]] = (),
    threads: int | None = None,
    drain_grace: float = 1.0,
    state: str | os.PathLike[str] | None = None,
    arguments: Sequence[str] = (),
    timeout: float = 30,
) -> Client:
    """As heliograph.serve."""
    daemon = await asyncio.to_thread(
        Daemon,
        program,
        scene_roots=scene_roots,
        threads=threads,
        drain_grace=drain_grace,
        state=state,
        arguments=arguments,
        timeout=timeout,
    )
    try:
        client = await connect(daemon.address, token=daemon.token, tls=False, wait=timeout)
    except BaseException:
        await asyncio.to_thread(daemon.stop)
        raise
    client.daemon = daemon
    return client


async def compare(
    scene: SceneLike,
    modes: Modes,
    *,
    address: str | None = None,
    token: str | None = None,
    token_file: str | os.PathLike[str] | None = None,
    tls: bool | None = None,
    ca: str | os.PathLike[str] | None = None,
    certificate: str | os.PathLike[str] | None = None,
    key: str | os.PathLike[str] | None = None,
    tls_name: str | None = None,
    **arguments: Unpack[CompareArguments],
) -> Comparison:
    """As heliograph.compare."""
    if isinstance(scene, Scene):
        if address is not None:
            raise invalid("address", address, "none beside a Scene, whose daemon is asked")
        return await scene.compare(modes, **arguments)
    modes = listed(modes)
    for name, value in arguments.items():
        arguments[name] = listed(value)  # type: ignore[literal-required]
    if isinstance(scene, (str, os.PathLike)):
        await asyncio.to_thread(check_compare, scene, modes, arguments)
    if address is not None:
        async with await connect(
            address,
            token=token,
            token_file=token_file,
            tls=tls,
            ca=ca,
            certificate=certificate,
            key=key,
            tls_name=tls_name,
        ) as client:
            return await client.compare(scene, modes, **arguments)
    exclusive = ["--allow-exclusive", "on"] if arguments.get("exclusive") else []
    async with await serve(arguments=exclusive) as client:
        return await client.compare(scene, modes, **arguments)
