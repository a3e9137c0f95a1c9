"""Jobs that the daemon keeps: values, requests, and what the streams of WatchJob and GetResult say. No input or output
happens here: heliograph.kept_job and heliograph.aio feed it."""

from __future__ import annotations

import dataclasses
import hashlib
import operator
import os
import time
from collections.abc import Iterable, Sequence
from typing import Any, Literal, Union, get_args

from .budget import Error, Limit, Samples, Seconds
from .errors import (
    Cancelled,
    DeadlineExceeded,
    FailedPrecondition,
    HeliographError,
    Internal,
    Problem,
    RenderFailed,
    Unavailable,
    invalid,
    invalid_all,
)
from .image import Image, image_of_exr
from .settings import Channel, PixelType, enum_name, make_format, read_timeout
from .stats import Stats, make_stats
from .tiles import Assembly
from .v1 import durable_job_pb2 as messages
from .v1 import job_pb2 as jobs
from .v1 import types_pb2 as types

#: Nothing follows the last three.
State = Literal["queued", "running", "paused", "succeeded", "failed", "canceled"]
STATES: tuple[State, ...] = get_args(State)
FINAL: tuple[State, ...] = ("succeeded", "failed", "canceled")
#: One word, or several; None: all.
States = Union[State, Iterable[State], None]

_MOST_PRIORITY = 100
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 0.1, 2.0  # between tries to reach a daemon that went away


@dataclasses.dataclass(frozen=True)
class JobResult:
    """A finished view of a job."""

    view: int  # index
    stats: Stats
    file: str  # where the daemon wrote it; empty: it keeps it for fetch()
    bytes: int  # of the EXR file
    sha256: str  # of the EXR file, hexadecimal


@dataclasses.dataclass(frozen=True)
class TimeLeft:
    """Until the end of a running job, if the machine stays as busy as it is."""

    seconds: float
    low: float  # seconds; the end lies in [low, high] for four of five jobs
    high: float


@dataclasses.dataclass(frozen=True)
class JobInfo:
    """A job that the daemon keeps, at one moment. Times are Unix seconds, None: not yet."""

    id: str
    name: str  # for people
    scene_id: str
    state: State
    target_state: State  # of a running job that was asked to pause or cancel; else "succeeded", or the end that it has
    reason: str  # of the newest change of its state; empty: none
    attempt: int  # times that it has begun to run
    priority: int  # [-100, 100], higher first
    views: int  # pictures that it makes
    views_done: int
    stats: Stats  # of the view in hand, or of the newest one that was rendered since the daemon began
    left: TimeLeft | None  # None: not known, as before 16 samples per pixel
    same_bits: bool  # False: attempts ran on different builds, and the last bits may differ from an uninterrupted run's
    require_same_bits: bool
    size: tuple[int, int]  # of the film, pixels
    until: tuple[Limit, ...]  # budget of each view
    output: str  # file on the daemon's machine; empty: the daemon keeps the pictures for fetch()
    overwrite: bool
    owner: str  # who submitted it, where callers have names
    submitted: float
    started: float | None
    ended: float | None
    checkpoint: float | None  # of the newest checkpoint since the daemon began
    updated_seq: int  # number of its newest event
    results: tuple[JobResult, ...]  # by view; of KeptJob.info() and Client.job() alone
    message: messages.Job = dataclasses.field(repr=False)  # the protocol's, with all settings

    @property
    def done(self) -> bool:
        """It has come to its end: "succeeded", "failed" or "canceled"."""
        return self.state in FINAL


@dataclasses.dataclass(frozen=True)
class JobEvent:
    """What watch() tells.

    kind: "state": the job went from `before` to `state`; "progress": it goes on, and `info` has the figures.
    """

    kind: Literal["state", "progress"]
    job_id: str
    state: State
    before: str  # empty: it was submitted
    reason: str
    by: str  # who asked for the change; empty: the daemon itself
    attempt: int
    time: float  # Unix seconds, 0 of progress
    seq: int  # counts the events of the daemon's state folder, from 1; 0 of progress
    info: JobInfo | None  # of progress alone


def _state_of(number: int) -> State:
    word: State = enum_name(messages.JobState.DESCRIPTOR, number)  # type: ignore[assignment]
    return word


def _result_of(view: messages.JobView) -> JobResult:
    return JobResult(view.view, make_stats(view.end.totals, view.end), view.file, view.bytes, view.sha256)


