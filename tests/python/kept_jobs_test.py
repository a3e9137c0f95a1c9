"""Jobs that a daemon keeps: requests, watches, results and errors, by messages that are made up here, and by a daemon
that is played by this process."""

import asyncio
import concurrent.futures
import dataclasses
import hashlib
import os
import time

import grpc
import numpy as np
import pytest

import heliograph as hg
import heliograph.aio as ahg
from heliograph import exr, kept_jobs
from heliograph.files import AtomicFile
from heliograph.v1 import durable_job_pb2 as kept
from heliograph.v1 import job_pb2 as jobs
from heliograph.v1 import render_service_pb2 as service
from heliograph.v1 import render_service_pb2_grpc as api
from heliograph.v1 import types_pb2 as types

QUEUED, RUNNING, PAUSED, SUCCEEDED, FAILED, CANCELED = range(1, 7)


def job_of(state=QUEUED, seq=1, **fields):
    settings = types.RenderSettings(width=8, height=6, seed=7)
    given = {"job_id": "j-1", "views": 1, "target_state": SUCCEEDED, "same_bits": True, "settings": settings, **fields}
    return kept.Job(state=state, updated_seq=seq, **given)


def event_of(seq, to, before=QUEUED, reason="", job_id="j-1", **fields):
    event = kept.JobEvent(seq=seq, job_id=job_id, to=to, reason=reason, time_s=1000.5 + seq, **fields)
    setattr(event, "from", before)
    return kept.WatchJobResponse(event=event)


def watching(job=None, next_seq=2):
    return kept.WatchJobResponse(watching=kept.WatchJobResponse.Watching(job=job, next_seq=next_seq))


def progress_of(job):
    return kept.WatchJobResponse(progress=job)


# ---- values


def test_a_job_as_a_value():
    info = kept_jobs.make_job_info(
        job_of(
            RUNNING,
            seq=9,
            name="box",
            target_state=PAUSED,
            attempt=2,
            priority=-3,
            budget=types.Budget(samples=64, error=0.5),
            output=kept.JobOutput(path="a.exr", overwrite=True),
            submitted_s=100.25,
            started_s=101,
            progress=types.Progress(samples_per_pixel=5, budget_used=0.25),
            left=kept.Job.Estimate(seconds=3, low_s=2, high_s=7),
            results=[kept.JobView(view=0, bytes=12, sha256="ab", end=types.FrameEnd(reason=types.END_REASON_SAMPLES))],
        )
    )
    assert (info.id, info.name, info.state, info.target_state) == ("j-1", "box", "running", "paused")
    assert (info.attempt, info.priority, info.size, info.updated_seq) == (2, -3, (8, 6), 9)
    assert info.until == (hg.Error(0.5), hg.Samples(64))
    assert (info.output, info.overwrite, info.same_bits, info.require_same_bits) == ("a.exr", True, True, False)
    assert (info.submitted, info.started, info.ended, info.checkpoint) == (100.25, 101, None, None)
    assert (info.stats.samples, info.stats.budget_used, info.left) == (5, 0.25, hg.TimeLeft(3, 2, 7))
    assert info.results == (hg.JobResult(0, info.results[0].stats, "", 12, "ab"),)
    assert info.results[0].stats.ended_by == "samples" and not info.done
    bare = kept_jobs.make_job_info(job_of())
    assert bare.left is None and bare.stats == hg.Stats() and bare.started is None and bare.until == ()
    done = [kept_jobs.make_job_info(job_of(state)).done for state in range(1, 7)]
    assert done == [False, False, False, True, True, True]
    assert set(kept_jobs.STATES) == {kept_jobs.make_job_info(job_of(state)).state for state in range(1, 7)}


def test_what_is_known_grows_newer_alone():
    values = kept_jobs.KeptJobValues(kept_jobs.make_job_info(job_of(RUNNING, seq=5)))
    values._hear(kept_jobs.make_job_info(job_of(QUEUED, seq=4)))  # an answer that another thread got earlier
    assert values.state == "running"
    view = kept.JobView(view=0, bytes=3)
    values._hear(kept_jobs.make_job_info(job_of(SUCCEEDED, seq=6, results=[view])))
    values._hear(kept_jobs.make_job_info(job_of(SUCCEEDED, seq=6)))  # of a list, which has no results
    assert values.done and [result.bytes for result in values.results] == [3]
    assert "j-1, succeeded, 0 of 1 views done" in repr(values)


