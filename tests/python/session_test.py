"""Sessions: frames across camera moves, buffers, waiting, threads, the collector."""

import gc
import threading
import time

import numpy as np
import pytest
from conftest import eventually, references

import heliograph as hg

SIZE = (96, 64)


def session_threads():
    return [thread for thread in threading.enumerate() if thread.name.startswith("heliograph-session")]


def test_wait_gives_the_bits_of_a_still(box):
    # Without a budget some pixels or all could have more samples already when that of wait() comes.
    with box.session(size=SIZE, seed=7, until=hg.Samples(4)) as session:
        image = session.wait(samples=8)
        assert np.array_equal(image.rgb, box.render(size=SIZE, seed=7, until=hg.Samples(8)).rgb)
        assert np.array_equal(session.wait(samples=16).rgb, box.render(size=SIZE, seed=7, until=hg.Samples(16)).rgb)
        assert session.wait().stats.samples == 16  # by the budget that it has
        camera = box.camera().orbit(20, 10)
        session.camera.orbit(20, 10)
        assert session.camera.value == camera
        moved = session.wait()
        assert np.array_equal(moved.rgb, box.render(size=SIZE, seed=7, until=hg.Samples(16), camera=camera).rgb)


def test_wait_by_error_and_time(box):
    with box.session(size=SIZE) as session:
        image = session.wait(error=0.05)
        assert image.stats.ended_by == "error" and image.stats.error <= 0.05
        session.camera.turn(3)
        assert session.wait(seconds=0.2, samples=10**6).stats.ended_by == "time"
        with pytest.raises(hg.DeadlineExceeded, match="not done within 0.1 s"):
            session.wait(samples=10**9, timeout=0.1)


def test_wait_needs_an_end(box):
    with box.session(size=SIZE) as session:
        with pytest.raises(hg.InvalidArgument, match="nothing ends the picture"):
            session.wait()
        with pytest.raises(hg.InvalidArgument, match=r"Samples: 0; allowed: whole numbers in \[1, 2\^30\]"):
            session.wait(samples=0)
        with pytest.raises(hg.InvalidArgument, match="Error: -1; allowed: finite numbers above 0"):
            session.wait(error=-1)


def test_frames_across_camera_moves(box):
    """Every view that is waited for comes as films with growing samples, and an end."""
    with box.session(size=SIZE, until=hg.Samples(64), buffer=1024) as session:
        ends, films = [], []
        for frame in session.frames(timeout=30):
            if frame.kind == "film":
                films.append((frame.number, frame.stats.samples))
                assert frame.image.rgb.shape == (64, 96, 3)
                assert frame.image.samples.min() >= frame.stats.samples
            elif frame.stats.ended_by == "samples":
                ends.append(frame)
                assert frame.final and frame.image.stats.samples == 64
                if len(ends) == 3:
                    break
                session.camera.orbit(15)
        assert [end.view for end in ends] == [1, 2, 3]
        assert films == sorted(films)
        assert session.dropped == 0
        first, second = ends[0].image, ends[1].image
        assert np.abs(first.z(second)).mean() > 2  # another view


def test_the_newest_view_wins(box):
    with box.session(size=(128, 128), until=hg.Samples(16)) as session:
        for _ in range(40):
            session.camera.orbit(1)
        last = session.camera.value
        image = session.wait()
        still = box.render(size=(128, 128), until=hg.Samples(16), camera=last)
        assert np.array_equal(image.rgb, still.rgb)


def test_an_unread_session_keeps_the_newest_alone(box):
    with box.session(size=SIZE, until=hg.Samples(4)) as session:
        for _ in range(12):
            session.camera.orbit(5)
            session.wait()
        assert len(session._core.buffer) <= 3
        assert session.dropped > 5
        frame = next(session.frames())
        assert frame.kind == "end" and frame.view == session.view


def test_a_buffer_has_a_bound(box):
    with box.session(size=SIZE, until=hg.Samples(4), buffer=5) as session:
        for _ in range(12):
            session.camera.orbit(5)
            session.wait()
        assert len(session._core.buffer) == 5
        views = [frame.view for _, frame in zip(range(5), session.frames(timeout=1))]
        assert views == sorted(views) and views[-1] == session._core._view
        with pytest.raises(hg.DeadlineExceeded, match="no event within 0.05 s"):
            next(session.frames(timeout=0.05))
        for bad in (-1, 1025, 1.5, True):
            with pytest.raises(hg.InvalidArgument, match=r"\[0, 1024\]"):
                session.frames(buffer=bad)