def _limits_of(budget: types.Budget) -> tuple[Limit, ...]:
    limits: list[Limit] = []
    if budget.error > 0:
        limits.append(Error(budget.error))
    if budget.samples > 0:
        limits.append(Samples(budget.samples))
    if budget.time_s > 0:
        limits.append(Seconds(budget.time_s))
    return tuple(limits)


def make_job_info(job: messages.Job) -> JobInfo:
    return JobInfo(
        id=job.job_id,
        name=job.name,
        scene_id=job.scene_id,
        state=_state_of(job.state),
        target_state=_state_of(job.target_state),
        reason=job.reason,
        attempt=job.attempt,
        priority=job.priority,
        views=job.views,
        views_done=job.views_done,
        stats=make_stats(job.progress) if job.HasField("progress") else Stats(),
        left=TimeLeft(job.left.seconds, job.left.low_s, job.left.high_s) if job.HasField("left") else None,
        same_bits=job.same_bits,
        require_same_bits=job.require_same_bits,
        size=(job.settings.width, job.settings.height),
        until=_limits_of(job.budget),
        output=job.output.path,
        overwrite=job.output.overwrite,
        owner=job.owner,
        submitted=job.submitted_s,
        started=job.started_s or None,
        ended=job.ended_s or None,
        checkpoint=job.checkpoint_s or None,
        updated_seq=job.updated_seq,
        results=tuple(_result_of(view) for view in job.results),
        message=job,
    )


def _make_event(event: messages.JobEvent) -> JobEvent:
    before = getattr(event, "from")
    return JobEvent(
        "state",
        event.job_id,
        _state_of(event.to),
        _state_of(before) if before else "",
        event.reason,
        event.by,
        event.attempt,
        event.time_s,
        event.seq,
        None,
    )


def _make_progress(job: messages.Job) -> JobEvent:
    info = make_job_info(job)
    return JobEvent("progress", info.id, info.state, info.state, info.reason, "", info.attempt, 0, 0, info)


# ---- requests


def _is_text(value: Any) -> bool:
    """Without control characters, and such that UTF-8 can carry it."""
    if not isinstance(value, str) or any(character < " " or character == "\x7f" for character in value):
        return False
    return not any("\ud800" <= character <= "\udfff" for character in value)


def _text(name: str, value: Any, problems: list[Problem]) -> str:
    if _is_text(value):
        return str(value)
    problems.append(Problem(name, repr(value), "text without control characters"))
    return ""


def read_priority(priority: Any) -> int:
    """InvalidArgument: not a whole number in [-100, 100]."""
    try:
        number = operator.index(priority)
        if isinstance(priority, bool) or abs(number) > _MOST_PRIORITY:
            raise ValueError
    except (TypeError, ValueError):
        raise invalid("priority", priority, f"whole numbers in [-{_MOST_PRIORITY}, {_MOST_PRIORITY}]") from None
    return number


def submit_request(
    job: jobs.RunJobRequest,
    *,
    name: str,
    priority: int,
    client_token: str,
    output: str | os.PathLike[str] | None,
    overwrite: bool,
    require_same_bits: bool,
) -> messages.SubmitJobRequest:
    """InvalidArgument: what is no text, number or flag, all at once; the daemon checks lengths and paths."""
    problems: list[Problem] = []
    request = messages.SubmitJobRequest(
        name=_text("name", name, problems), client_token=_text("client_token", client_token, problems)
    )
    request.job.CopyFrom(job)
    try:
        request.priority = read_priority(priority)
    except HeliographError as error:
        problems += error.problems
    for flag, value in (("overwrite", overwrite), ("require_same_bits", require_same_bits)):
        if not isinstance(value, bool):
            problems.append(Problem(flag, repr(value), "True or False"))
    if output is not None:
        path = os.fspath(output) if isinstance(output, (str, os.PathLike)) else output
        request.output.path = _text("output", path, problems)
        request.output.overwrite = overwrite is True
    elif overwrite is True:
        problems.append(Problem("overwrite", "True", "False without output"))
    if problems:
        raise invalid_all(problems)
    request.require_same_bits = require_same_bits
    return request


def read_states(states: States) -> list[int]:
    """The protocol's numbers. InvalidArgument: other words."""
    if states is None:
        return []
    words = [states] if isinstance(states, str) else states
    allowed = ", ".join(repr(state) for state in STATES)
    try:
        chosen = list(words)
    except TypeError:
        raise invalid("states", states, f"{allowed}, several of them, or None for all") from None
    wrong = [Problem("states", repr(word), allowed) for word in chosen if word not in STATES]
    if wrong:
        raise invalid_all(wrong)
    if not chosen:
        raise invalid("states", "[]", f"{allowed}, several of them, or None for all")
    return [messages.JobState.Value(f"JOB_STATE_{word.upper()}") for word in chosen]


