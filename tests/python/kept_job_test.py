"""Jobs that a daemon keeps: given to it, watched, paused, fetched, and found again after it was restarted."""

import asyncio
import contextlib
import hashlib
import os
import pathlib
import signal
import socket
import subprocess

import grpc
import numpy as np
import pytest
from conftest import BOX, eventually

import heliograph as hg
import heliograph.aio as ahg

SIZE = (64, 48)
ENDLESS = {"size": (256, 256), "until": hg.Samples(10**8)}
LONG = 120  # seconds, after which something hangs
OFTEN = ["--checkpoint-interval", "0.05"]


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    return tmp_path_factory.mktemp("out")


@pytest.fixture(scope="module")
def keeper(program, out, tmp_path_factory):
    """A client of a daemon that keeps jobs."""
    arguments = [*OFTEN, "--output-root", str(out)]
    with hg.serve(program, state=tmp_path_factory.mktemp("state"), arguments=arguments) as client:
        yield client


@pytest.fixture(scope="module")
def scene(keeper):
    return keeper.load(BOX)


@pytest.fixture
def endless(scene):
    """Enqueues jobs that go on until the end of the test."""
    made = []

    def enqueue(**arguments):
        made.append(scene.enqueue(**{**ENDLESS, **arguments}))
        return made[-1]

    yield enqueue
    for job in made:
        with contextlib.suppress(hg.FailedPrecondition):
            job.cancel()
        until(job, "succeeded", "canceled", "failed")


def until(job, *states):
    """Waits for one of them."""
    return eventually(lambda: job.info() if job.info().state in states else None, 60)


def samples_for(scene, seconds):
    """About what one pixel of SIZE gets in that time."""
    stats = scene.render(size=SIZE, until=hg.Seconds(0.5)).stats
    return max(16, int(stats.samples / stats.seconds * seconds))


def test_the_picture_is_that_of_a_render(scene, tmp_path):
    job = scene.enqueue(size=SIZE, until=hg.Samples(8), seed=7, name="bøx", priority=3, channels="depth")
    assert job.id and job.name == "bøx" and not job.already_there and job.state in ("queued", "running")
    info = job.wait(LONG)
    assert info is job.latest and info.done and (info.state, info.views_done, info.attempt) == ("succeeded", 1, 1)
    assert (info.priority, info.size, info.until, info.output) == (3, SIZE, (hg.Samples(8),), "")
    assert info.same_bits and info.submitted <= info.started <= info.ended
    image = job.fetch()
    same = scene.render(size=SIZE, until=hg.Samples(8), seed=7, channels="depth")
    assert image.channels == same.channels and image.size == same.size
    assert all(np.array_equal(image[name], same[name]) for name in same)
    assert (image.seed, image.stats.ended_by, image.stats.samples, image.view) == (7, "samples", 8, None)
    assert image.unsampled == same.unsampled and image.notices == same.notices
    written = job.fetch_to(tmp_path / "box.exr").read_bytes()
    assert (len(written), hashlib.sha256(written).hexdigest()) == (job.results[0].bytes, job.results[0].sha256)
    assert np.array_equal(hg.Image.load(tmp_path / "box.exr").rgb, same.rgb)
    assert repr(job) == f"<heliograph.KeptJob {job.id} 'bøx', succeeded, 1 of 1 views done>"


def test_a_watch_tells_every_change_also_afterwards(scene):
    job = scene.enqueue(size=SIZE, until=hg.Samples(4))
    live = list(job.watch(progress=False, timeout=LONG))
    assert [(event.before, event.state) for event in live] == [
        ("", "queued"),
        ("queued", "running"),
        ("running", "succeeded"),
    ]
    assert job.done and all(event.job_id == job.id for event in live)
    assert list(job.watch(progress=False, timeout=LONG)) == live
    assert list(job.watch(from_seq=live[1].seq, timeout=LONG)) == live[1:]
    assert list(job.watch(from_seq=0, timeout=LONG)) == []
    with pytest.raises(hg.InvalidArgument, match="from_seq"):
        list(job.watch(from_seq=2**40, timeout=LONG))


def test_a_camera_path(scene):
    views = [scene.camera().orbit(20 * step) for step in range(3)]
    job = scene.enqueue(size=SIZE, until=hg.Samples(2), views=views, seed=5)
    assert job.views == 3
    job.wait(LONG)
    assert [result.view for result in job.results] == [0, 1, 2]
    for number, view in enumerate(views):
        image = job.fetch(number)
        assert image.view == number + 1
        assert np.array_equal(image.rgb, scene.render(size=SIZE, until=hg.Samples(2), seed=5, camera=view).rgb)
    with pytest.raises(hg.NotFound, match=r"views \[0, 2\]"):
        job.fetch(3)