def test_previews_come_while_the_camera_moves(box):
    with box.session(size=(128, 128), until=hg.Samples(2), preview_rate=60, buffer=200) as session:
        session.wait()
        for _ in range(10):
            session.camera.orbit(2)
            time.sleep(0.03)
        kinds = []
        for frame in session.frames(timeout=20):
            kinds.append(frame.kind)
            if frame.kind == "preview":
                assert frame.image.channels == ("display.R", "display.G", "display.B")
                assert frame.image.display.mean() > 0.01
                assert frame.image.to_png().startswith(b"\x89PNG")
            if frame.kind == "end" and frame.view == session._core._view:
                break
        assert kinds.count("preview") >= 2


def test_settings_change_while_it_runs(box):
    with box.session(size=SIZE, until=hg.Samples(4), seed=3) as session:
        session.wait()
        session.set(size=(40, 30), max_segments=2)
        image = session.wait()
        assert image.size == (40, 30) and session.size == (40, 30)
        assert session.settings.max_segments == 2 and session.settings.seed == 3
        assert np.array_equal(image.rgb, box.render(size=(40, 30), until=hg.Samples(4), seed=3, max_segments=2).rgb)
        with pytest.raises(hg.InvalidArgument, match="mode: 'x'; allowed: 'pt', 'adaptive'"):
            session.set(mode="x")
        session.exposure = 1.5
        assert session.exposure == 1.5
        with pytest.raises(hg.InvalidArgument, match="stops"):
            session.exposure = 100


def test_a_value_out_of_range_is_told_once_and_the_session_goes_on(box):
    session = box.session(size=SIZE, until=hg.Samples(4), seed=3)
    before = session.wait()
    for use in (lambda: session.wait(timeout=20), lambda: next(session.frames(timeout=20))):
        session.set(max_segments=70000)
        session.camera.orbit(0)
        with pytest.raises(hg.InvalidArgument) as told:
            for _ in range(4):  # frames() may have an event of before
                use()
        assert told.value.field == "max_segments"
        assert (told.value.value, told.value.allowed) == ("70000", "[1, 65535]")
        assert np.array_equal(session.wait(timeout=20).rgb, before.rgb)
    with pytest.raises(hg.InvalidArgument) as told:
        session.set(size=(10**6, 4))
        session.wait(timeout=20)
    assert told.value.field == "size" and session.size == SIZE
    session.set(max_segments=2)
    assert not np.array_equal(session.wait(timeout=20).rgb, before.rgb) and session.settings.max_segments == 2
    session.close()
    eventually(lambda: not session_threads())


def test_a_session_that_cannot_be_used_is_closed(client, box, monkeypatch):
    """Made by the daemon, before something goes wrong here."""
    before = references(client, box)
    seen = []

    def fail(*_):
        seen.append(references(client, box))
        raise KeyboardInterrupt

    monkeypatch.setattr("heliograph.client.Session", fail)
    with pytest.raises(KeyboardInterrupt):
        box.session(size=SIZE)
    assert seen == [before + 1]
    eventually(lambda: references(client, box) == before)


def test_a_scene_that_is_gone_is_told_once_and_the_session_goes_on(client, box):
    gone = box.edit(materials={"red": {"base_color": (0.3, 0.3, 0.3)}})
    client.unload(gone)
    with box.session(size=SIZE, until=hg.Samples(4)) as session:
        before = session.wait()
        session.scene = gone
        with pytest.raises(hg.NotFound):
            session.wait(timeout=20)
        assert np.array_equal(session.wait(timeout=20).rgb, before.rgb) and session.scene is box


def test_what_waits_is_of_the_newest_view(box):
    with box.session(size=SIZE, until=hg.Samples(4)) as session:
        first = session.wait()
        assert first.view == session.view == 1
        session.edit(materials={"red": {"base_color": (0.1, 0.2, 0.8)}})
        assert session.view == 2
        for frame in session.frames(timeout=20):
            if frame.kind == "end":
                break
        assert frame.view == 2 and frame.image.view == 2 and not np.array_equal(frame.image.rgb, first.rgb)
        session.set(until=hg.Samples(10**8))
        session.camera.orbit(30)
        image = session.image()
        assert image is None or image.view == session.view
        eventually(lambda: session.image() is not None)
        assert session.image().view == session.view == 4 and session.stats.samples > 0
        session.camera.orbit(-30)
        session.wait(samples=4)
        assert session.image().view == session.view