# ---- requests


def submit(**arguments):
    asked = {"name": "", "priority": 0, "client_token": "", "output": None, "overwrite": False}
    return kept_jobs.submit_request(
        jobs.RunJobRequest(scene_id="s"), **{**asked, "require_same_bits": False, **arguments}
    )


def test_a_request():
    request = submit(name="böx\u3000", priority=np.int64(100), client_token="t", output="a.{view}.exr", overwrite=True)
    assert request.job.scene_id == "s" and request.name == "böx\u3000" and request.priority == 100
    assert request.output == kept.JobOutput(path="a.{view}.exr", overwrite=True) and request.client_token == "t"
    assert not submit().HasField("output") and submit(require_same_bits=True).require_same_bits


def test_all_that_is_wrong_is_told_at_once():
    with pytest.raises(hg.InvalidArgument) as told:
        submit(name=7, client_token="a\nb", priority=101, overwrite=True, require_same_bits="yes")
    assert [problem.field for problem in told.value.problems] == [
        "name",
        "client_token",
        "priority",
        "require_same_bits",
        "overwrite",
    ]
    for wrong in (True, 1.5, "1", None, -101):
        with pytest.raises(hg.InvalidArgument, match=r"allowed: whole numbers in \[-100, 100\]"):
            submit(priority=wrong)
    for wrong in (b"x.exr", 5, "\ud800.exr"):
        with pytest.raises(hg.InvalidArgument, match="output"):
            submit(output=wrong)


def test_states():
    assert kept_jobs.read_states(None) == []
    assert kept_jobs.read_states("running") == [RUNNING]
    assert kept_jobs.read_states(iter(["paused", "canceled"])) == [PAUSED, CANCELED]
    for wrong in ("cancelled", ["running", "done"], 5, [], ""):
        with pytest.raises(hg.InvalidArgument, match="allowed: 'queued', 'running'"):
            kept_jobs.read_states(wrong)


@pytest.mark.parametrize("view", [-1, 2**32, True, 1.0, "0", None])
def test_views(view):
    with pytest.raises(hg.InvalidArgument, match="allowed: a view's index"):
        kept_jobs.result_request("j-1", view)


def test_fields_are_the_callers_arguments():
    from heliograph.errors import argument_of

    for told, argument in (
        ("job.settings.width", "size"),
        ("job.budget", "until"),
        ("job.settings.adaptive.min_samples", "adaptive.min_samples"),
        ("job.views[3].camera.position", "views[3].camera.position"),
        ("job.format.compression", "compression"),
        ("output.path", "output"),
        ("output.overwrite", "overwrite"),
        ("client_token", "client_token"),
    ):
        assert argument_of(told) == argument


# ---- watches


def test_a_watch_goes_on_behind_its_last_event():
    feed = kept_jobs.WatchFeed("j-1", from_seq=1)
    assert feed.request() == kept.WatchJobRequest(job_id="j-1", from_seq=1)
    feed.add(watching(job_of(RUNNING, seq=3), next_seq=4))
    told = [feed.add(event_of(1, QUEUED, before=0, by="ada")), feed.add(event_of(3, RUNNING, attempt=1))]
    assert [(event.seq, event.before, event.state, event.by) for event in told] == [
        (1, "", "queued", "ada"),
        (3, "queued", "running", ""),
    ]
    assert told[1].time == 1003.5 and told[1].kind == "state" and told[1].info is None
    assert feed.failed(hg.Unavailable("gone")) > 0
    assert feed.request().from_seq == 4
    feed.add(watching(job_of(SUCCEEDED, seq=6), next_seq=7))
    assert feed.add(event_of(3, RUNNING)) is None  # told already
    assert feed.add(event_of(6, SUCCEEDED, before=RUNNING)).state == "succeeded"
    feed.check_over()


def test_from_now_on_is_kept_over_a_lost_connection():
    feed = kept_jobs.WatchFeed()
    assert feed.request().from_seq == 0
    feed.failed(hg.Unavailable("gone"))
    assert feed.request().from_seq == 0  # nothing was promised yet
    feed.add(watching(next_seq=40))
    feed.failed(hg.Unavailable("gone"))
    assert feed.request().from_seq == 40
    assert feed.add(event_of(39, RUNNING)) is None and feed.add(event_of(40, RUNNING)).seq == 40


