"""The widget for notebooks without a browser: its modules, what pages are sent, and what they ask for."""

import asyncio
import gc
import re
import sys
import time
import zipfile

import pytest

import heliograph as hg
from heliograph import aio, notebook, pages
from heliograph.frames import Frame
from heliograph.stats import Stats
from heliograph.tiles import Lazy, Tiles
from conftest import BOX, ROOT, eventually

FIRST, SECOND = b"tile at the left", b"tile at the right"


def frame(number, view=1, kind="film", files=(FIRST, SECOND), stats=None):
    """An event of two tiles."""
    windows = [hg.Window(0, 0, 8, 8), hg.Window(8, 0, 16, 8)]
    tiles = Tiles((16, 8), hg.Window(0, 0, 16, 8), tuple(zip(windows, files)))
    return Frame(kind, view, number, stats or Stats(), False, "", (), (), 0, tiles, Lazy(tiles))


def fresh(*texts):
    """Bytes of their own, as those of a new tile."""
    return tuple(bytes(bytearray(text)) for text in texts)


class Sent(list):
    """The messages of a widget, with their buffers."""

    def __call__(self, message, buffers):
        self.append((message, list(buffers)))

    def kinds(self, page="a"):
        return [message["kind"] for message, _ in self if message["page"] == page]

    def pictures(self, page="a"):
        return [(m["picture"], m["frame"], b) for m, b in self if m["kind"] == "picture" and m["page"] == page]


@pytest.fixture
def quiet(box):
    """A session whose own pictures are over, so that a test decides what comes."""
    with box.session(size=(16, 8), until=hg.Samples(1)) as session:
        session.wait()
        session._core.feed._film = None
        yield session


@pytest.fixture
def shown(quiet):
    sent = Sent()
    widget = pages.Pages(quiet, sent)
    yield quiet, widget, sent
    widget.close()


def come(session, *events):
    for observer in session._core._observers:
        observer(events)


def test_modules_are_linked_and_in_the_wheel(pytestconfig):
    module, style = notebook.front_end()
    assert module.endswith(".default;\n") and not re.search(r"^import ", module, re.MULTILINE)
    for name in ("widget/stage.js", "web/picture/picture.js", "web/camera/camera.js", "web/vendor/fflate.js"):
        assert f"// {name}\n" in module
    assert ".heliograph-stage" in style
    names = zipfile.ZipFile(pytestconfig.getoption("--wheel")).namelist()
    linked = set(re.findall(r"^// ((?:web|widget)/\S+\.js)$", module, re.MULTILINE))
    assert {f"heliograph/{name}" for name in linked} <= set(names)
    assert "heliograph/web/vendor/fflate.LICENSE" in names and "heliograph/widget/widget.css" in names
    for name in linked:  # the page's own modules, not copies that have gone their own ways
        if name.startswith("web/"):
            packed = zipfile.ZipFile(pytestconfig.getoption("--wheel")).read(f"heliograph/{name}")
            assert packed == (ROOT / "client" / name).read_bytes()


def test_channels_are_those_of_the_page():
    text = (ROOT / "client" / "web" / "picture" / "channels.js").read_text()
    assert notebook.CHANNELS == tuple(re.findall(r"^    id: '(\w+)'", text, re.MULTILINE))


def test_without_anywidget_show_says_how_to_install_it(quiet, monkeypatch):
    monkeypatch.setitem(sys.modules, "anywidget", None)
    notebook._widget_class.cache_clear()
    with pytest.raises(hg.MissingPackage, match=r"pip install 'heliograph\[notebook\]'") as caught:
        quiet.show()
    assert isinstance(caught.value, ImportError)
    notebook._widget_class.cache_clear()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"exposure": 13}, r"exposure: 13; allowed: \[-12, 12\] stops"),
        ({"exposure": "bright"}, "exposure: bright; allowed"),
        ({"exposure": float("nan")}, "exposure: nan; allowed"),
        ({"channel": "sigma"}, "channel: sigma; allowed: display, radiance, error"),
    ],
)
def test_bad_arguments_are_refused(quiet, arguments, told):
    with pytest.raises(hg.InvalidArgument, match=told):
        quiet.show(**arguments)