def test_edits_show_in_the_session(client, box):
    with box.session(size=SIZE, until=hg.Samples(16), mode="combined") as session:
        before = session.wait().rgb.mean(axis=(0, 1))
        session.edit(materials={"red": {"base_color": (0.05, 0.05, 0.9)}})
        after = session.wait().rgb.mean(axis=(0, 1))
        assert session.scene.info.edited_from == box.id
        assert after[2] > 1.1 * before[2] and after[0] < before[0]
        session.scene = box
        assert session.scene.id == box.id


def test_two_sessions_in_two_threads(box):
    stills = {seed: box.render(size=SIZE, until=hg.Samples(8), seed=seed).rgb for seed in (1, 2)}
    wrong = []

    def work(seed):
        try:
            for _ in range(3):
                with box.session(size=SIZE, seed=seed, until=hg.Samples(4)) as session:
                    if not np.array_equal(session.wait(samples=8).rgb, stills[seed]):
                        wrong.append(seed)
        except Exception as error:
            wrong.append(error)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in stills]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not wrong


def test_what_waits_to_be_sent_is_the_newest_of_each_kind():
    """In the order of the last changes, so that a view is behind the budget that it was sent after."""
    from heliograph.outbox import Outbox
    from heliograph.v1 import frame_stream_pb2 as stream
    from heliograph.v1 import types_pb2 as types

    outbox = Outbox()
    for number in range(1, 1000):
        outbox.put(stream.StreamRequest(budget=types.Budget(samples=number)))
        outbox.put(stream.StreamRequest(view=types.View(id=number)))
    assert len(outbox) == 2
    outbox.end()
    outbox.put(stream.StreamRequest(view=types.View(id=5000)))
    assert [outbox.take().budget.samples, outbox.take().view.id, outbox.take()] == [999, 999, None]


def test_a_budget_that_is_reached_already_ends_at_once(box):
    with box.session(size=SIZE, seed=7, until=hg.Samples(16)) as session:
        image = session.wait(samples=16)
        again = session.wait(samples=4, timeout=20)
        assert again.stats.samples == 16 and np.array_equal(again.rgb, image.rgb)
        assert session.wait(error=10, timeout=20).stats.ended_by == "error"
        assert np.array_equal(session.image().rgb, image.rgb)


def test_a_forgotten_session_is_closed(client, box):
    before = references(client, box)
    session = box.session(size=SIZE)
    next(session.frames())
    assert session_threads() and references(client, box) == before + 1
    del session
    gc.collect()
    eventually(lambda: not session_threads())
    eventually(lambda: references(client, box) == before)


def test_a_closed_session_says_so(client, box):
    with box.session(size=SIZE) as session:
        session.close()
        session.close()
    for use in (lambda: session.camera.orbit(1), lambda: session.wait(samples=1), lambda: session.set(seed=1)):
        with pytest.raises(hg.FailedPrecondition, match="this session is closed"):
            use()
    eventually(lambda: not session_threads())


def test_a_session_that_is_taken_over_is_told(client, box):
    """A second stream on the session, as another program would open it."""
    from heliograph.v1 import frame_stream_pb2 as stream

    with box.session(size=SIZE, until=hg.Samples(4)) as session:
        session.wait()
        other = client._connection.open(
            "StreamFrames", iter([stream.StreamRequest(open=stream.StreamRequest.Open(session_id=session.id))])
        )
        with pytest.raises(hg.FailedPrecondition, match="(?i)stream|attached|taken"):
            for _ in range(100):
                session.camera.orbit(1)
                time.sleep(0.1)
        other.cancel()


def test_a_session_ends_with_its_client(program, box):
    from conftest import BOX

    client = hg.serve(program)
    session = client.session(BOX, size=SIZE)
    client.close()
    client.close()
    assert not client.daemon.running
    with pytest.raises(hg.HeliographError):
        session.wait(samples=1)
    with pytest.raises(hg.FailedPrecondition, match="this client is closed"):
        client.info()


def test_a_daemon_that_dies_is_told(program):
    import os
    import signal

    from conftest import BOX

    with hg.serve(program) as client:
        session = client.session(BOX, size=SIZE)
        next(session.frames())
        os.killpg(client.daemon._process.pid, signal.SIGKILL)
        with pytest.raises(hg.Unavailable):
            session.wait(samples=10**9, timeout=30)
