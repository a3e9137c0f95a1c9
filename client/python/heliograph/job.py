"""Jobs over blocking gRPC."""

from __future__ import annotations

import contextlib
import os
import threading
import time
import weakref
from collections.abc import Iterator
from typing import Any

import grpc

from . import operations
from .connection import Connection
from .errors import BrokenTile, DeadlineExceeded, FailedPrecondition, HeliographError, Internal, NotFound, from_rpc
from .image import Image
from .jobs import JobState, image_of
from .settings import read_timeout
from .stats import Stats


class Job:
    """A still or a camera path that the daemon renders while the program does other things.

    It lives as long as this object: close() cancels it, and so does the collector. Pictures of a path that nobody takes
    hold the daemon back after two. Thread safe.
    """

    def __init__(self, connection: Connection, request: Any, views: int) -> None:
        self.views = views  # pictures that it makes
        self._connection = connection
        self._state = JobState(views)
        self._changed = threading.Condition()
        self._call = connection.open("RunJob", request)
        self._thread = threading.Thread(
            target=_read, args=(self._state, self._changed, connection, self._call), name="heliograph-job", daemon=True
        )
        self._thread.start()
        self._finalizer = weakref.finalize(self, _abandon, self._call, self._state, self._changed, os.getpid())
        with self._changed:
            self._changed.wait_for(lambda: self._state.begun)
            if self._state.error is not None:
                raise self._state.error.again()

    @property
    def id(self) -> str:
        """The daemon's name of it."""
        return self._state.id

    @property
    def stats(self) -> Stats:
        """Figures of the view in hand."""
        with self._changed:
            return self._state.stats

    @property
    def done(self) -> bool:
        """Nothing more will come from the daemon."""
        with self._changed:
            return self._state.over

    def result(self, timeout: float | None = None) -> Image:
        """The picture of a still; again the same at another call. timeout: seconds, then DeadlineExceeded.

        FailedPrecondition: the job has several views (use images()). RenderFailed, Cancelled, or what ended the call.
        """
        if self.views != 1:
            raise FailedPrecondition(f"this job has {self.views} views: iterate images()", problems=())
        self._await(lambda: self._state.over, timeout)
        with self._changed:
            if self._state.newest is None and self._state.error is not None:
                raise self._state.error.again()
            return image_of(self._state.newest)

    def images(self, timeout: float | None = None) -> Iterator[Image]:
        """The pictures in the order of the views, each as soon as it is done. timeout: seconds for each."""
        while True:
            self._await(lambda: bool(self._state.done) or self._state.over, timeout)
            with self._changed:
                if not self._state.done:
                    if self._state.error is not None:
                        raise self._state.error.again()
                    return
                frame = self._state.done.popleft()
                self._changed.notify_all()
            yield frame.image

    def _await(self, condition: Any, timeout: float | None) -> None:
        self._connection.check_process()
        end = None if timeout is None else time.monotonic() + read_timeout("timeout", timeout, zero=True)
        with self._changed:
            while not condition():
                left = None if end is None else end - time.monotonic()
                if left is not None and left <= 0:
                    raise DeadlineExceeded(f"the job was not done within {timeout:g} s", problems=())
                self._changed.wait(left)

    def cancel(self) -> None:
        """Ends the job; result() then answers what was rendered, if all of the picture was, or raises Cancelled.

        images() gives the pictures of a path that wait, then raises Cancelled. Nothing happens where the job is done.
        """
        self._connection.check_process()
        with self._changed:
            if self._state.over:
                return
            self._state.cancelled = True
            self._changed.notify_all()
        with contextlib.suppress(NotFound):  # the daemon has finished, and the rest is on its way
            self._connection.run(operations.cancel_job(self.id))

    def close(self) -> None:
        """Cancels the call, if it goes on, and ends the thread. May be called again."""
        if self._finalizer.alive and self._connection.is_own:
            self._finalizer()
            if threading.current_thread() is not self._thread:
                self._thread.join(10)

    def __enter__(self) -> Job:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<heliograph.Job {self.id}, {self.views} views, {'done' if self.done else 'running'}>"


def _read(state: JobState, changed: threading.Condition, connection: Connection, call: Any) -> None:
    failure: HeliographError | None = None
    try:
        for response in call:
            with changed:
                state.add(response)
                changed.notify_all()
                changed.wait_for(lambda: not state.full or state.over or state.feed.over)
                if state.over:
                    break
    except grpc.RpcError as error:
        failure = from_rpc(error, connection.peer)
    except HeliographError as error:
        failure = error
        if isinstance(error, BrokenTile):
            call.cancel()
    except Exception as error:  # a fault of this package must reach whoever waits
        failure = Internal(f"{type(error).__name__}: {error}", problems=())
        call.cancel()
    with changed:
        state.finish(failure)
        changed.notify_all()


def _abandon(call: Any, state: JobState, changed: threading.Condition, process: int) -> None:
    if os.getpid() != process:
        return
    call.cancel()
    with changed:
        if not state.over:
            from .errors import Cancelled

            state.finish(Cancelled("the job was closed", problems=()))
        changed.notify_all()
