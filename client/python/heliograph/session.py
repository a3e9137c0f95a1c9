"""Interactive sessions over blocking gRPC."""

from __future__ import annotations

import contextlib
import os
import threading
import time
import weakref
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import grpc

from . import operations
from .connection import Connection
from .edits import Changes
from .errors import Cancelled, DeadlineExceeded, HeliographError, Internal, from_rpc
from .frames import Frame
from .image import Image
from .outbox import Outbox
from .session_core import SessionCore, SessionMethods
from .settings import read_timeout

if TYPE_CHECKING:
    from .client import Scene

_CLOSE_S = 10.0  # that the daemon gets to end a session


class Session(SessionMethods):
    """A film on the daemon with camera, settings and budget, which renders until the budget is reached.

    Use it as a context manager; one that is forgotten is closed when it is collected. Thread safe.
    """

    def __init__(self, client: Any, connection: Connection, core: SessionCore) -> None:
        self._client = client
        self._core = core
        self._calls = [connection.open("StreamFrames", _requests(core, core.outbox))]  # the last one is open
        self._thread = threading.Thread(
            target=_read, args=(core, connection, self._calls), name="heliograph-session", daemon=True
        )
        self._thread.start()
        self._finalizer = weakref.finalize(self, _abandon, core, os.getpid())
        self._connection = connection

    @property
    def scene(self) -> Scene:
        """The scene that is rendered. Assign another to switch; modes that reuse pictures keep what an edit left
        true."""
        scene: Scene = self._core.scene  # type: ignore[assignment]
        return scene

    @scene.setter
    def scene(self, scene: Scene) -> None:
        self._switch(scene)

    # ---- waiting

    def frames(self, *, buffer: int | None = None, timeout: float | None = None) -> Iterator[Frame]:
        """Events as they come, until the session is closed: film, preview, end (heliograph.Frame).

        buffer: 0: the newest of each kind alone, so that a slow loop sees the present state; n in [1, 1024]: up to n
        events are kept, then the oldest are dropped; None: as it was (0 at first). timeout: seconds without an event
        after which DeadlineExceeded is raised; None: none. A change that the daemon refused is raised once, and what
        ended the stream whenever it is asked.

        With buffer 0, a change of camera, settings, budget or scene drops what waits of the views before it, and ends
        of these are not told; a picture of the view before may come still (Frame.view, Session.view).
        """
        if timeout is not None:
            timeout = read_timeout("timeout", timeout, zero=True)
        if buffer is not None:
            with self._core.lock:
                self._core.buffer.resize(buffer)
        return self._iterate(timeout)

    def _iterate(self, timeout: float | None) -> Iterator[Frame]:
        core = self._core
        while True:
            self._connection.check_process()
            with core.lock:
                end = None if timeout is None else time.monotonic() + timeout
                while True:
                    core.check_refused()
                    if len(core.buffer):
                        break
                    if core.error is not None:
                        raise core.error.again()
                    if core.over or core.closing:
                        return
                    left = None if end is None else end - time.monotonic()
                    if left is not None and left <= 0:
                        raise DeadlineExceeded(f"no event within {timeout:g} s", problems=())
                    core.changed.wait(left)
                event = core.next_event()
            if event is not None:
                yield event

    def wait(
        self,
        *,
        error: float | None = None,
        samples: int | None = None,
        seconds: float | None = None,
        timeout: float | None = None,
    ) -> Image:
        """The picture of the present view, once it is done.

        error, samples, seconds: the budget from now on, as of Error, Samples and Seconds, the first to be reached;
        without any the one that the session has. A picture that is beyond it when it reaches the daemon ends as it is:
        one that began without `until` may have more samples, in all pixels or in some. timeout: seconds to wait at
        most, then DeadlineExceeded; the render goes on.
        InvalidArgument: no budget at all, or a change that the daemon refused before, which is told once: the session
        goes on with what it had. RenderFailed. Whatever ended the stream is raised, too.
        """
        self._connection.check_process()
        end = None if timeout is None else time.monotonic() + read_timeout("timeout", timeout, zero=True)
        core = self._core
        view = core.begin_wait(error=error, samples=samples, seconds=seconds)
        with core.lock:
            while (frame := core.awaited(view)) is None:
                left = None if end is None else end - time.monotonic()
                if left is not None and left <= 0:
                    raise DeadlineExceeded(f"the picture was not done within {timeout:g} s", problems=())
                core.changed.wait(left)
        return frame.image

    # ---- edits and the end

    def edit(
        self,
        *,
        materials: Changes | None = None,
        lights: Changes | None = None,
        objects: Changes | None = None,
        environment: dict[str, Any] | None = None,
    ) -> None:
        """Edits the scene, as Client.edit, and shows the edited one in this session."""
        self._core.check()
        self.scene = self._client.edit(
            self.scene, materials=materials, lights=lights, objects=objects, environment=environment
        )

    def close(self) -> None:
        """Ends the session on the daemon. May be called again."""
        if self._finalizer.detach() is None or not self._connection.is_own:
            return
        self._core.close()
        if threading.current_thread() is self._thread:
            return
        try:
            self._thread.join(_CLOSE_S)
        finally:
            if self._thread.is_alive():  # the daemon does not answer, or Ctrl-C
                self._calls[-1].cancel()
        self._thread.join(_CLOSE_S)
        if self._core.left_behind:
            with contextlib.suppress(HeliographError):
                self._connection.run(operations.close_session(self.id))

    def __enter__(self) -> Session:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


# The threads of a session refer to its core, never to the session, so that one that is forgotten can be collected.


def _requests(core: SessionCore, outbox: Outbox) -> Iterator[Any]:
    while True:
        with core.lock:
            while not len(outbox):
                if outbox.ended:
                    return
                core.changed.wait()
            request = outbox.take()
        yield request


def _read(core: SessionCore, connection: Connection, calls: list[Any]) -> None:
    failure = _receive(core, connection, calls[-1])
    while core.resume(failure) or _wait_for_daemon(core, connection, failure):
        try:
            calls[:] = [connection.open("StreamFrames", _requests(core, core.outbox))]
        except HeliographError as error:  # closed meanwhile
            failure = error
            break
        failure = _receive(core, connection, calls[-1])
    core.finish(core.gone(failure))


def _wait_for_daemon(core: SessionCore, connection: Connection, failure: HeliographError | None) -> bool:
    """Whether the session is to be attached again, now."""
    pause = core.reattach(failure)
    if pause is None:
        return False
    with core.lock:
        core.changed.wait_for(lambda: core.closing, pause)
    if not core.closing:
        with contextlib.suppress(HeliographError):  # closed meanwhile
            connection.reach(core.reach_s())
    return not core.closing


def _receive(core: SessionCore, connection: Connection, call: Any) -> HeliographError | None:
    """All answers; what ended them, None: they ended well."""
    failure: HeliographError | None = None
    try:
        for response in call:
            core.receive(response)
    except grpc.RpcError as error:
        failure = from_rpc(error, connection.peer)
        if isinstance(failure, Cancelled) and core.closing:
            failure = None
    except HeliographError as error:
        failure = error
        call.cancel()
    except Exception as error:  # a fault of this package must reach whoever waits
        failure = Internal(f"{type(error).__name__}: {error}", problems=())
        call.cancel()
    return failure


def _abandon(core: SessionCore, process: int) -> None:
    if os.getpid() == process:
        core.close()