def check_job_id(job_id: Any) -> str:
    """InvalidArgument: no text, or empty."""
    if not _is_text(job_id) or not job_id:
        raise invalid("job_id", job_id, "the id of a job that enqueue() or jobs() answered")
    return str(job_id)


def result_request(job_id: str, view: Any) -> messages.GetResultRequest:
    """InvalidArgument: no index."""
    try:
        index = operator.index(view)
        if isinstance(view, bool) or not 0 <= index < 2**32:
            raise ValueError
    except (TypeError, ValueError):
        raise invalid("view", view, "a view's index, from 0 on") from None
    return messages.GetResultRequest(job_id=job_id, view=index)


def tiles_request(
    job_id: str,
    view: Any,
    window: Sequence[int] | None,
    channels: Channel | Iterable[Channel],
    pixel_type: PixelType,
) -> messages.GetResultRequest:
    """InvalidArgument: no index, no window of whole numbers, or unknown words."""
    request = result_request(job_id, view)
    request.tiles.format.CopyFrom(make_format(channels, pixel_type, "zip", None))
    if window is not None:
        try:
            x0, y0, x1, y1 = (operator.index(number) for number in window)
            request.tiles.window.CopyFrom(types.Rect(x0=x0, y0=y0, x1=x1, y1=y1))
        except (TypeError, ValueError):
            raise invalid("window", window, "(x0, y0, x1, y1), whole pixels of the film") from None
    return request


# ---- streams


class WatchFeed:
    """One watch, over as many calls of WatchJob as it takes: after a lost connection the next call goes on with the
    event behind the last one, so that none is lost or told twice. Not thread safe.

    job_id: empty: all jobs. from_seq: the first event to tell, 0: from now on. patience: seconds to keep trying while no
    daemon answers. timeout: seconds for all of it, None: no end; `late`: what is told then.
    """

    def __init__(
        self,
        job_id: str = "",
        *,
        from_seq: int = 0,
        progress: bool = False,
        patience: float = 60,
        timeout: float | None = None,
        late: str = "the watch was not over",
    ) -> None:
        try:
            self._next = operator.index(from_seq)
            if isinstance(from_seq, bool) or not 0 <= self._next < 2**64:
                raise ValueError
        except (TypeError, ValueError):
            raise invalid("from_seq", from_seq, "an event's number, or 0 for from now on") from None
        if not isinstance(progress, bool):
            raise invalid("progress", progress, "True or False")
        self.job: JobInfo | None = None  # of a watch of one job, as it is now
        self._job_id = job_id
        self._progress = progress
        self._patience = read_timeout("patience", patience, zero=True)
        self._timeout = None if timeout is None else read_timeout("timeout", timeout, zero=True)
        self._late = late
        self._begun = time.monotonic()
        self._lost_at: float | None = None  # when the connection was lost; None: answers come
        self._pause = _FIRST_PAUSE_S

    def request(self) -> messages.WatchJobRequest:
        """What the next call asks."""
        return messages.WatchJobRequest(job_id=self._job_id, from_seq=self._next, progress=self._progress)

    def seconds_left(self) -> float | None:
        """Of the timeout, for the next call; None: there is none. DeadlineExceeded: it has passed."""
        if self._timeout is None:
            return None
        left = self._timeout - (time.monotonic() - self._begun)
        if left <= 0:
            raise self._too_late()
        return left

    def _too_late(self) -> DeadlineExceeded:
        return DeadlineExceeded(f"{self._late} within {self._timeout:g} s", problems=())

    def add(self, response: messages.WatchJobResponse) -> JobEvent | None:
        """An answer; what is to be told of it."""
        self._lost_at, self._pause = None, _FIRST_PAUSE_S
        kind = response.WhichOneof("response")
        if kind == "watching":
            if self._next == 0:
                self._next = response.watching.next_seq
            if response.watching.HasField("job"):
                self.job = make_job_info(response.watching.job)
        elif kind == "event":
            return self._add_event(_make_event(response.event))
        elif kind == "progress":
            event = _make_progress(response.progress)
            if self._job_id and event.info is not None:
                if self.job is not None and event.info.updated_seq < self.job.updated_seq:
                    return None  # older than what was told already
                self.job = event.info
            return event
        return None

    def _add_event(self, event: JobEvent) -> JobEvent | None:
        if event.seq < self._next:
            return None
        self._next = event.seq + 1
        # The job that the watch began with may be newer than the events that follow.
        if self.job is not None and event.seq > self.job.updated_seq:
            target: State = event.state if event.state in FINAL else "succeeded"
            self.job = dataclasses.replace(
                self.job,
                state=event.state,
                target_state=target,
                reason=event.reason,
                attempt=event.attempt,
                updated_seq=event.seq,
            )
        return event

    def failed(self, error: HeliographError) -> float:
        """A call ended by `error`: seconds to wait before the next one. Raises what ends the watch."""
        if isinstance(error, DeadlineExceeded) and self._timeout is not None:
            raise self._too_late() from None
        # A daemon that goes away cancels its streams or breaks the connection.
        if not isinstance(error, (Unavailable, Cancelled)):
            raise error
        now = time.monotonic()
        if self._lost_at is None:
            self._lost_at = now
        left = self._patience - (now - self._lost_at)
        if left <= 0:
            raise error
        pause = min(self._pause, left)
        self._pause = min(2 * self._pause, _LONGEST_PAUSE_S)
        until_late = self.seconds_left()
        return pause if until_late is None else min(pause, until_late)

    def reach_s(self) -> float:
        """After failed(): seconds that the daemon may take to come back."""
        lost_at = self._begun if self._lost_at is None else self._lost_at
        left = max(0.0, self._patience - (time.monotonic() - lost_at))
        until_late = self.seconds_left()
        return left if until_late is None else min(left, until_late)

    def check_over(self) -> None:
        """A call ended well. Internal: the job has not come to its end."""
        if self.job is None or not self.job.done:
            raise Internal("the daemon ended a watch before the job had come to its end", problems=())


