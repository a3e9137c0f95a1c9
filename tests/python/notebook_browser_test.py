"""The widget in Chromium (full tier): its module with a model as anywidget's, and a session behind it.

A server of this test stands for the kernel: it hands the messages of heliograph.pages on, and takes those of the page.
"""

import base64
import http.server
import json
import os
import pathlib
import queue
import struct
import sys
import threading
import time

import numpy as np
import pytest

import heliograph as hg
from heliograph import notebook, pages
from heliograph.display import srgb_bytes
from conftest import ROOT, eventually

sys.path.insert(0, str(ROOT / "tests" / "browser"))
import browser  # noqa: E402

try:
    from selenium.webdriver import ActionChains, Keys
except ImportError:
    ActionChains = Keys = None  # browser.missing() tells

pytestmark = pytest.mark.skipif(os.environ.get("HELIO_TEST_TIER") != "full", reason="of the full tier")

# A message comes as the length of its text, the text, and for each buffer its length and its bytes.
PAGE = """<!doctype html><meta charset="utf-8"><title>widget</title><link rel="stylesheet" href="/widget.css">
<body style="font: 14px sans-serif; width: 600px"><div id="one"></div><div id="two"></div>
<script type="module">
import widget from '/widget.js';
class Model {
  constructor(values) { this.values = values; this.listeners = new Map(); this.saved = []; }
  get(name) { return this.values[name]; }
  set(name, value) { this.values[name] = value; this.tell(`change:${name}`); }
  save_changes() { this.saved.push({ ...this.values }); }
  of(event) { return this.listeners.get(event) ?? []; }
  on(event, listener) { this.listeners.set(event, [...this.of(event), listener]); }
  off(event, listener) { this.listeners.set(event, this.of(event).filter((other) => other !== listener)); }
  tell(event, ...what) { for (const listener of this.of(event)) listener(...what); }
  send(message) {
    sent.push(message);
    chain = chain.then(() => fetch('/message', { method: 'POST', body: JSON.stringify(message) }));
  }
}
let chain = Promise.resolve();
const sent = [], got = [];
const model = new Model({ exposure: 0, channel: '' });
globalThis.test = { model, sent, got };
test.close = await widget.render({ model, el: document.getElementById('one') });
test.more = async () => { test.closeSecond = await widget.render({ model, el: document.getElementById('two') }); };
const text = new TextDecoder();
for (;;) {
  const answer = await fetch('/next');
  if (!answer.ok) break;
  const bytes = await answer.arrayBuffer(), view = new DataView(bytes);
  let at = 0;
  const part = () => {
    const size = view.getUint32(at, true), begin = at + 4;
    at = begin + size;
    return new DataView(bytes, begin, size);
  };
  while (at < bytes.byteLength) {
    const message = JSON.parse(text.decode(part())), buffers = [];
    for (let i = 0; i < message.buffers; i++) buffers.push(part());
    got.push(message);
    model.tell('msg:custom', message, buffers);
  }
}
</script>
"""


class Kernel:
    """Serves the page of one widget."""

    def __init__(self, session):
        self.waiting = queue.Queue()
        self.widget = pages.Pages(session, lambda message, buffers: self.waiting.put((message, list(buffers))))
        module, style = notebook.front_end()
        texts = {
            "/": ("text/html", PAGE),
            "/widget.js": ("text/javascript", module),
            "/widget.css": ("text/css", style),
        }
        kernel = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def answer(self, kind, body, status=200):
                self.send_response(status)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body)

            def do_GET(self):
                if self.path in texts:
                    kind, text = texts[self.path]
                    self.answer(f"{kind}; charset=utf-8", text.encode())
                elif self.path == "/next":
                    self.answer("application/octet-stream", kernel.next())
                else:
                    self.answer("text/plain", b"", 204)

            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                kernel.widget.receive(json.loads(body))
                self.answer("text/plain", b"ok")

            def log_message(self, *arguments):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.thread = threading.Thread(target=self.server.serve_forever, daemon=True)
        self.thread.start()
        self.address = f"http://127.0.0.1:{self.server.server_address[1]}/"

    def next(self):
        """Messages that wait, or none after a while."""
        try:
            message, buffers = self.waiting.get(timeout=2)
        except queue.Empty:
            return b""
        text = json.dumps({**message, "buffers": len(buffers)}).encode()
        return b"".join(struct.pack("<I", len(part)) + bytes(part) for part in (text, *buffers))

    def stop(self):
        self.widget.close()
        self.server.shutdown()
        self.server.server_close()
        self.thread.join()


@pytest.fixture(scope="module")
def tab(pytestconfig):
    """Chromium; its screenshots are left beside the wheel."""
    lack = browser.missing()
    if lack:
        pytest.skip(lack)
    page = browser.Page(pathlib.Path(pytestconfig.getoption("--wheel")).parent / "screenshots")
    yield page
    page.close()


