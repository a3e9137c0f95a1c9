"""Jobs that the daemon keeps, over blocking gRPC."""

from __future__ import annotations

import contextlib
import os
import pathlib
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from typing import Any, TypeVar

import grpc

from . import operations
from .connection import Connection
from .errors import HeliographError, from_rpc
from .files import AtomicFile
from .image import Image
from .kept_jobs import (
    JobEvent,
    JobInfo,
    JobResult,
    KeptJobValues,
    PictureFeed,
    ResultFeed,
    WatchFeed,
    check_going_on,
    image_of_result,
    result_request,
    tiles_request,
)
from .progress import Progress, Reporter
from .reattachment import LONGEST_PAUSE_S, Reattachment
from .settings import Channel, PixelType, read_timeout
from .v1 import durable_job_pb2 as messages

T = TypeVar("T")


class KeptJob(KeptJobValues):
    """A job that the daemon keeps: it outlives this object, the program and, with the same state folder, the daemon.

    Made by Client.enqueue, Client.job and Client.jobs. Properties tell it as it was heard of last; info() asks. Nothing
    needs to be closed. Thread safe.
    """

    def __init__(
        self, connection: Connection, info: JobInfo, submitted: messages.SubmitJobResponse | None = None
    ) -> None:
        super().__init__(info, submitted)
        self._connection = connection

    def info(self) -> JobInfo:
        """Asks the daemon. NotFound: it keeps the job no more."""
        return self._hear(self._connection.run(operations.job_info(self.id)))

    def watch(
        self, *, from_seq: int = 1, progress: bool = True, timeout: float | None = None, patience: float = 60
    ) -> Iterator[JobEvent]:
        """Every change of its state, in order, until its end; and with `progress` how far it is, some four times a second
        while it runs.

        from_seq: the first event to tell, 1: all since it was submitted, 0: from now on; JobEvent.seq + 1 goes on where
        another watch ended. A lost connection, or a daemon that restarts at the same address, loses no event: the watch
        keeps trying for `patience` seconds, [0, 86400]. timeout: seconds for all of it, then DeadlineExceeded.

        Unavailable: no daemon answered for so long. NotFound: it keeps the job no more.
        """
        return self._watch(WatchFeed(self.id, from_seq=from_seq, progress=progress, timeout=timeout, patience=patience))

    def _watch(self, feed: WatchFeed) -> Iterator[JobEvent]:
        with contextlib.closing(watch(self._connection, feed)) as events:
            for event in events:
                if feed.job is not None:
                    self._hear(feed.job)
                yield event

    def wait(
        self,
        timeout: float | None = None,
        *,
        through_pauses: bool = False,
        progress: Progress = False,
        patience: float = 60,
    ) -> JobInfo:
        """Waits until the job has succeeded, and answers it with its results.

        timeout: seconds, then DeadlineExceeded; the job goes on. through_pauses: also waits while the job is paused.
        progress: True: a bar by tqdm, where that is installed; or a function that takes Stats. patience: as of watch().

        RenderFailed, Cancelled: it came to another end. FailedPrecondition: it is paused; the message has the reason.
        """
        feed = WatchFeed(
            self.id,
            progress=progress is not False,
            timeout=timeout,
            patience=patience,
            late="the job was not done",
        )
        with Reporter(progress) as reporter, contextlib.closing(watch(self._connection, feed, begins=True)) as events:
            for event in events:
                if feed.job is None:
                    continue
                self._hear(feed.job)
                if event is not None and event.info is not None:
                    reporter.update(event.info.stats)
                if check_going_on(feed.job, through_pauses):
                    break
        return self.info()

    def pause(self) -> JobInfo:
        """Has it wait until resume(). A running one stops at a checkpoint, which is taken at once: target_state is
        "paused" until then. FailedPrecondition: not from its present state."""
        return self._hear(self._connection.run(operations.pause_job(self.id)))

    def resume(self) -> JobInfo:
        """Puts it back into the queue. FailedPrecondition: it is not paused."""
        return self._hear(self._connection.run(operations.resume_job(self.id)))

    def cancel(self) -> JobInfo:
        """Ends it. A running one stops once the piece in hand is done: target_state is "canceled" until then.
        FailedPrecondition: it has come to its end already."""
        return self._hear(self._connection.run(operations.cancel_kept_job(self.id)))

    def set_priority(self, priority: int) -> JobInfo:
        """[-100, 100]; higher first. FailedPrecondition: it has come to its end already."""
        return self._hear(self._connection.run(operations.set_job_priority(self.id, priority)))

    def fetch(self, view: int = 0, *, patience: float = 60) -> Image:
        """The picture of a view, by index, with its figures in `stats`. Bytes and SHA-256 are checked. A connection
        that is lost on the way is tried again, from the file's beginning, for `patience` seconds, [0, 86400].

        FailedPrecondition: the view is not done. NotFound: no such view, or its file is gone. Internal: the file is not
        the one that was rendered.
        """

        def attempt() -> tuple[JobResult, bytes]:
            chunks: list[bytes] = []
            result = self._fetch(view, chunks.append)
            return result, b"".join(chunks)

        result, data = self._again(attempt, patience)
        return image_of_result(data, result, self.latest, self.notices)

    def fetch_to(self, path: str | os.PathLike[str], view: int = 0, *, patience: float = 60) -> pathlib.Path:
        """Writes the EXR file of a view as the daemon has it, in one step (temporary file, then rename), and answers
        its path; a file that is there is replaced. Checks and errors as of fetch(). InvalidArgument: the name does not
        end in .exr. OSError: it cannot be written; then, too, nothing is left of it.
        """

        def attempt() -> pathlib.Path:
            with AtomicFile(path, ".exr") as file:
                self._fetch(view, file.write)
                return file.commit()

        return self._again(attempt, patience)

    def picture(
        self,
        view: int = 0,
        *,
        window: Sequence[int] | None = None,
        channels: Channel | Iterable[Channel] = (),
        pixel_type: PixelType = "float",
    ) -> Image:
        """The picture of a view as it is, without its file: of one that is done, or of the one in hand as the newest
        checkpoint of the job has it. A running job's checkpoint that is older than 2 s is made anew for the next call.

        window: (x0, y0, x1, y1), pixels of the film, the last ones excluded; None: all that is rendered; the picture
        then has that window. channels: beside radiance, variance and samples, as of Client.render, as far as the
        picture has them.
        FailedPrecondition: nothing is rendered yet, or its mode has no checkpoints. InvalidArgument: the window.
        """
        request = tiles_request(self.id, view, window, channels, pixel_type)
        feed = PictureFeed(request, self.latest)
        call = self._connection.open("GetResult", request, self._connection.timeout)
        try:
            for response in call:
                feed.add(response)
        except grpc.RpcError as error:
            raise operations.of_kept_jobs(from_rpc(error, self._connection.peer)) from None
        except BaseException:
            call.cancel()
            raise
        return feed.image(self.latest, self.notices)

    def _again(self, attempt: Callable[[], T], patience: float) -> T:
        """What attempt() answers, tried again after a lost connection."""
        waits = Reattachment(read_timeout("patience", patience, zero=True), planned=False)
        while True:
            try:
                return attempt()
            except HeliographError as error:
                pause = waits.pause(error)
                if pause is None:
                    raise
            time.sleep(pause)
            self._connection.reach(min(LONGEST_PAUSE_S, waits.left()))

    def _fetch(self, view: int, write: Callable[[bytes], object]) -> JobResult:
        request = result_request(self.id, view)
        feed = ResultFeed(self.id, request.view)
        call = self._connection.open("GetResult", request)
        try:
            for response in call:
                chunk = feed.add(response)
                if chunk:
                    write(chunk)
        except grpc.RpcError as error:
            raise operations.of_kept_jobs(from_rpc(error, self._connection.peer)) from None
        except BaseException:
            call.cancel()
            raise
        return feed.finish()


def watch(connection: Connection, feed: WatchFeed, begins: bool = False) -> Generator[Any, None, None]:
    """Events. begins: None, too, whenever the job itself was told (feed.job)."""
    while True:
        call = connection.open("WatchJob", feed.request(), feed.seconds_left())
        try:
            for response in call:
                event = feed.add(response)
                if event is not None or (begins and response.WhichOneof("response") == "watching"):
                    yield event
            feed.check_over()
            return
        except grpc.RpcError as error:
            failure = operations.of_kept_jobs(from_rpc(error, connection.peer))
        finally:
            call.cancel()
        time.sleep(feed.failed(failure))
        connection.reach(feed.reach_s())