def test_pause_resume_and_cancel(endless, keeper):
    job = endless()
    until(job, "running")
    with pytest.raises(hg.FailedPrecondition):
        job.fetch()
    with pytest.raises(hg.DeadlineExceeded, match="the job was not done within 0.2 s"):
        job.wait(0.2)
    assert "paused" in (job.pause().target_state, until(job, "paused").state)
    with pytest.raises(hg.FailedPrecondition, match="the job is paused"):
        job.wait(LONG)
    assert job.id in [other.id for other in keeper.jobs(states="paused")]
    job.resume()
    progress = next(event for event in job.watch(from_seq=0, timeout=LONG) if event.kind == "progress")
    assert progress.info.stats.samples_per_second > 0 and job.attempt == progress.attempt == 2
    with pytest.raises(hg.FailedPrecondition):
        job.resume()
    job.cancel()
    with pytest.raises(hg.Cancelled):
        job.wait(LONG)
    assert job.state == "canceled"
    for change in (job.cancel, job.resume, job.pause):
        with pytest.raises(hg.FailedPrecondition) as told:
            change()
        assert str(told.value)
    events = [(event.before, event.state) for event in job.watch(progress=False, timeout=LONG)]
    assert events == [
        ("", "queued"),
        ("queued", "running"),
        ("running", "paused"),
        ("paused", "queued"),
        ("queued", "running"),
        ("running", "canceled"),
    ]


def test_a_token_makes_it_one_job(keeper, scene):
    asked = {"size": SIZE, "until": hg.Samples(2), "client_token": "once"}
    first, second = scene.enqueue(**asked), scene.enqueue(**asked)
    assert first.id == second.id and not first.already_there and second.already_there
    with pytest.raises(hg.InvalidArgument, match="client_token"):
        scene.enqueue(**{**asked, "until": hg.Samples(3)})
    first.wait(LONG)
    assert scene.enqueue(**asked).done
    assert [job.id for job in keeper.jobs()].count(first.id) == 1


def test_output(scene, out, tmp_path):
    job = scene.enqueue(size=SIZE, until=hg.Samples(2), output="box.exr")
    job.wait(LONG)
    assert pathlib.Path(job.results[0].file).samefile(out / "box.exr") and job.latest.output == "box.exr"
    assert (out / "box.exr").read_bytes() == job.fetch_to(tmp_path / "box.exr").read_bytes()
    with pytest.raises(hg.FailedPrecondition, match="is there already") as told:
        scene.enqueue(size=SIZE, until=hg.Samples(2), output=out / "box.exr")
    assert told.value.field == "output"
    scene.enqueue(size=SIZE, until=hg.Samples(3), output=out / "box.exr", overwrite=True).wait(LONG)
    with pytest.raises(hg.Internal, match="it was changed after it was rendered"):
        job.fetch()
    with pytest.raises(hg.PermissionDenied, match="outside the output roots"):
        scene.enqueue(size=SIZE, until=hg.Samples(2), output=tmp_path / "box.exr")
    views = [scene.camera(), scene.camera()]
    with pytest.raises(hg.InvalidArgument, match="{view}") as told:
        scene.enqueue(size=SIZE, until=hg.Samples(2), output="box.exr", views=views)
    assert told.value.field == "output"
    scene.enqueue(size=SIZE, until=hg.Samples(2), output="path.{view}.exr", views=views).wait(LONG)
    assert {"path.0000.exr", "path.0001.exr"} <= set(os.listdir(out))
    (out / "box.exr").unlink()
    with pytest.raises(hg.NotFound):
        job.fetch()


def test_a_picture_without_its_file(scene, endless):
    job = scene.enqueue(size=(200, 150), until=hg.Samples(4), seed=7, channels="depth", pixel_type="float")
    job.wait(LONG)
    whole, picture = job.fetch(), job.picture(channels="depth")
    assert picture.size == (200, 150) and picture.stats.samples == 4 and picture.stats.ended_by == "samples"
    assert all(np.array_equal(picture[name], whole[name]) for name in whole)
    part = job.picture(window=(100, 20, 140, 50))
    assert part.window == (100, 20, 140, 50) and part.frame == (200, 150) and "Z" not in part.channels
    assert np.array_equal(part.rgb, whole.rgb[20:50, 100:140])
    for wrong in ((0, 0, 0, 5), (0, 0, 201, 5), (0, 0), "all"):
        with pytest.raises(hg.InvalidArgument, match="window"):
            job.picture(window=wrong)

    running = endless()
    eventually(lambda: running.info().checkpoint)
    picture = running.picture()
    assert picture.size == (256, 256) and picture.stats.samples > 0 and picture.stats.ended_by == ""
    running.pause()
    paused = until(running, "paused")
    assert paused.stats.samples >= picture.stats.samples and paused.checkpoint
    assert running.picture().stats.samples == paused.stats.samples


