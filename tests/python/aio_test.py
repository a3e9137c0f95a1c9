"""The asyncio form: the same pictures, events, errors and names."""

import asyncio
import gc
import inspect
import json
import time

import numpy as np
import pytest
from conftest import BOX, ROOT

import heliograph
import heliograph.aio as hg
from heliograph import operations

SIZE = (64, 48)


@pytest.fixture(scope="module")
def address(client):
    return client.address, client.daemon.token


def run(address, work):
    async def main():
        async with await hg.connect(address[0], token=address[1]) as client:
            return await asyncio.wait_for(work(client, await client.load(BOX)), 60)

    return asyncio.run(main())


def test_names_and_arguments_are_the_same():
    assert set(hg.__all__) == set(heliograph.__all__)
    for name in ("Client", "Session", "Job", "KeptJob", "Scene"):
        blocking, form = getattr(heliograph, name), getattr(hg, name)
        members = {member for member in dir(blocking) if not member.startswith("_")}
        assert members == {member for member in dir(form) if not member.startswith("_")}, name
        for member in members:
            if inspect.isfunction(getattr(blocking, member)):
                assert (
                    inspect.signature(getattr(blocking, member)).parameters.keys()
                    == inspect.signature(getattr(form, member)).parameters.keys()
                ), member
    for name in ("compare", "connect", "serve"):
        assert (
            inspect.signature(getattr(heliograph, name)).parameters == inspect.signature(getattr(hg, name)).parameters
        )


def test_pictures_side_by_side(address, box):
    async def work(client, scene):
        return await asyncio.gather(*(scene.render(size=SIZE, until=hg.Samples(4), seed=seed) for seed in (1, 2, 1)))

    one, two, again = run(address, work)
    assert np.array_equal(one.rgb, again.rgb) and not np.array_equal(one.rgb, two.rgb)
    assert np.array_equal(one.rgb, box.render(size=SIZE, until=hg.Samples(4), seed=1).rgb)


def test_session(address):
    async def work(client, scene):
        async with await scene.session(size=SIZE, until=hg.Samples(8), seed=1) as session:
            still = await scene.render(size=SIZE, until=hg.Samples(8), seed=1)
            assert np.array_equal((await session.wait()).rgb, still.rgb)
            session.camera.orbit(10)
            async for frame in session.frames(timeout=20):
                if frame.kind == "end" and frame.view == 2:
                    break
            assert frame.image.stats.samples == 8
            await session.edit(materials={"red": {"base_color": (0, 0, 1)}})
            assert (await session.wait(samples=9)).stats.samples == 9
            with pytest.raises(hg.DeadlineExceeded):
                await session.wait(samples=10**9, timeout=0.1)
            for _ in range(3):  # the newest of each kind alone
                session.camera.orbit(1)
                await session.wait(samples=1)
            assert len(session._core.buffer) <= 3
        with pytest.raises(hg.FailedPrecondition, match="closed"):
            await session.wait(samples=1)

    run(address, work)


def test_loading_leaves_the_loop_alone(address, tmp_path, monkeypatch):
    """While files are looked through, hashed and read."""
    scene = json.loads(BOX.read_text())
    scene["extras"] = "another scene"
    (tmp_path / "scene.gltf").write_text(json.dumps(scene))
    slow = set()

    def slowed(function):
        def work(*arguments):
            slow.add(function.__name__)
            time.sleep(0.3)
            return function(*arguments)

        return work

    for name in ("collect", "_hash"):
        monkeypatch.setattr(operations, name, slowed(getattr(operations, name)))

    async def work(client, _):
        longest = 0.0

        async def beat():
            nonlocal longest
            last = time.monotonic()
            while True:
                await asyncio.sleep(0.005)
                longest, last = max(longest, time.monotonic() - last), time.monotonic()

        heart = asyncio.create_task(beat())
        await asyncio.sleep(0.05)
        scene = await client.load(tmp_path / "scene.gltf")
        heart.cancel()
        await client.unload(scene)
        return longest

    assert run(address, work) < 0.25 and slow == {"collect", "_hash"}