def test_a_page_has_two_pictures_in_flight_and_gets_the_newest(shown):
    session, widget, sent = shown
    come(session, frame(1))
    assert sent == []  # no page
    widget.receive({"kind": "open", "page": "a"})
    assert sent.pictures() == [(1, 1, [FIRST, SECOND])]
    come(session, frame(2, files=fresh(FIRST, SECOND)))
    for number in (3, 4, 5):
        come(session, frame(number, files=fresh(FIRST, SECOND)))
    assert [number for _, number, _ in sent.pictures()] == [1, 2]
    widget.receive({"kind": "drawn", "page": "a", "picture": 1})
    assert [number for _, number, _ in sent.pictures()] == [1, 2, 5]
    widget.receive({"kind": "drawn", "page": "a", "picture": 1})  # told twice: no more credit
    widget.receive({"kind": "drawn", "page": "a", "picture": 77})
    come(session, frame(6, files=fresh(FIRST, SECOND)))
    assert [number for _, number, _ in sent.pictures()] == [1, 2, 5]
    widget.receive({"kind": "drawn", "page": "a", "picture": 2})
    widget.receive({"kind": "drawn", "page": "a", "picture": 3})
    assert [number for _, number, _ in sent.pictures()] == [1, 2, 5, 6]


def test_tiles_that_a_page_has_are_not_sent_again(shown):
    session, widget, sent = shown
    left, right = fresh(FIRST, SECOND)
    newer = fresh(SECOND)[0]
    come(session, frame(4, files=(left, right)))
    widget.receive({"kind": "open", "page": "a"})
    come(session, frame(4, files=(left, newer)))
    assert [buffers for _, _, buffers in sent.pictures()] == [[left, right], [newer]]
    widget.receive({"kind": "drawn", "page": "a", "picture": 1})
    come(session, frame(4, kind="end", files=(left, newer), stats=Stats(ended_by="samples", samples=9, error=0.5)))
    message, buffers = sent[-1]
    assert buffers == [] and message["status"]["ended_by"] == "samples" and message["status"]["error"] == 0.5
    widget.receive({"kind": "open", "page": "b"})  # another one has none of them
    assert sent.pictures("b") == [(1, 4, [left, newer])]


def test_what_a_newer_view_replaced_is_not_shown_again(shown):
    session, widget, sent = shown
    widget.receive({"kind": "open", "page": "a"})
    come(session, frame(3, view=2, kind="preview"))
    come(session, frame(1, view=1, kind="end", stats=Stats(ended_by="superseded")))
    assert [number for _, number, _ in sent.pictures()] == [3]
    come(session, frame(4, view=2), frame(5, view=2, kind="preview"))
    assert [(m["frame"], m["preview"]) for m, _ in sent] == [(3, True), (4, False)]


def test_a_closed_page_and_a_closed_widget_get_nothing(shown):
    session, widget, sent = shown
    widget.receive({"kind": "open", "page": "a"})
    widget.receive({"kind": "open", "page": "b"})
    widget.receive({"kind": "close", "page": "a"})
    come(session, frame(1))
    assert sent.kinds("a") == [] and sent.kinds("b") == ["picture"]
    widget.close()
    assert session._core._observers == ()
    come(session, frame(2))
    widget.receive({"kind": "open", "page": "c"})
    assert sent.kinds("c") == [] and len(sent) == 1


def test_pages_are_bounded(shown, monkeypatch):
    _, widget, _ = shown
    for number in range(20):
        widget.receive({"kind": "open", "page": f"page {number}"})
    assert widget.names == [f"page {number}" for number in range(12, 20)]
    widget.receive({"kind": "drawn", "page": "page 3", "picture": 1})  # it is alive: opened again
    assert "page 3" in widget.names and len(widget.names) == pages.MOST_PAGES


def test_a_page_that_went_without_a_word_makes_room(shown, monkeypatch):
    session, widget, _ = shown
    come(session, frame(1))
    widget.receive({"kind": "open", "page": "gone"})
    later = time.monotonic() + pages.FORGOTTEN_S + 1
    monkeypatch.setattr(pages.time, "monotonic", lambda: later)
    widget.receive({"kind": "open", "page": "new"})
    assert widget.names == ["new"]


def test_a_page_that_cannot_be_reached_does_not_harm_the_session(quiet):
    def fail(message, buffers):
        raise OSError("the kernel is gone")

    widget = pages.Pages(quiet, fail)
    come(quiet, frame(1))
    widget.receive({"kind": "open", "page": "a"})
    come(quiet, frame(2))
    assert widget.names == [] and quiet._core.error is None
    widget.close()


CAMERA = {
    "view": {
        "position": {"x": 1, "y": 2, "z": 3},
        "look_at": {"target": {"x": 1, "y": 2, "z": 0}, "up": {"x": 0, "y": 1, "z": 0}},
        "vertical_fov": 0.5,
    },
    "pivot": [1, 2, -5],
}