def check_going_on(info: JobInfo, through_pauses: bool) -> bool:
    """For those who wait: whether the job has succeeded. RenderFailed, Cancelled: it has come to another end.
    FailedPrecondition: it is paused, and nobody waits through that."""
    why = f": {info.reason}" if info.reason else ""
    if info.state == "failed":
        raise RenderFailed(f"the job failed{why}", problems=())
    if info.state == "canceled":
        raise Cancelled(f"the job was cancelled{why}", problems=())
    if info.state == "paused" and not through_pauses:
        raise FailedPrecondition(f"the job is paused{why}; resume() has it go on", problems=())
    return info.state == "succeeded"


class ResultFeed:
    """The file of a view, chunk by chunk. Not thread safe."""

    def __init__(self, job_id: str, view: int) -> None:
        self._what = f"the file of view {view} of job {job_id}"
        self._begin: messages.JobView | None = None
        self._bytes = 0
        self._digest = hashlib.sha256()

    def add(self, response: messages.GetResultResponse) -> bytes:
        """The chunk that an answer brings; empty: none. Internal: more than was announced, or without a beginning."""
        kind = response.WhichOneof("response")
        if kind == "begin" and self._begin is None:
            self._begin = response.begin
            return b""
        if self._begin is None or kind != "data":
            raise Internal(f"{self._what} came in another order than the protocol has", problems=())
        self._bytes += len(response.data)
        if self._bytes > self._begin.bytes:
            raise Internal(f"{self._what} is longer than the {self._begin.bytes} bytes announced", problems=())
        self._digest.update(response.data)
        return bytes(response.data)

    def finish(self) -> JobResult:
        """All has come. Internal: the file is not the one that the daemon rendered."""
        if self._begin is None:
            raise Internal(f"{self._what} did not come", problems=())
        if self._bytes != self._begin.bytes:
            raise Internal(f"{self._what} ends after {self._bytes} of {self._begin.bytes} bytes", problems=())
        found, announced = self._digest.hexdigest(), self._begin.sha256.lower()
        if found != announced:
            raise Internal(
                f"{self._what} has the SHA-256 {found}, that of the picture is {announced}: it was changed after it "
                "was rendered, or damaged on the way",
                problems=(),
            )
        return _result_of(self._begin)