@pytest.fixture
def session(box):
    with box.session(size=(240, 160), channels=("display", "depth"), preview_rate=20, until=hg.Samples(16)) as session:
        yield session


@pytest.fixture
def shown(tab, session):
    kernel = Kernel(session)
    tab.open(kernel.address)
    tab.wait("!!globalThis.test?.close")
    yield kernel
    tab.open("about:blank")
    kernel.stop()


def status(tab, place="#one"):
    return tab.run(f"return document.querySelector('{place} .heliograph-status')?.textContent ?? ''")


def problem(tab):
    return tab.run("return document.querySelector('#one .heliograph-problem')?.textContent")


def seen(tab, name):
    """What a person sees of the picture: H x W x 3 bytes, decoded by the browser."""
    tab.run("document.activeElement.blur()")  # whose mark is drawn over it
    tab.screenshot(name)
    shot = tab.driver.find_element("css selector", "#one .heliograph-stage").screenshot_as_base64
    width, height, pixels = tab.driver.execute_async_script(
        """const [shot, done] = arguments;
        const file = new Blob([Uint8Array.from(atob(shot), (c) => c.charCodeAt(0))], { type: 'image/png' });
        createImageBitmap(file).then((bitmap) => {
          const g = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d');
          g.drawImage(bitmap, 0, 0);
          const { data } = g.getImageData(0, 0, bitmap.width, bitmap.height);
          let text = '';
          for (let i = 0; i < data.length; i += 4096) text += String.fromCharCode(...data.subarray(i, i + 4096));
          done([bitmap.width, bitmap.height, btoa(text)]);
        });""",
        shot,
    )
    return np.frombuffer(base64.b64decode(pixels), np.uint8).reshape(height, width, 4)[..., :3]


def is_shown(tab, session, name, what, stops=0):
    """The film's pixels are on the screen."""
    tab.wait("document.querySelector('#one .heliograph-status').textContent.startsWith('all samples taken')")
    expected = srgb_bytes(getattr(session.wait(), what), 2.0**stops).astype(int)

    def same():
        found = seen(tab, name).astype(int)
        return found.shape == expected.shape and abs(found - expected).mean() < 1

    eventually(same)