def test_a_page_moves_the_camera(shown):
    session, widget, sent = shown
    widget.receive({"kind": "open", "page": "a"})
    widget.receive({"kind": "camera", "page": "a", "move": 1, "camera": CAMERA})
    assert sent[-1][0] == {"kind": "moved", "page": "a", "move": 1}
    assert session.camera.position == (1, 2, 3) and session.camera.forward == (0, 0, -1)
    assert session.camera.pivot == (1, 2, -5) and abs(session.camera.value.view.vertical_fov - 0.5) < 1e-12
    view = session._core._view
    end = eventually(lambda: next((m for m, _ in sent if m["kind"] == "picture" and m["view"] == view), None))
    assert end["move"] == 1 and end["camera"]["pivot"] == [1, 2, -5] and end["bounds"][0]["x"] < end["bounds"][1]["x"]
    # What is told is what it takes.
    session.camera.orbit(10)
    widget.receive({"kind": "camera", "page": "a", "move": 2, "camera": pages._camera_message(session.camera.value)})
    assert pages._camera_message(session.camera.value)["view"]["vertical_fov"] == pytest.approx(0.5, abs=1e-12)


@pytest.mark.parametrize(
    ("message", "told"),
    [
        ({"kind": "jump"}, "kind: jump; allowed: 'open', 'drawn', 'camera', 'close'"),
        ({"kind": "drawn"}, "picture: None; allowed: whole numbers"),
        ({"kind": "camera", "move": 1}, "camera: None; allowed: a CameraView"),
        ({"kind": "camera", "move": -1, "camera": CAMERA}, "move: -1; allowed"),
        ({"kind": "camera", "move": 1, "camera": {**CAMERA, "pivot": [1, 2]}}, "pivot: [1, 2]; allowed"),
        ({"kind": "camera", "move": 1, "camera": {**CAMERA, "pivot": [1, 2, 1e13]}}, "allowed: three finite numbers"),
        (
            {"kind": "camera", "move": 1, "camera": {**CAMERA, "view": {**CAMERA["view"], "lens_radius": -1}}},
            "lens_radius: -1.0; allowed: [0, 1e+12]",
        ),
        (
            {"kind": "camera", "move": 1, "camera": {**CAMERA, "view": {**CAMERA["view"], "vertical_fov": 9}}},
            "allowed: [0.0975, 179] degrees",
        ),
    ],
)
def test_what_is_wrong_with_a_message_is_told_on_the_page(shown, message, told):
    session, widget, sent = shown
    before = session.camera.value
    widget.receive({"page": "a", **message})
    problems = [m["text"] for m, _ in sent if m["kind"] == "problem"]
    assert len(problems) == 1 and told in problems[0]
    assert session.camera.value == before and session._core.error is None
    if message.get("move") == 1:
        assert {"kind": "moved", "page": "a", "move": 1} in [m for m, _ in sent]  # or the page would wait for ever


@pytest.mark.parametrize("message", [None, 3, [], {}, {"kind": "open"}, {"kind": "open", "page": "x" * 65}])
def test_messages_of_no_page_are_ignored(shown, message):
    _, widget, sent = shown
    widget.receive(message)
    assert sent == [] and widget.names == []


def test_widgets_and_frames_see_all_events(box):
    """Two widgets and a loop over one session: none takes an event from another."""
    with box.session(size=(64, 64), until=hg.Samples(8), buffer=1024) as session:
        sent = [Sent(), Sent()]
        widgets = [pages.Pages(session, each) for each in sent]

        def draw():
            for each, widget in zip(sent, widgets):
                for number, _, _ in each.pictures():
                    widget.receive({"kind": "drawn", "page": "a", "picture": number})

        for widget in widgets:
            widget.receive({"kind": "open", "page": "a"})
        kinds = []
        for event in session.frames(timeout=30):
            kinds.append(event.kind)
            draw()
            if event.kind == "end":
                break
        assert kinds[-1] == "end" and "film" in kinds
        last = session._core.feed.latest().tiles.files
        for each in sent:
            eventually(lambda each=each: draw() or each[-1][0]["status"]["ended_by"] == "samples")
            newest = {}
            for message, buffers in each:
                for data in buffers:
                    newest[data] = message["frame"]
            assert {data for _, data in last} <= set(newest)  # bytes as the daemon sent them
            assert bytes(next(iter(newest))).startswith(b"\x76\x2f\x31\x01")
        for widget in widgets:
            widget.close()