class Interrupted:
    """A connection whose first calls with a stream of answers break on the way."""

    def __init__(self, connection, breaks):
        self._connection, self.breaks = connection, breaks

    def __getattr__(self, name):
        return getattr(self._connection, name)

    def open(self, *arguments):
        call = self._connection.open(*arguments)
        if not self.breaks:
            return call
        self.breaks -= 1
        return Broken(call)


class Broken:
    def __init__(self, call):
        self._call = call

    def __iter__(self):
        yield next(iter(self._call))
        self._call.cancel()
        raise LostConnection()

    def cancel(self):
        self._call.cancel()


class LostConnection(grpc.RpcError):
    def code(self):
        return grpc.StatusCode.UNAVAILABLE

    def details(self):
        return "Socket closed"

    def trailing_metadata(self):
        return ()


def test_a_fetch_begins_anew_after_a_lost_connection(keeper, scene, tmp_path):
    job = scene.enqueue(size=SIZE, until=hg.Samples(2), seed=7)
    job.wait(LONG)
    whole = job.fetch()
    job._connection = Interrupted(job._connection, 2)
    assert np.array_equal(job.fetch().rgb, whole.rgb) and job._connection.breaks == 0
    job._connection.breaks = 1
    assert np.array_equal(hg.Image.load(job.fetch_to(tmp_path / "a.exr")).rgb, whole.rgb)
    assert [file.name for file in tmp_path.iterdir()] == ["a.exr"]
    job._connection.breaks = 1
    with pytest.raises(hg.Unavailable):
        job.fetch(patience=0)


def test_refused_at_once(keeper, scene):
    with pytest.raises(hg.InvalidArgument) as told:
        scene.enqueue(size=(10**6, 8), until=hg.Samples(1))
    assert told.value.field == "size" and told.value.allowed == "[1, 65536]"
    with pytest.raises(hg.InvalidArgument, match="name"):
        scene.enqueue(size=SIZE, until=hg.Samples(1), name="x" * 257)
    with pytest.raises(hg.InvalidArgument, match="preview_rate"):
        scene.enqueue(size=SIZE, until=hg.Samples(1), preview_rate=5)
    with pytest.raises(hg.NotFound):
        keeper.job("j-none")


def test_lists_and_priorities(endless, keeper):
    jobs = [endless(name=f"number {number}") for number in range(3)]
    listed = [job.id for job in keeper.jobs(states=["queued", "running"])]
    assert listed[:3] == [job.id for job in reversed(jobs)]  # newest first
    assert jobs[0].set_priority(-7).priority == -7 and keeper.job(jobs[0].id).priority == -7
    with pytest.raises(hg.InvalidArgument, match=r"priority: 101; allowed: whole numbers in \[-100, 100\]"):
        jobs[0].set_priority(101)
    with pytest.raises(hg.InvalidArgument, match="priority: -101"):
        endless(priority=-101)


def test_all_jobs_are_watched(keeper, scene):
    events = keeper.watch_jobs(from_seq=1, timeout=LONG)
    before = next(events).seq
    jobs = [scene.enqueue(size=SIZE, until=hg.Samples(2)) for _ in range(2)]
    open_ = {job.id for job in jobs}
    for event in events:
        assert event.seq == before + 1  # none is left out
        before = event.seq
        if event.state == "succeeded":
            open_.discard(event.job_id)
        if not open_:
            break
    assert not open_


def test_a_daemon_that_restarts_on_another_port(program, tmp_path):
    state = tmp_path / "state"
    with hg.serve(program, state=state, arguments=OFTEN) as client:
        scene = client.load(BOX)
        samples = samples_for(scene, 3)
        whole = scene.render(size=SIZE, until=hg.Samples(samples), seed=9)
        job = scene.enqueue(size=SIZE, until=hg.Samples(samples), seed=9, require_same_bits=True)
        told = []
        for event in job.watch(timeout=LONG):
            if event.kind == "progress" and event.info.checkpoint is not None:
                break
            told.append(event)
        told = [event for event in told if event.kind == "state"]
        assert [event.state for event in told] == ["queued", "running"]
        address = client.address
    with hg.serve(program, state=state, arguments=OFTEN) as client:
        assert client.address != address
        job = client.job(job.id)
        told += job.watch(from_seq=told[-1].seq + 1, progress=False, timeout=LONG)
        assert [event.state for event in told] == ["queued", "running", "queued", "running", "succeeded"]
        assert [event.attempt for event in told] == [0, 1, 1, 2, 2]
        assert list(job.watch(progress=False, timeout=LONG)) == told
        image = job.fetch()
        assert job.info().same_bits and image.stats.samples == samples
        assert all(np.array_equal(image[name], whole[name]) for name in whole)