def test_the_watched_job_follows_events_and_progress():
    feed = kept_jobs.WatchFeed("j-1", from_seq=1, progress=True)
    feed.add(watching(job_of(PAUSED, seq=5, reason="the disk is full"), next_seq=6))
    feed.add(event_of(2, RUNNING))  # older than the job that was told
    assert (feed.job.state, feed.job.reason) == ("paused", "the disk is full")
    feed.add(event_of(6, QUEUED, before=PAUSED))
    feed.add(event_of(7, RUNNING, attempt=3))
    assert (feed.job.state, feed.job.reason, feed.job.attempt) == ("running", "", 3)
    assert feed.add(progress_of(job_of(RUNNING, seq=4))) is None  # older, too
    told = feed.add(progress_of(job_of(RUNNING, seq=7, progress=types.Progress(samples_per_pixel=9))))
    assert told.kind == "progress" and told.info.stats.samples == 9 and feed.job is told.info
    with pytest.raises(hg.Internal, match="before the job had come to its end"):
        feed.check_over()
    feed.add(event_of(8, CANCELED, before=RUNNING))
    assert feed.job.target_state == "canceled"
    feed.check_over()


def test_what_ends_a_watch():
    feed = kept_jobs.WatchFeed("j-1", patience=0)
    for error in (hg.Unavailable("gone"), hg.Cancelled("by the daemon"), hg.NotFound("no such job")):
        with pytest.raises(type(error)) as told:
            feed.failed(error)
        assert told.value is error
    patient = kept_jobs.WatchFeed("j-1", patience=3600)
    pauses = [patient.failed(hg.Unavailable("gone")) for _ in range(12)]
    assert pauses == sorted(pauses) and 0 < pauses[0] < pauses[-1] <= 2  # rarer and rarer, never rare
    patient.add(watching(job_of(), next_seq=2))
    assert patient.failed(hg.Unavailable("gone again")) == pauses[0]
    with pytest.raises(hg.NotFound):
        patient.failed(hg.NotFound("no such job"))
    timed = kept_jobs.WatchFeed("j-1", timeout=0.01, late="the job was not done")
    while True:
        try:
            timed.seconds_left()
        except hg.DeadlineExceeded as error:
            assert str(error) == "the job was not done within 0.01 s"
            break
    with pytest.raises(hg.DeadlineExceeded, match="the job was not done within 0.01 s"):
        timed.failed(hg.DeadlineExceeded("the daemon did not answer"))
    for wrong in ({"from_seq": -1}, {"from_seq": 1.5}, {"progress": 1}, {"timeout": -1}, {"patience": 86401}):
        with pytest.raises(hg.InvalidArgument) as told:
            kept_jobs.WatchFeed("j-1", **wrong)
        assert told.value.field == next(iter(wrong))


def test_whoever_waits_is_told_of_every_other_end():
    def check(state, reason="", through_pauses=False):
        return kept_jobs.check_going_on(kept_jobs.make_job_info(job_of(state, reason=reason)), through_pauses)

    assert [check(QUEUED), check(RUNNING), check(SUCCEEDED), check(PAUSED, through_pauses=True)] == [
        False,
        False,
        True,
        False,
    ]
    with pytest.raises(hg.FailedPrecondition, match="paused: the disk is full; resume"):
        check(PAUSED, "the disk is full")
    with pytest.raises(hg.RenderFailed, match="the job failed: box.gltf has changed"):
        check(FAILED, "box.gltf has changed")
    with pytest.raises(hg.Cancelled, match="the job was cancelled$"):
        check(CANCELED)


# ---- results


def result_messages(data, chunk=5, **announced):
    begin = kept.JobView(view=2, bytes=len(data), sha256=hashlib.sha256(data).hexdigest())
    for name, value in announced.items():
        setattr(begin, name, value)
    yield kept.GetResultResponse(begin=begin)
    for at in range(0, len(data), chunk):
        yield kept.GetResultResponse(data=data[at : at + chunk])


def received(responses):
    feed = kept_jobs.ResultFeed("j-1", 2)
    data = b"".join(feed.add(response) for response in responses)
    return data, feed.finish()


