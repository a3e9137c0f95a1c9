"""Sessions that outlive a planned restart of their daemon."""

import asyncio
import signal
import time

import numpy as np
import pytest
from conftest import BOX, eventually
from kept_job_test import LONG, SIZE, Restarted, samples_for

import heliograph as hg
import heliograph.aio as ahg
from heliograph.errors import Cancelled, NotFound, Unavailable
from heliograph.reattachment import LONGEST_PAUSE_S, Reattachment

pytestmark = pytest.mark.filterwarnings("ignore:the daemon restarts")


def test_a_restart_alone_is_waited_for():
    restarts = Unavailable("it restarts", problems=(), retry_after_s=1)
    gone = Unavailable("nobody answers", problems=())
    for first in (gone, Cancelled("ended", problems=()), NotFound("none", problems=(), retry_after_s=1)):
        assert Reattachment(60).pause(first) is None
    assert Reattachment(0).pause(restarts) is None
    waits = Reattachment(60)
    pauses = [waits.pause(restarts), *(waits.pause(gone) for _ in range(8))]
    assert pauses == sorted(pauses) and 0 < pauses[0] < pauses[-1] == LONGEST_PAUSE_S and 55 < waits.left() <= 60
    assert waits.pause(NotFound("none", problems=())) is None
    waits.found()
    assert waits.pause(gone) is None and waits.pause(restarts) == pauses[0]
    brief = Reattachment(0.01)
    assert brief.pause(restarts) <= 0.01
    time.sleep(0.02)
    assert brief.pause(gone) is None


def restart(daemon):
    daemon.kill(signal.SIGTERM)
    daemon.start()


def test_a_picture_goes_on_with_its_samples(program, tmp_path):
    with Restarted(program, tmp_path / "state") as daemon, hg.connect(daemon.address, wait=30) as client:
        scene = client.load(BOX)
        samples = samples_for(scene, 3)
        whole = scene.render(size=SIZE, seed=5, until=hg.Samples(samples))
        with scene.session(size=SIZE, seed=5, until=hg.Samples(samples)) as session:
            before = eventually(lambda: session.stats.samples >= 16 and session.stats.samples)
            restart(daemon)
            image = session.wait(timeout=LONG)
            assert image.stats.samples == samples > before
            assert np.array_equal(image.rgb, whole.rgb)
            assert not session.reconnecting


def test_changes_in_between_are_sent(program, tmp_path):
    with Restarted(program, tmp_path / "state") as daemon, hg.connect(daemon.address, wait=30) as client:
        scene = client.load(BOX)
        with scene.session(size=SIZE, seed=5, until=hg.Samples(8)) as session:
            session.wait(timeout=LONG)
            daemon.kill(signal.SIGTERM)
            eventually(lambda: session.reconnecting)
            session.camera.orbit(20)
            session.set(size=(32, 24), until=hg.Samples(4))
            daemon.start()
            image = session.wait(timeout=LONG)
            assert image.rgb.shape == (24, 32, 3) and image.stats.samples == 4
            same = scene.render(size=(32, 24), seed=5, until=hg.Samples(4), camera=session.camera.value)
            assert np.array_equal(image.rgb, same.rgb)


def test_a_daemon_that_stays_away(program, tmp_path):
    with Restarted(program, tmp_path / "state") as daemon, hg.connect(daemon.address, wait=30) as client:
        scene = client.load(BOX)
        session = scene.session(size=SIZE, patience=0.3)
        eventually(lambda: session.stats.samples)
        daemon.kill(signal.SIGTERM)
        with pytest.raises(hg.Unavailable):
            session.wait(samples=10**9, timeout=LONG)
        session.close()
        with pytest.raises(hg.InvalidArgument, match="patience"):
            scene.session(size=SIZE, patience=-1)


def test_a_session_that_is_closed_meanwhile(program, tmp_path):
    with Restarted(program, tmp_path / "state") as daemon, hg.connect(daemon.address, wait=30) as client:
        session = client.load(BOX).session(size=SIZE)
        eventually(lambda: session.stats.samples)
        daemon.kill(signal.SIGTERM)
        eventually(lambda: session.reconnecting)
        begun = time.monotonic()
        session.close()
        assert time.monotonic() - begun < 8  # no more than a try, where the patience is 60 s


def test_asyncio(program, tmp_path):
    async def main(daemon):
        async with await ahg.connect(daemon.address, wait=30) as client:
            scene = await client.load(BOX)
            samples = max(16, int((await scene.render(size=SIZE, until=ahg.Seconds(0.5))).stats.samples * 4))
            whole = await scene.render(size=SIZE, seed=5, until=ahg.Samples(samples))
            async with await scene.session(size=SIZE, seed=5, until=ahg.Samples(samples)) as session:
                while session.stats.samples < 16:
                    await asyncio.sleep(0.02)
                await asyncio.to_thread(restart, daemon)
                image = await session.wait(timeout=LONG)
                assert image.stats.samples == samples and np.array_equal(image.rgb, whole.rgb)

    with Restarted(program, tmp_path / "state") as daemon:
        asyncio.run(main(daemon))