class Restarted:
    """A daemon at a fixed address that can be killed and comes again."""

    def __init__(self, program, state):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"127.0.0.1:{free.getsockname()[1]}"
        self._command = [program, "--listen", self.address, "--log-level", "warn", "--state", str(state), *OFTEN]
        self.start()

    def start(self):
        self._process = subprocess.Popen(self._command, stdout=subprocess.DEVNULL)

    def kill(self, number=signal.SIGKILL):
        self._process.send_signal(number)
        self._process.wait()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.kill()
        self._process.wait()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_watch_goes_on_with_the_next_daemon(number, program, tmp_path):
    with Restarted(program, tmp_path / "state") as daemon, hg.connect(daemon.address, wait=30) as client:
        scene = client.load(BOX)
        job = scene.enqueue(size=SIZE, until=hg.Samples(samples_for(scene, 3)))
        told, killed = [], False
        for event in job.watch(timeout=LONG):
            if event.kind == "state":
                told.append(event)
            elif not killed:
                daemon.kill(number)
                daemon.start()
                killed = True
        assert killed and [event.state for event in told] == ["queued", "running", "queued", "running", "succeeded"]
        assert list(job.watch(progress=False, timeout=LONG)) == told
        assert job.fetch().size == SIZE


def test_asyncio_waits_through_a_restart(program, tmp_path):
    async def main(daemon):
        async with await ahg.connect(daemon.address, wait=30) as client:
            scene = await client.load(BOX)
            samples = max(16, int((await scene.render(size=SIZE, until=ahg.Seconds(0.5))).stats.samples * 4))
            job = await scene.enqueue(size=SIZE, until=ahg.Samples(samples))
            waiting = asyncio.create_task(job.wait(LONG))
            while (await job.info()).state != "running":
                await asyncio.sleep(0.02)
            await asyncio.to_thread(daemon.kill)
            daemon.start()
            assert (await waiting).attempt == 2 and job.done
            target = await job.fetch_to(tmp_path / "box.exr")
            assert np.array_equal((await job.fetch()).rgb, ahg.Image.load(target).rgb)

    with Restarted(program, tmp_path / "state") as daemon:
        asyncio.run(main(daemon))


def test_asyncio(keeper):
    async def main():
        async with await ahg.connect(keeper.address, token=keeper.daemon.token) as client:
            scene = await client.load(BOX)
            job = await scene.enqueue(**ENDLESS, name="asynchronous")
            async for event in job.watch(timeout=LONG):
                if event.kind == "progress":
                    break
            await job.set_priority(5)
            await job.pause()
            while (await job.info()).state != "paused":
                await asyncio.sleep(0.02)
            with pytest.raises(ahg.FailedPrecondition, match="the job is paused"):
                await job.wait(LONG)
            found = [other.id async for other in client.jobs(states="paused")]
            assert job.id in found and (await client.job(job.id)).priority == 5
            await job.resume()
            waiting = asyncio.create_task(job.wait(LONG))
            await asyncio.sleep(0)
            await job.cancel()
            with pytest.raises(ahg.Cancelled):
                await waiting

            async def first_event():
                async for event in client.watch_jobs(from_seq=1):
                    return event

            assert (await first_event()).seq >= 1
            waiting = asyncio.create_task(first_event_from_now(client))
            with pytest.raises(asyncio.TimeoutError):
                await asyncio.wait_for(waiting, 0.3)

    async def first_event_from_now(client):
        async for event in client.watch_jobs():
            return event

    asyncio.run(main())


def test_a_daemon_that_keeps_no_jobs_says_so(client, box):
    """As hg.serve() starts it."""
    assert not client.info().keeps_jobs
    for ask in (
        lambda: box.enqueue(size=SIZE, until=hg.Samples(1)),
        lambda: client.job("j-1"),
        lambda: next(client.jobs()),
        lambda: next(client.watch_jobs()),
    ):
        with pytest.raises(hg.FailedPrecondition, match=r"keeps no jobs: .*\(--state\)"):
            ask()


def test_serve_leaves_the_persons_folder_alone(program, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "xdg"))
    with hg.serve(program) as client:
        assert not client.info().keeps_jobs
    assert not (tmp_path / "xdg").exists()
    with hg.serve(program, state="auto") as client:
        assert client.info().keeps_jobs
    assert (tmp_path / "xdg" / "heliograph").is_dir()
    for wrong in ("", 5, True):
        with pytest.raises(hg.InvalidArgument, match="state"):
            hg.serve(program, state=wrong)


def test_two_daemons_on_one_folder_are_refused(program, tmp_path):
    with hg.serve(program, state=tmp_path / "state"):
        with pytest.raises(hg.Unavailable, match="its log: "):
            hg.serve(program, state=tmp_path / "state")