def test_a_result_is_checked():
    data = bytes(range(23))
    whole, result = received(result_messages(data))
    assert whole == data and result.view == 2 and result.bytes == 23
    assert received(result_messages(b""))[0] == b""
    assert received(result_messages(data, sha256=hashlib.sha256(data).hexdigest().upper()))[0] == data
    good = list(result_messages(data))
    for wrong, sentence in (
        (good[:-1], "ends after 20 of 23 bytes"),
        (good[:1], "ends after 0 of 23 bytes"),
        ([], "did not come"),
        (good[1:], "another order"),
        (good + good[:1], "another order"),
        (good + [kept.GetResultResponse(data=b"x")], "longer than the 23 bytes"),
        ([good[0], *reversed(good[1:])], "SHA-256"),
        (list(result_messages(data, sha256="")), "SHA-256"),
    ):
        with pytest.raises(hg.Internal, match=sentence) as told:
            received(wrong)
        assert "view 2 of job j-1" in str(told.value)


def test_a_file_appears_whole_or_not_at_all(tmp_path):
    target = tmp_path / "a.exr"
    with AtomicFile(target, ".exr") as file:
        file.write(b"one")
        file.write(b"two")
        assert not target.exists()
        assert file.commit() == target
    assert target.read_bytes() == b"onetwo"
    with pytest.raises(RuntimeError):
        with AtomicFile(target) as file:
            file.write(b"three")
            raise RuntimeError
    with AtomicFile(target) as file:
        file.write(b"never committed")
    assert target.read_bytes() == b"onetwo" and os.listdir(tmp_path) == ["a.exr"]
    with pytest.raises(OSError) as told:
        AtomicFile(tmp_path / "nowhere" / "a.exr")
    assert told.value.filename == str(tmp_path / "nowhere" / "a.exr")
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(OSError), AtomicFile(tmp_path / "folder.exr") as file:
        file.commit()
    with pytest.raises(hg.InvalidArgument, match="ends in .exr"):
        AtomicFile(tmp_path / "a.png", ".exr")
    assert sorted(os.listdir(tmp_path)) == ["a.exr", "folder.exr"]


# ---- a daemon that this process plays


class Player(api.RenderServiceServicer):
    """Answers watches by `script`, a list of calls, each a list of answers and perhaps a status that it ends with."""

    def __init__(self, script=(), file=b"", sha256=None):
        self.script = list(script)
        self.asked = []
        self.greeted = 0
        self.file = file
        self.sha256 = sha256 or hashlib.sha256(file).hexdigest()
        self.job = job_of(SUCCEEDED, seq=9, results=[kept.JobView(view=0, bytes=len(file), sha256=self.sha256)])

    def GetServerInfo(self, request, context):
        self.greeted += 1
        return service.GetServerInfoResponse(version=hg.__version__, keeps_jobs=True)

    def GetJob(self, request, context):
        if request.job_id != "j-1":
            context.abort(grpc.StatusCode.NOT_FOUND, f"job_id: {request.job_id}; there is no such job")
        return self.job

    def WatchJob(self, request, context):
        self.asked.append(request)
        for answer in self.script.pop(0):
            if isinstance(answer, grpc.StatusCode):
                context.abort(answer, "made up")
            elif answer == "hang":
                while context.is_active():
                    time.sleep(0.01)
            else:
                yield answer

    def ListJobs(self, request, context):
        self.asked.append(request)
        begin = int(request.page_token or 0)
        page = [job_of(job_id=f"j-{number}") for number in range(begin, min(begin + 3, 7))]
        return kept.ListJobsResponse(jobs=page, next_page_token=str(begin + 3) if begin + 3 < 7 else "", total=7)

    def CancelJob(self, request, context):
        context.abort(grpc.StatusCode.FAILED_PRECONDITION, "the job has succeeded already")

    def PauseJob(self, request, context):
        return job_of(RUNNING, seq=10, target_state=PAUSED)

    def GetResult(self, request, context):
        view = self.job.results[0]
        yield kept.GetResultResponse(begin=view)
        for at in range(0, len(self.file), 1000):
            yield kept.GetResultResponse(data=self.file[at : at + 1000])


class Old(api.RenderServiceServicer):
    """A daemon that is older than kept jobs."""

    def GetServerInfo(self, request, context):
        return service.GetServerInfoResponse(version="0.1")