def test_a_refused_setting_is_told_once(address):
    async def work(client, scene):
        async with await scene.session(size=SIZE, until=hg.Samples(4)) as session:
            before = await session.wait()
            session.set(roulette_from=70000)
            with pytest.raises(hg.InvalidArgument) as told:
                await session.wait(timeout=20)
            assert told.value.field == "roulette_from"
            assert np.array_equal((await session.wait(timeout=20)).rgb, before.rgb)

    run(address, work)


def test_a_cancelled_path_ends(address):
    async def work(client, scene):
        views = [scene.camera().orbit(step) for step in range(30)]
        async with await scene.submit(size=(8, 8), until=hg.Samples(1), views=views) as job:
            while len(job._state.done) < 2:
                await asyncio.sleep(0.01)
            await job.cancel()
            taken = 0
            with pytest.raises(hg.Cancelled):
                async for _ in job.images(timeout=20):
                    taken += 1
            assert taken == 2 and job.done

    run(address, work)


def test_job_and_camera_path(address):
    async def work(client, scene):
        views = [scene.camera().orbit(step) for step in range(5)]
        async with await scene.submit(size=SIZE, until=hg.Samples(2), views=views) as job:
            images = [image async for image in job.images(timeout=20)]
        assert len(images) == 5 and job.done
        endless = await scene.submit(size=(256, 256), until=hg.Samples(10**8))
        await endless.close()
        with pytest.raises(hg.Cancelled):
            await endless.result()
        with pytest.raises(hg.InvalidArgument, match="size: 1000000"):
            await scene.submit(size=(10**6, 1), until=hg.Samples(1))

    run(address, work)


def test_cancelling_a_task_cancels_on_the_daemon(address, client):
    def users():
        return sum(scene.info.references for scene in client.scenes())

    before = users()

    async def work(asynchronous, scene):
        task = asyncio.create_task(scene.render(size=(256, 256), until=hg.Samples(10**8)))
        while (await asynchronous.scenes()) and users() == before:
            await asyncio.sleep(0.02)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        for _ in range(500):
            if users() == before:
                return
            await asyncio.sleep(0.02)
        raise AssertionError("the job goes on")

    run(address, work)


def test_a_forgotten_session_is_closed(address, client):
    async def work(asynchronous, scene):
        session = await scene.session(size=SIZE)
        await session.wait(samples=1)
        session_id = session.id
        del session
        gc.collect()
        from heliograph.v1 import render_service_pb2 as service

        for _ in range(500):
            listed = client._connection.stub.ListSessions(
                service.ListSessionsRequest(), metadata=client._connection.metadata
            )
            if session_id not in [other.session_id for other in listed.sessions]:
                return
            await asyncio.sleep(0.02)
        raise AssertionError("the session goes on")

    run(address, work)


def test_errors(address, tmp_path):
    async def work(client, scene):
        with pytest.raises(hg.NotFound, match="no such file"):
            await client.load(tmp_path / "none.gltf")
        with pytest.raises(hg.InvalidArgument) as told:
            await scene.render(size=(8, 8), until=hg.Samples(1), max_segments=70000)
        assert told.value.field == "max_segments"
        with pytest.raises(hg.InvalidArgument, match="what load"):
            await client.render(5, until=hg.Samples(1))
        (tmp_path / "broken.gltf").write_text("{")
        with pytest.raises(hg.InvalidArgument, match="broken.gltf"):
            await client.load(tmp_path / "broken.gltf")

    run(address, work)
    with pytest.raises(hg.PermissionDenied):
        asyncio.run(hg.connect(address[0], token="x" * 20))
    with pytest.raises(hg.Unavailable, match="no daemon answers"):
        asyncio.run(hg.connect("127.0.0.1:1"))
    with pytest.raises(hg.Unavailable):
        asyncio.run(hg.connect("127.0.0.1:1", tls=True))


def test_serve(program):
    async def main():
        async with await hg.serve(program, scene_roots=ROOT / "scenes") as client:
            scene = await client.load("cornell-box/cornell-box.gltf", on_server=True)
            return (await scene.render(size=(8, 8), until=hg.Samples(1))).shape, client.daemon

    shape, daemon = asyncio.run(main())
    assert shape == (8, 8) and not daemon.running