class PictureFeed:
    """The picture of a view, tile by tile. Not thread safe."""

    def __init__(self, request: messages.GetResultRequest, info: JobInfo) -> None:
        self._what = f"the picture of view {request.view} of job {request.job_id}"
        self._settings = types.RenderSettings()
        self._settings.CopyFrom(info.message.settings)
        if request.tiles.HasField("window"):
            self._settings.region.CopyFrom(request.tiles.window)
        self._begin: messages.JobView | None = None
        self._assembly: Assembly | None = None

    def add(self, response: messages.GetResultResponse) -> None:
        """BrokenTile: a tile does not fit. Internal: an answer does not."""
        kind = response.WhichOneof("response")
        if kind == "begin" and self._begin is None:
            self._begin = response.begin
            self._assembly = Assembly(self._settings)
        elif kind == "tile" and self._assembly is not None:
            self._assembly.add(response.tile)
        else:
            raise Internal(f"{self._what} came in another order than the protocol has", problems=())

    def image(self, info: JobInfo, notices: tuple[str, ...]) -> Image:
        """All has come. Internal: tiles are missing."""
        if self._begin is None or self._assembly is None or not self._assembly.complete:
            raise Internal(f"{self._what} did not come whole", problems=())
        end, tiles = self._begin.end, self._assembly.snapshot()
        return Image(
            tiles.planes(),
            window=tiles.window,
            frame=tiles.frame,
            stats=make_stats(end.totals, end) if self._begin.sha256 else make_stats(end.totals),
            notices=notices,
            seed=info.message.settings.seed,
            view=self._begin.view + 1 if info.views > 1 else None,
        )


def image_of_result(data: bytes, result: JobResult, info: JobInfo, notices: tuple[str, ...]) -> Image:
    """The picture in a file that passed its checks. InvalidArgument: an EXR file that this package does not read."""
    return image_of_exr(
        data,
        f"view {result.view} of job {info.id}",
        stats=result.stats,
        seed=info.message.settings.seed,
        view=result.view + 1 if info.views > 1 else None,
        notices=notices,
    )


class KeptJobValues:
    """What is known of a job that the daemon keeps, without asking: as it was told last."""

    def __init__(self, info: JobInfo, submitted: messages.SubmitJobResponse | None = None) -> None:
        self._info = info
        #: enqueue() found the job of an earlier call with the same client_token.
        self.already_there = submitted.already_there if submitted is not None else False
        self.unsampled = tuple(submitted.unsampled) if submitted is not None else ()  # as Image.unsampled
        self.notices = tuple(submitted.notices) if submitted is not None else ()  # as Image.notices

    def _hear(self, info: JobInfo) -> JobInfo:
        """Keeps what is newer. Threads may come at once: values are replaced as a whole."""
        known = self._info
        if info.updated_seq >= known.updated_seq:
            if not info.results and known.results:
                info = dataclasses.replace(info, results=known.results)
            self._info = info
        return info

    @property
    def latest(self) -> JobInfo:
        """The job as the newest answer about it had it: of enqueue(), info(), watch(), wait(), pause() and the like."""
        return self._info

    @property
    def id(self) -> str:
        """The daemon's name of it; Client.job finds it again."""
        return self._info.id

    @property
    def name(self) -> str:
        """For people; may be empty."""
        return self._info.name

    @property
    def state(self) -> State:
        """Of latest: "queued", "running", "paused", "succeeded", "failed" or "canceled"."""
        return self._info.state

    @property
    def target_state(self) -> State:
        """Of latest: of a running job that was asked to pause or cancel; else "succeeded", or the end that it has."""
        return self._info.target_state

    @property
    def done(self) -> bool:
        """Of latest: it has come to its end."""
        return self._info.done

    @property
    def reason(self) -> str:
        """Of latest: why its state is what it is; empty: no reason was told."""
        return self._info.reason

    @property
    def attempt(self) -> int:
        """Of latest: times that it has begun to run."""
        return self._info.attempt

    @property
    def priority(self) -> int:
        """Of latest: [-100, 100], higher first."""
        return self._info.priority

    @property
    def views(self) -> int:
        """Pictures that it makes."""
        return self._info.views

    @property
    def views_done(self) -> int:
        """Of latest: pictures that are done."""
        return self._info.views_done

    @property
    def stats(self) -> Stats:
        """Of latest: figures of the view in hand."""
        return self._info.stats

    @property
    def same_bits(self) -> bool:
        """Of latest: the picture has the bits of an uninterrupted run."""
        return self._info.same_bits

    @property
    def left(self) -> TimeLeft | None:
        """Of latest: until its end; None: not known."""
        return self._info.left

    @property
    def results(self) -> tuple[JobResult, ...]:
        """Of the newest info() or wait(): the views that were done."""
        return self._info.results

    def __repr__(self) -> str:
        info = self._info
        name = f" {info.name!r}" if info.name else ""
        return f"<heliograph.KeptJob {info.id}{name}, {info.state}, {info.views_done} of {info.views} views done>"