class Playing:
    """The player behind an address."""

    def __init__(self, player, address):
        self.address = address
        self._server = grpc.server(concurrent.futures.ThreadPoolExecutor(8))
        api.add_RenderServiceServicer_to_server(player, self._server)
        assert self._server.add_insecure_port(address)
        self._server.start()

    def __enter__(self):
        return self

    def stop(self):
        self._server.stop(0).wait()

    def __exit__(self, *_):
        self.stop()


@pytest.fixture
def socket(tmp_path_factory):
    return f"unix:{tmp_path_factory.mktemp('d')}/s"


LOST = [
    [watching(job_of(RUNNING, seq=3), 4), event_of(1, QUEUED, 0), event_of(3, RUNNING), grpc.StatusCode.UNAVAILABLE],
    [grpc.StatusCode.UNAVAILABLE],
    [watching(job_of(RUNNING, seq=5), 6), event_of(5, PAUSED, RUNNING), grpc.StatusCode.CANCELLED],
    [watching(job_of(SUCCEEDED, seq=9), 10)]
    + [event_of(6, QUEUED, PAUSED), event_of(7, RUNNING), event_of(9, SUCCEEDED, RUNNING)],
]
TOLD = [1, 3, 5, 6, 7, 9]


def test_a_watch_survives_lost_connections(socket):
    player = Player(LOST)
    with Playing(player, socket), hg.connect(socket) as client:
        job = client.job("j-1")
        assert [event.seq for event in job.watch()] == TOLD
        assert [request.from_seq for request in player.asked] == [1, 4, 4, 6]
        assert job.state == "succeeded" and all(request.progress for request in player.asked)
        assert player.greeted == 1 + 3  # by connect(), and by a call that waits after each loss


def test_a_watch_survives_lost_connections_in_asyncio(socket):
    player = Player(LOST)

    async def main():
        async with await ahg.connect(socket) as client:
            job = await client.job("j-1")
            return [event.seq async for event in job.watch()]

    with Playing(player, socket):
        assert asyncio.run(main()) == TOLD
    assert player.greeted == 1 + 3
    assert [request.from_seq for request in player.asked] == [1, 4, 4, 6]


def test_a_watch_survives_a_daemon_that_is_gone_for_a_while(socket):
    first = Playing(Player([[watching(job_of(seq=1), 2), event_of(1, QUEUED, 0), "hang"]]), socket)
    with hg.connect(socket) as client:
        events = client.job("j-1").watch()
        assert next(events).seq == 1
        first.stop()
        second = Player([[watching(job_of(FAILED, seq=8), 9), event_of(8, FAILED, RUNNING, "no memory")]])
        with Playing(second, socket):
            assert [(event.seq, event.reason) for event in events] == [(8, "no memory")]
        assert second.asked[0].from_seq == 2


def test_patience_ends(socket):
    with Playing(Player([[watching(job_of(seq=1), 2), grpc.StatusCode.UNAVAILABLE]]), socket) as playing:
        with hg.connect(socket) as client:
            job = client.job("j-1")
            playing.stop()
            with pytest.raises(hg.Unavailable):
                list(job.watch(patience=0.3))
            with pytest.raises(hg.DeadlineExceeded, match="the job was not done within 0.2 s"):
                job.wait(0.2)


def test_wait(socket):
    progress = progress_of(job_of(RUNNING, seq=3, progress=types.Progress(samples_per_pixel=4)))
    player = Player(
        [
            [watching(job_of(RUNNING, seq=3), 4), progress, event_of(9, SUCCEEDED, RUNNING), "hang"],
            [watching(job_of(SUCCEEDED, seq=9), 10)],
            [watching(job_of(RUNNING, seq=3), 4), event_of(4, PAUSED, RUNNING, "a.exr is there already"), "hang"],
            [watching(job_of(PAUSED, seq=4), 5), event_of(5, CANCELED, PAUSED)],
            [watching(job_of(RUNNING, seq=3), 4), "hang"],
        ]
    )
    with Playing(player, socket), hg.connect(socket) as client:
        job, seen = client.job("j-1"), []
        info = job.wait(60, progress=seen.append)
        assert info.state == "succeeded" and len(info.results) == 1 and [stats.samples for stats in seen] == [4]
        assert job.wait().done
        with pytest.raises(hg.FailedPrecondition, match="paused: a.exr is there already"):
            job.wait()
        with pytest.raises(hg.Cancelled):
            job.wait(through_pauses=True)
        with pytest.raises(hg.DeadlineExceeded, match="the job was not done within 0.3 s"):
            job.wait(0.3)
        with pytest.raises(hg.FailedPrecondition, match="the job has succeeded already"):
            job.cancel()
        assert job.pause().target_state == "paused"
        with pytest.raises(hg.NotFound, match="there is no such job"):
            client.job("j-2")
        for wrong in ("", None, 7):
            with pytest.raises(hg.InvalidArgument, match="job_id"):
                client.job(wrong)
    with pytest.raises(hg.FailedPrecondition, match="this client is closed"):
        job.info()


