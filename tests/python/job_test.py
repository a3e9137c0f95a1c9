"""Jobs: stills and camera paths, cancelled, forgotten, interrupted."""

import gc
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import BOX, eventually, references

import heliograph as hg

SIZE = (96, 64)


def job_threads():
    return [thread for thread in threading.enumerate() if thread.name.startswith("heliograph-job")]


def test_a_still(box):
    with box.submit(size=SIZE, until=hg.Samples(8), seed=7) as job:
        image = job.result(timeout=60)
        assert job.done and job.id and job.stats.ended_by == "samples"
        assert np.array_equal(image.rgb, box.render(size=SIZE, until=hg.Samples(8), seed=7).rgb)
        assert np.array_equal(job.result().rgb, image.rgb)
    assert not job_threads()


def test_a_camera_path_holds_two_pictures(box):
    views = [box.camera().orbit(10 * step) for step in range(6)]
    with box.submit(size=SIZE, until=hg.Samples(4), views=views, seed=7) as job:
        eventually(lambda: len(job._state.done) == 2)
        with pytest.raises(hg.FailedPrecondition, match="6 views"):
            job.result()
        images = list(job.images(timeout=60))
    assert len(images) == 6
    for view, image in zip(views, images):
        assert np.array_equal(image.rgb, box.render(size=SIZE, until=hg.Samples(4), seed=7, camera=view).rgb)


def test_cancel_keeps_what_was_rendered_or_says_so(client, box):
    before = references(client, box)
    job = box.submit(size=(256, 256), until=hg.Samples(10**8))
    with pytest.raises(hg.DeadlineExceeded, match="not done within 0.2 s"):
        job.result(timeout=0.2)
    assert not job.done
    job.cancel()
    try:
        assert job.result(timeout=30).stats.ended_by == "cancelled"
    except hg.Cancelled:
        pass
    job.close()
    eventually(lambda: references(client, box) <= before)


def test_a_cancelled_path_gives_what_waits_and_ends(box):
    views = [box.camera().orbit(step) for step in range(40)]
    for size, samples in (((8, 8), 1), ((96, 64), 128)):
        with box.submit(size=size, until=hg.Samples(samples), views=views) as job:
            eventually(lambda: len(job._state.done) == 2)
            job.cancel()
            job.cancel()
            eventually(lambda: job.done)
            pictures = job.images(timeout=20)
            assert [next(pictures).size, next(pictures).size] == [size, size]
            with pytest.raises(hg.Cancelled):
                next(pictures)


def test_a_path_that_the_daemon_has_finished_can_be_cancelled(box):
    views = [box.camera().orbit(step) for step in range(4)]
    with box.submit(size=(8, 8), until=hg.Samples(1), views=views) as job:
        eventually(lambda: len(job._state.done) == 2)
        eventually(lambda: not references_of_jobs(box))  # the rest is on its way
        job.cancel()
        eventually(lambda: job.done)
        assert len(list(_until_cancelled(job))) == 2


def references_of_jobs(box):
    return references(box._client, box) > 0


def _until_cancelled(job):
    try:
        yield from job.images(timeout=20)
    except hg.Cancelled:
        pass


def test_a_closed_or_forgotten_job_ends(client, box):
    before = references(client, box)
    job = box.submit(size=(256, 256), until=hg.Samples(10**8))
    job.close()
    with pytest.raises(hg.Cancelled):
        job.result()
    job = box.submit(size=(256, 256), until=hg.Samples(10**8))
    del job
    gc.collect()
    eventually(lambda: not job_threads())
    eventually(lambda: references(client, box) <= before)


def test_refused_at_once(box):
    with pytest.raises(hg.InvalidArgument) as told:
        box.submit(size=(10**6, 8), until=hg.Samples(1))
    assert told.value.field == "size" and told.value.allowed == "[1, 65536]"
    with pytest.raises(hg.InvalidArgument, match="either camera or views"):
        box.submit(until=hg.Samples(1), camera=0, views=[0])
    with pytest.raises(hg.InvalidArgument, match="at least one camera"):
        box.submit(until=hg.Samples(1), views=[])


def test_retry_after_is_told(program):
    """RESOURCE_EXHAUSTED that time can cure carries google.rpc.RetryInfo."""
    with hg.serve(program, arguments=["--max-jobs", "1"]) as client:
        scene = client.load(BOX)
        with scene.submit(size=(256, 256), until=hg.Samples(10**8)):
            with pytest.raises(hg.ResourceExhausted, match="try again in") as told:
                scene.render(size=(8, 8), until=hg.Samples(1))
        assert told.value.retry_after_s is not None and told.value.retry_after_s > 0


INTERRUPTED = """
import sys, threading, heliograph as hg
client = hg.connect(sys.argv[1], token=sys.argv[2])
try:
    tell = lambda stats: print("goes on", flush=True)
    client.render(sys.argv[3], size=(256, 256), until=hg.Samples(10**8), progress=tell)
except KeyboardInterrupt:
    print("interrupted", flush=True)
client.close()
import time
end = time.monotonic() + 10
while threading.active_count() > 1 and time.monotonic() < end: time.sleep(0.05)
print([thread.name for thread in threading.enumerate()])
"""


def test_ctrl_c_cancels_on_the_daemon(client, box):
    before = references(client, box)
    process = subprocess.Popen(
        [sys.executable, "-B", "-c", INTERRUPTED, client.address, client.daemon.token, str(BOX)],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout.readline() == "goes on\n"
        assert references(client, box) == before + 1
        process.send_signal(signal.SIGINT)
        told = process.stdout.read()
        assert process.wait(30) == 0
    finally:
        process.kill()
        process.stdout.close()
        process.wait()
    assert "interrupted\n" in told and told.endswith("['MainThread']\n")
    eventually(lambda: references(client, box) <= before)