def drag(tab, x, y, *, shift=False):
    chain = ActionChains(tab.driver)
    if shift:
        chain.key_down(Keys.SHIFT)
    element = tab.driver.find_element("css selector", "#one .heliograph-input")
    chain.move_to_element(element).click_and_hold()
    for _ in range(4):
        chain.move_by_offset(x // 4, y // 4)
    chain.release()
    if shift:
        chain.key_up(Keys.SHIFT)
    chain.perform()


def test_the_picture_is_that_of_the_session(tab, shown, session):
    is_shown(tab, session, "widget", "display")
    assert "240 × 160 · 16 samples · error 0." in status(tab)
    choices = tab.run("return [...document.querySelector('#one select').options].map((option) => option.value)")
    assert choices == ["display", "radiance", "error", "relative", "displayerror", "samples", "depth"]
    tab.run(
        "const s = document.querySelector('#one select'); s.value = 'radiance'; s.dispatchEvent(new Event('change'))"
    )
    is_shown(tab, session, "widget-radiance", "rgb")
    tab.run(
        """const s = document.querySelector('#one input[type=range]'); s.value = 1.5;
        s.dispatchEvent(new Event('input')); s.dispatchEvent(new Event('change'));"""
    )
    is_shown(tab, session, "widget-exposure", "rgb", 1.5)
    assert tab.run("return test.model.saved.at(-1)") == {"exposure": 1.5, "channel": "radiance"}
    tab.run("test.model.set('channel', 'error')")  # as Python does
    tab.wait("!document.querySelector('#one .heliograph-scale').hidden")
    low, high = (
        float(tab.run(f"return document.querySelectorAll('#one .heliograph-scale span')[{i}].textContent"))
        for i in (0, 1)
    )
    sigma = np.sqrt((session.wait().variance).mean(axis=2))
    assert low < np.median(sigma[sigma > 0]) < high <= 1.1 * np.percentile(sigma, 99.5)
    tab.run("test.model.set('channel', 'normal')")
    tab.wait("document.querySelector('#one .heliograph-note').textContent === 'The session has no channel normal.'")
    assert problem(tab) == "" and tab.errors() == []


def test_drags_and_the_wheel_move_the_session(tab, shown, session):
    tab.wait("test.got.length > 0")
    start = session.camera.value
    drag(tab, 80, 0)
    eventually(lambda: session.camera.value != start)
    eventually(lambda: tab.run("return test.got.at(-1).move === test.sent.filter((m) => m.kind === 'camera').length"))
    turned = session.camera.value
    distance = np.linalg.norm(np.subtract(turned.position, turned.pivot))
    assert distance == pytest.approx(np.linalg.norm(np.subtract(start.position, start.pivot)), rel=1e-4)
    assert abs(turned.forward[0] - start.forward[0]) > 0.2  # 80 px of 0.006 radians
    drag(tab, 0, 40, shift=True)
    eventually(lambda: session.camera.value != turned)
    eventually(lambda: tab.run("return test.got.at(-1).move === test.sent.filter((m) => m.kind === 'camera').length"))
    panned = session.camera.value
    assert panned.forward == pytest.approx(turned.forward, abs=1e-5) and panned.position[1] > turned.position[1]
    tab.run(
        """const target = document.querySelector('#one .heliograph-input'); target.focus();
        const box = target.getBoundingClientRect();
        target.dispatchEvent(new WheelEvent('wheel', { deltaY: -300, cancelable: true,
          clientX: box.x + box.width / 2, clientY: box.y + box.height / 2 }));"""
    )
    eventually(lambda: session.camera.value.position != panned.position)
    nearer = session.camera.value
    assert np.linalg.norm(np.subtract(nearer.position, nearer.pivot)) < 0.8 * distance
    is_shown(tab, session, "widget-moved", "display")
    # Python moves it, and the next drag goes on from there.
    session.camera = start
    is_shown(tab, session, "widget-back", "display")
    drag(tab, 4, 0)
    eventually(lambda: session.camera.value != start)
    assert np.linalg.norm(np.subtract(session.camera.position, start.position)) < 0.2 * distance
    previews = tab.run("return test.got.filter((message) => message.preview).length")
    assert previews > 0 and problem(tab) == "" and tab.errors() == []


def test_a_page_that_draws_nothing_is_sent_two_pictures(tab, shown, session):
    tab.wait("document.querySelector('#one .heliograph-status').textContent.startsWith('all samples taken')")
    tab.run(
        "globalThis.real = requestAnimationFrame; globalThis.held = [];"
        "globalThis.requestAnimationFrame = (f) => held.push(f)"
    )
    before = tab.run("return test.got.filter((message) => message.kind === 'picture').length")
    for _ in range(4):
        session.camera.orbit(5)
        session.wait()
    tab.wait(f"test.got.filter((message) => message.kind === 'picture').length === {before + 2}")
    time.sleep(0.5)
    assert tab.run("return test.got.filter((message) => message.kind === 'picture').length") == before + 2
    tab.run("globalThis.requestAnimationFrame = real; for (const f of held.splice(0)) real(f)")
    is_shown(tab, session, "widget-late", "display")  # the newest one, without those between


def test_two_views_of_one_widget_and_the_end(tab, shown, session):
    tab.run("test.more()")
    tab.wait("document.querySelectorAll('.heliograph').length === 2")
    eventually(lambda: len(shown.widget.names) == 2 and status(tab, "#two").startswith("all samples taken"))
    tab.run("test.closeSecond()")
    eventually(lambda: len(shown.widget.names) == 1)
    session.close()
    tab.wait("document.querySelector('#one .heliograph-problem').textContent === 'The session is closed.'")
    drag(tab, 40, 0)
    tab.wait("document.querySelector('#one .heliograph-problem').textContent === 'this session is closed'")
    tab.screenshot("widget-ended")
    tab.run("test.close()")
    eventually(lambda: shown.widget.names == [])
    assert tab.errors() == []


def test_compressed_tiles_and_half_floats(tab, box):
    with box.session(size=(96, 64), until=hg.Samples(4), compression="zip", pixel_type="half") as session:
        kernel = Kernel(session)
        try:
            tab.open(kernel.address)
            is_shown(tab, session, "widget-zip", "rgb")
        finally:
            tab.open("about:blank")
            kernel.stop()


def test_a_browser_without_webgl_says_so(tab, shown):
    tab.run(
        """const get = HTMLCanvasElement.prototype.getContext;
        HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
          return kind === 'webgl2' ? null : get.call(this, kind, ...more);
        };
        test.more();"""
    )
    tab.wait("!!document.querySelector('#two .heliograph-problem')")
    told = tab.run("return document.querySelector('#two').textContent")
    assert told == "No picture: this browser has no WebGL2, with which pictures are drawn."


def test_a_broken_tile_is_told_and_the_next_picture_comes(tab, shown, session):
    tab.wait("document.querySelector('#one .heliograph-status').textContent.startsWith('all samples taken')")
    page = tab.run("return test.sent[0].page")
    good = tab.run("return test.got.find((message) => message.kind === 'picture' && !message.preview)")
    bad = {**good, "frame": 10**6, "picture": 10**6}
    shown.waiting.put(({**bad, "page": page}, [b"no picture"]))
    tab.wait("document.querySelector('#one .heliograph-problem').textContent.includes('not an EXR file')")
    assert tab.run("return test.sent.at(-1).kind === 'drawn' && test.sent.at(-1).picture") == 10**6
    session.camera.orbit(5)
    session.wait()
    is_shown(tab, session, "widget-again", "display")