def test_jobs_page_by_page(socket):
    player = Player()

    async def ids():
        async with await ahg.connect(socket) as client:
            return [job.id async for job in client.jobs(["queued", "paused"])]

    with Playing(player, socket), hg.connect(socket) as client:
        assert client.info().keeps_jobs
        every = [f"j-{number}" for number in range(7)]
        assert [job.id for job in client.jobs()] == every and len(player.asked) == 3
        assert next(client.jobs(states="queued")).id == "j-0" and len(player.asked) == 4
        with pytest.raises(hg.InvalidArgument):  # at once, not when the first is taken
            client.jobs(states="finished")
        assert asyncio.run(ids()) == every
        assert list(player.asked[-1].states) == [QUEUED, PAUSED] and player.asked[-1].page_token == "6"


def picture():
    planes = {name: np.full((6, 8), value, np.float32) for name, value in (("R", 1), ("G", 2), ("B", 3))}
    return exr.encode(planes, hg.Window(0, 0, 8, 6), (8, 6), comments="", texts={}, compression="zip")


@pytest.mark.parametrize("form", ["blocking", "asyncio"])
def test_fetch(form, socket, tmp_path):
    data = picture()

    def fetch(path=None):
        async def main():
            async with await ahg.connect(socket) as client:
                job = await client.job("j-1")
                return await (job.fetch() if path is None else job.fetch_to(path))

        if form == "asyncio":
            return asyncio.run(main())
        with hg.connect(socket) as client:
            job = client.job("j-1")
            return job.fetch() if path is None else job.fetch_to(path)

    target = tmp_path / "a.exr"
    with Playing(Player(file=data), socket):
        image = fetch()
        assert image.rgb[0, 0].tolist() == [1, 2, 3] and image.seed == 7 and image.view is None
        target.write_bytes(b"older")
        assert fetch(target) == target and target.read_bytes() == data
        with pytest.raises(hg.InvalidArgument, match="ends in .exr"):
            fetch(tmp_path / "a.png")
    damaged = bytearray(data)
    damaged[-1] ^= 1
    target.write_bytes(b"older")
    with Playing(Player(file=bytes(damaged), sha256=hashlib.sha256(data).hexdigest()), socket):
        for path in (None, target):
            with pytest.raises(hg.Internal, match="damaged on the way"):
                fetch(path)
    with Playing(Player(file=b"no picture"), socket):
        with pytest.raises(hg.InvalidArgument, match="view 0 of job j-1: EXR"):
            fetch()
    assert target.read_bytes() == b"older" and os.listdir(tmp_path) == ["a.exr"]


def test_an_older_daemon_is_named(socket):
    async def main():
        async with await ahg.connect(socket) as client:
            with pytest.raises(ahg.Unimplemented, match=sentence):
                await client.job("j-1")
            with pytest.raises(ahg.Unimplemented, match=sentence):
                async for _ in client.watch_jobs():
                    pass

    sentence = "older than jobs that a daemon keeps; render\\(\\) and submit\\(\\) work with it"
    with Playing(Old(), socket), hg.connect(socket) as client:
        assert not client.info().keeps_jobs
        job = hg.KeptJob(client._connection, kept_jobs.make_job_info(job_of()))
        for ask in (
            job.info,
            job.wait,
            job.cancel,
            job.fetch,
            lambda: next(job.watch()),
            lambda: next(client.jobs()),
            lambda: client.job("j-1"),
        ):
            with pytest.raises(hg.Unimplemented, match=sentence):
                ask()
        asyncio.run(main())


def test_values_are_frozen():
    info = kept_jobs.make_job_info(job_of())
    with pytest.raises(dataclasses.FrozenInstanceError):
        info.state = "running"
