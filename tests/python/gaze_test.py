"""Sessions whose samples or previews follow a gaze."""

import asyncio
import signal

import pytest
from conftest import BOX, eventually, references
from kept_job_test import LONG, Restarted

import heliograph as hg
import heliograph.aio as ahg

FOVEATED = {"size": (96, 64), "foveation": "density", "viewing_distance": 1.5}
BAD = ("ab", (1,), (1, 2, 3), (1, float("nan")), (2e6, 0), (0, 10**400), (True, 1), 7)
REFUSED = r"gaze: .*allowed: \(x, y\) in pixels"


def samples_at(image, x):
    """Mean around a pixel of the middle row."""
    return image.samples[28:36, x - 4 : x + 4].mean()


def wait_for_samples(session, x):
    assert eventually(lambda: samples_at(session.wait(timeout=LONG), x) >= 40)


def test_samples_go_where_the_gaze_is(box):
    with box.session(until=hg.Samples(2), **FOVEATED) as session:
        assert session.gaze is None
        session.gaze = (16, 32)
        assert session.gaze == (16, 32)
        session.set(until=hg.Samples(64))
        wait_for_samples(session, 16)
        assert samples_at(session.wait(), 88) < 16
        session.gaze = (88, 32)
        wait_for_samples(session, 88)
        assert samples_at(session.wait(), 16) >= 40
        session.gaze = None
        assert session.gaze is None
        for bad in BAD:
            with pytest.raises(hg.InvalidArgument, match=REFUSED):
                session.gaze = bad
    with pytest.raises(hg.InvalidArgument, match="foveation"):
        box.render(size=(8, 8), until=hg.Samples(1), foveation="density")


def test_a_session_begins_with_a_gaze(client, box):
    before = references(client, box)
    with box.session(until=hg.Samples(64), gaze=(88, 32), **FOVEATED) as session:
        assert session.gaze == (88, 32)
        image = session.wait(timeout=LONG)
        assert samples_at(image, 88) >= 40 and samples_at(image, 16) < 16
        session.camera.orbit(5)
        image = session.wait(timeout=LONG)
        assert samples_at(image, 88) >= 40 and samples_at(image, 16) < 16
    eventually(lambda: references(client, box) == before)
    for bad in BAD:
        with pytest.raises(hg.InvalidArgument, match=REFUSED):
            box.session(gaze=bad, **FOVEATED)
    assert references(client, box) == before


def test_previews_as_published(box):
    """They come while the camera moves; the film has as many samples everywhere as without a gaze."""
    published = {"foveation": "paper", "foveation_paper": {"disk": 0.3, "reject_history": True}}
    moving = {"size": (96, 64), "preview_rate": 60, "preview_upscaling": True, "buffer": 200}
    with box.session(until=hg.Samples(4), gaze=(88, 32), **published, **moving) as session:
        assert session.settings.foveation_paper.disk == 0.3 and session.settings.foveation_paper.reject_history
        session.wait(timeout=LONG)
        for x in (16, 48, 80):
            session.gaze = (x, 32)
            session.camera.orbit(2)
            preview = next(frame for frame in session.frames(timeout=LONG) if frame.kind == "preview")
            assert preview.image.display.shape == (64, 96, 3) and preview.image.display.mean() > 0.01
        image = session.wait(timeout=LONG)
        assert image.samples.min() == image.samples.max() == 4
    with pytest.raises(hg.InvalidArgument, match=r"foveation_paper.disk: 2; allowed: \[0.01, 1\]"):
        with box.session(foveation="paper", foveation_paper={"disk": 2}) as session:
            session.wait(timeout=LONG)
    with pytest.raises(hg.InvalidArgument, match="foveation"):
        box.render(size=(8, 8), until=hg.Samples(1), foveation="paper")


def test_asyncio(client):
    async def main():
        async with await ahg.connect(client.address, token=client.daemon.token) as other:
            scene = await other.load(BOX)
            async with await scene.session(until=ahg.Samples(64), gaze=(16, 32), **FOVEATED) as session:
                assert session.gaze == (16, 32)
                image = await session.wait(timeout=LONG)
                assert samples_at(image, 16) >= 40 and samples_at(image, 88) < 16
            for bad in BAD:
                with pytest.raises(ahg.InvalidArgument, match=REFUSED):
                    await scene.session(gaze=bad, **FOVEATED)

    asyncio.run(main())


@pytest.mark.filterwarnings("ignore:the daemon restarts")
def test_one_that_is_set_while_the_daemon_restarts(program, tmp_path):
    with Restarted(program, tmp_path / "state") as daemon, hg.connect(daemon.address, wait=30) as client:
        with client.load(BOX).session(until=hg.Samples(64), gaze=(16, 32), **FOVEATED) as session:
            wait_for_samples(session, 16)
            view = session.view
            assert samples_at(session.wait(), 88) < 16
            daemon.kill(signal.SIGTERM)
            eventually(lambda: session.reconnecting)
            session.gaze = (88, 32)
            daemon.start()
            wait_for_samples(session, 88)
            assert session.view == view and samples_at(session.wait(), 16) >= 40


@pytest.mark.filterwarnings("ignore:the daemon restarts")
def test_one_that_was_set_before_the_daemon_restarts(program, tmp_path):
    """Told anew with the newest view where the daemon does not have that, and kept where it has."""
    with Restarted(program, tmp_path / "state") as daemon, hg.connect(daemon.address, wait=30) as client:
        with client.load(BOX).session(until=hg.Samples(64), **FOVEATED) as session:
            session.gaze = (16, 32)
            wait_for_samples(session, 16)
            daemon.kill(signal.SIGTERM)
            eventually(lambda: session.reconnecting)
            session.camera.orbit(20)
            daemon.start()
            image = session.wait(timeout=LONG)
            assert samples_at(image, 16) >= 40 and samples_at(image, 88) < 16