def test_the_widget_says_that_the_session_ended(box):
    with box.session(size=(16, 8), until=hg.Samples(1)) as session:
        session.wait()
        sent = Sent()
        widget = pages.Pages(session, sent)
        widget.receive({"kind": "open", "page": "a"})
    assert sent.kinds() == ["picture", "ended"] and sent[-1][0]["text"] == "The session is closed."
    widget.receive({"kind": "open", "page": "late"})  # of a kernel that was busy: the last picture all the same
    assert sent.kinds("late") == ["picture", "ended"]
    widget.receive({"kind": "camera", "page": "a", "move": 1, "camera": CAMERA})
    assert [m["text"] for m, _ in sent if m["kind"] == "problem"] == ["this session is closed"]
    for page in ("a", "late"):
        widget.receive({"kind": "close", "page": page})
    assert widget._core is None and widget._newest is None  # costs nothing any more
    widget.receive({"kind": "open", "page": "later"})
    assert sent.kinds("later") == ["ended"]
    with pytest.raises(hg.FailedPrecondition, match="this session is closed"):
        session.show()


def test_the_widget_says_what_was_refused_and_why_the_session_ended(client, box):
    from heliograph.v1 import frame_stream_pb2 as stream

    sent = Sent()
    with box.session(size=(16, 8), until=hg.Samples(1)) as session:
        session.wait()
        widget = pages.Pages(session, sent)
        widget.receive({"kind": "open", "page": "a"})
        session.set(max_segments=100000)
        eventually(lambda: "problem" in sent.kinds())
        assert [m["text"] for m, _ in sent if m["kind"] == "problem"] == ["max_segments: 100000; allowed: [1, 65535]"]
        assert "ended" not in sent.kinds()
        taken = stream.StreamRequest(open=stream.StreamRequest.Open(session_id=session.id))
        other = client._connection.open("StreamFrames", iter([taken]))
        numbers = iter(range(1, 10**6))
        eventually(
            lambda: "ended" in sent.kinds() or widget.receive({"kind": "drawn", "page": "a", "picture": next(numbers)})
        )
        assert "The session ended: " in [m["text"] for m, _ in sent if m["kind"] == "ended"][0]
        other.cancel()


def test_a_session_lives_while_a_page_shows_it(box):
    session = box.session(size=(16, 8), until=hg.Samples(1))
    session.wait()
    core = session._core
    widget = pages.Pages(session, Sent())
    widget.receive({"kind": "open", "page": "a"})
    del session
    gc.collect()
    assert not core.closing
    widget.receive({"kind": "close", "page": "a"})
    gc.collect()
    assert core.closing
    eventually(lambda: core.over)
    widget.close()


def test_sessions_of_asyncio_are_shown_too(client):
    async def run():
        async with await aio.connect(client.address, token=client.daemon.token) as remote:
            scene = await remote.load(BOX)
            async with await remote.session(scene, size=(16, 8), until=hg.Samples(1)) as session:
                sent = Sent()
                widget = pages.Pages(session, sent)
                widget.receive({"kind": "open", "page": "a"})
                await session.wait()
                widget.receive({"kind": "drawn", "page": "a", "picture": 1})
                move = {"kind": "camera", "page": "a", "move": 1, "camera": CAMERA}
                await asyncio.get_running_loop().run_in_executor(None, widget.receive, move)
                view = session._core._view
                async for event in session.frames(timeout=20):
                    widget.receive({"kind": "drawn", "page": "a", "picture": len(sent.pictures())})
                    if event.view == view and event.kind == "end":
                        break
        assert sent.kinds()[-1] == "ended"
        assert [m["view"] for m, _ in sent if m["kind"] == "picture"][-1] == view
        widget.close()

    asyncio.run(run())


def test_widgets_of_a_session_are_bounded(quiet):
    made = [pages.Pages(quiet, Sent()) for _ in range(64)]
    with pytest.raises(hg.FailedPrecondition, match="64 widgets and viewers show this session already"):
        pages.Pages(quiet, Sent())
    for widget in made:
        widget.close()
    pages.Pages(quiet, Sent()).close()


def test_the_widget_itself(box, monkeypatch):
    anywidget = pytest.importorskip("anywidget")
    sent = Sent()
    monkeypatch.setattr(anywidget.AnyWidget, "send", lambda self, message, buffers=None: sent(message, buffers or ()))
    with box.session(size=(16, 8), until=hg.Samples(1)) as session:
        session.wait()
        widget = session.show(exposure=1.5, channel="error")
        assert (widget.exposure, widget.channel) == (1.5, "error") and widget._esm and widget._css
        widget._handle_custom_msg({"kind": "open", "page": "a"}, [])
        assert sent.kinds() == ["picture"]
        for name, value in (("exposure", 20.0), ("channel", "none such")):
            with pytest.raises(hg.InvalidArgument, match=f"{name}: {value}; allowed"):
                setattr(widget, name, value)
        widget.close()
        assert widget.pages.names == [] and session._core._observers == ()
        widget.close()
        assert session._core.error is None and session.image() is not None
