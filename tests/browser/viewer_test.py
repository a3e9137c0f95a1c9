"""The viewer as a person uses it. Each test ends with no error in the console and no request to another machine."""
import math
import os
import pathlib
import re
import subprocess
import tempfile
import time
import unittest

import browser

SCENES = pathlib.Path(__file__).resolve().parents[2] / "scenes"
CORNELL = "cornell-box/cornell-box.gltf"
# Path tracing without previews: the same bits as a render on the command line.
FIXED = {"mode": 1, "seed": 7, "samples": 16, "size": "160x120", "preview_rate": 0}
FULL = os.environ.get("HELIO_TEST_TIER") == "full"


def address(daemon, scene=CORNELL, **state):
    parts = [f"scene={scene}"] + [f"{name}={value}" for name, value in state.items()]
    return f"http://{daemon.http}/#" + "&".join(parts)


def read_exr(file):
    """{(x, y): [values]} and the names of the channels, by oiiotool."""
    info = subprocess.run(["oiiotool", "--info", "-v", str(file)], capture_output=True, text=True, check=True).stdout
    names = re.search(r"channel list: (.*)", info).group(1).split(", ")
    names = [name.split(" ")[0] for name in names]
    dump = subprocess.run(["oiiotool", "--dumpdata", str(file)], capture_output=True, text=True, check=True).stdout
    pixels = {}
    for match in re.finditer(r"Pixel \((\d+), (\d+)\): ([^\n]*)", dump):
        values = [float(v) for v in match.group(3).split() if v not in ("(float", "(half")]
        pixels[int(match.group(1)), int(match.group(2))] = dict(zip(names, values))
    return pixels


class ViewerTest(unittest.TestCase):
    options = None  # by run

    @classmethod
    def setUpClass(cls):
        cls.daemon = browser.Daemon(cls.options.daemon, SCENES)
        cls.addClassCleanup(lambda: cls.daemon.stop())
        cls.page = browser.Page(cls.options.screenshots)
        cls.addClassCleanup(cls.page.close)

    def setUp(self):
        self.expected_errors = ()
        self.hosts = {self.daemon.http}

    def tearDown(self):
        errors = [e for e in self.page.errors() if not any(part in e for part in self.expected_errors)]
        self.assertEqual(errors, [])
        self.assertLessEqual(self.page.requested_hosts(), self.hosts)

    def open(self, scene=CORNELL, **state):
        self.page.open(address(self.daemon, scene, **state))
        return self.page.wait_for_picture()

    def canvas(self):
        return self.page.driver.find_element("id", "view")

    def actions(self):
        from selenium.webdriver import ActionChains
        return ActionChains(self.page.driver, duration=20)

    def position(self):
        camera = self.page.run("return heliograph.camera.message()")
        return [camera["position"].get(axis, 0) for axis in "xyz"]

    def show(self, section):
        self.page.run(f"document.getElementById('{section}').open = true")

    # ---- the picture ------------------------------------------------------------------------------------------------

    def test_draws_by_the_software_that_the_tests_name(self):
        self.assertIn("SwiftShader", self.open(**FIXED)["renderer"])

    def test_first_picture_equals_the_daemons_exr(self):
        self.open(**FIXED)
        self.page.wait_for_end()
        self.page.screenshot("first-picture")
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "reference.exr")
            subprocess.run([self.options.program, "render", str(SCENES / CORNELL), "--server", self.daemon.rpc, "--size", "160x120",
                            "--samples", "16", "--seed", "7", "--mode", "pt", "--output", str(file)], check=True, capture_output=True)
            reference = read_exr(file)
        self.assertEqual(len(reference), 160 * 120)
        shown = self.page.run("""const out = [];
            for (let y = 0; y < 120; y++) for (let x = 0; x < 160; x++) {
              const p = heliograph.pixel(x, y);
              out.push(p.R, p.G, p.B, p['variance.R'], p.samples);
            }
            return out;""")
        worst = {"variance.R": 0, "others": 0}
        for i, (x, y) in enumerate((x, y) for y in range(120) for x in range(160)):
            for value, name in zip(shown[5 * i:5 * i + 5], ("R", "G", "B", "variance.R", "samples")):
                expected = reference[x, y][name]
                # Half has 11 significant bits; below 2^-14 steps of 2^-24.
                error = abs(value - expected) / max(abs(expected) * 2**-11, 2**-25)
                key = name if name in worst else "others"
                worst[key] = max(worst[key], error)
        self.assertLessEqual(worst["others"], 1.01)
        self.assertLessEqual(worst["variance.R"], 2.01)  # is rounded up
        # What is on the screen is that picture: in its middle, by the transfer function of sRGB.
        x, y = 80, 20
        linear = [reference[x, y][name] for name in "RGB"]
        encoded = [round(255 * (12.92 * v if v <= 0.0031308 else 1.055 * min(v, 1) ** (1 / 2.4) - 0.055)) for v in linear]
        self.page.run("document.getElementById('channel').value = 'radiance';"
                      "document.getElementById('channel').dispatchEvent(new Event('change'))")
        drawn = self.page.run(f"return heliograph.shown({x}, {y})")
        self.assertTrue(all(abs(a - b) <= 1 for a, b in zip(drawn, encoded)), (drawn, encoded))

    def test_inspector_shows_the_numbers_of_the_exr(self):
        self.open(**FIXED)
        self.page.wait_for_end()
        rect = self.page.run("const r = document.getElementById('view').getBoundingClientRect(); return [r.width, r.height]")
        self.actions().move_to_element_with_offset(self.canvas(), int(rect[0] * 0.1), int(rect[1] * 0.13)).perform()
        text = self.page.wait("!document.getElementById('inspector').hidden && document.getElementById('inspector').textContent")
        x, y = map(int, re.match(r"(\d+), (\d+)", text).groups())
        told = self.page.run(f"return heliograph.inspect({x}, {y})")
        self.assertIn("samples", text)
        self.assertEqual(told["samples"], 16)
        # Numbers as they are read: at least three significant digits of each.
        numbers = [float(n) for n in re.findall(r"\d+\.\d+(?:e-?\d+)?", text)]
        for value in told["rgb"] + told["standardError"]:
            self.assertTrue(any(math.isclose(value, n, rel_tol=5e-3) for n in numbers), (value, text))

    def test_saves_what_is_shown(self):
        self.open(**FIXED)
        self.page.wait_for_end()
        pixel = self.page.run("return heliograph.pixel(40, 50)")
        data = self.page.run("return Array.from(new Uint8Array(heliograph.exr()))")
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "saved.exr")
            file.write_bytes(bytes(data))
            saved = read_exr(file)
        for name in ("R", "G", "B", "variance.G", "samples"):
            self.assertAlmostEqual(saved[40, 50][name], pixel[name], delta=1e-6 + 1e-3 * abs(pixel[name]))

    # ---- the camera -------------------------------------------------------------------------------------------------

    def test_a_drag_shows_whole_pictures(self):
        self.open(size="320x240", samples=64)
        before, start = self.page.run("return {...heliograph.counters}"), self.position()
        actions = self.actions().click_and_hold(self.canvas())
        for _ in range(40):
            actions.move_by_offset(1, 0)
        actions.perform()
        during = self.page.run("return {...heliograph.counters}")
        middle = self.page.run("return heliograph.shown(160, 120)")
        self.page.screenshot("drag")
        self.actions().release().perform()
        self.assertGreater(sum(middle), 0, "black while moving")
        self.assertGreater(during["views"], before["views"] + 3)
        self.assertGreater(during["previews"], before["previews"] + 3)
        self.assertNotEqual(self.position(), start)
        state = self.page.wait_for_picture()
        self.assertFalse(state["preview"])
        self.assertGreater(self.page.run("return heliograph.counters.filmTiles"), before["filmTiles"])
        self.page.screenshot("after-drag")

    def test_wheel_keys_and_touch_move_the_camera(self):
        self.open(size="160x120", samples=4)
        driver = self.page.driver

        def wheel(delta):
            box = self.page.run("const r = document.getElementById('view').getBoundingClientRect();"
                                "return [r.left + r.width / 2, r.top + r.height / 2]")
            driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mouseWheel", "x": box[0], "y": box[1], "deltaX": 0,
                                                                "deltaY": delta})
            time.sleep(0.3)

        start = self.position()
        self.page.run("document.activeElement.blur()")
        wheel(-120)
        self.assertEqual(self.position(), start, "the wheel belongs to the page until the picture has the focus")
        self.canvas().click()
        wheel(-120)
        near = self.position()
        self.assertNotEqual(near, start)
        self.canvas().send_keys("\ue014")  # arrow right
        browser.eventually(lambda: self.position() != near, what="an arrow key")
        self.canvas().send_keys("r")
        browser.eventually(lambda: all(math.isclose(a, b, abs_tol=1e-6) for a, b in zip(self.position(), start)), what="reset")
        box = self.page.run("const r = document.getElementById('view').getBoundingClientRect();"
                            "return [r.left + r.width / 2, r.top + r.height / 2]")
        for kind, dx in (("touchStart", 0), ("touchMove", 30), ("touchMove", 60), ("touchEnd", None)):
            points = [] if dx is None else [{"x": box[0] + dx, "y": box[1]}]
            driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        browser.eventually(lambda: self.position() != start, what="a finger")

    def test_an_address_reproduces_the_picture(self):
        self.open(**FIXED)
        self.canvas().click()
        self.canvas().send_keys("\ue014")
        self.page.wait_for_end()
        link = browser.eventually(lambda: "camera=" in self.page.driver.current_url and self.page.driver.current_url)
        time.sleep(0.6)  # the address follows the state after a moment
        link = self.page.driver.current_url
        first = self.page.run("return heliograph.pixel(70, 60)")
        self.page.open(link)
        self.page.wait_for_end()
        again = self.page.run("return heliograph.pixel(70, 60)")
        self.assertEqual([again[name] for name in "RGB"], [first[name] for name in "RGB"])

    # ---- compare, edit ----------------------------------------------------------------------------------------------

    def test_pins_and_compares(self):
        self.open(**FIXED)
        self.page.wait_for_end()
        self.show("section-compare")
        self.page.run("document.getElementById('pin').click()")
        self.assertTrue(self.page.wait("heliograph.state().pinned"))
        self.canvas().send_keys("\ue014" * 6)
        self.page.wait_for_end()
        left, right = "heliograph.shown(20, 60)", "heliograph.shown(140, 60)"
        present = self.page.run(f"return [{left}, {right}]")

        def choose(way):
            self.page.run("const c = document.getElementById('compare'); c.selectedIndex = arguments[0];"
                          "c.dispatchEvent(new Event('change'))", way)
            time.sleep(0.2)
            self.page.screenshot(f"compare-{way}")
            return self.page.run(f"return [{left}, {right}]")

        pinned = choose(1)
        self.assertNotEqual(pinned, present)
        split = choose(2)
        self.assertIn(split, ([pinned[0], present[1]], [present[0], pinned[1]]))
        for way in (3, 4, 5):
            self.assertNotIn(choose(way), (present, pinned))

    def test_edits_a_material(self):
        before = self.open(**FIXED)
        self.page.wait_for_end()
        colour = self.page.run("return heliograph.pixel(80, 110)")
        self.show("section-scene")
        self.page.wait("document.querySelectorAll('#materials > details').length > 1")
        count = self.page.run("return document.querySelectorAll('#materials > details').length")
        for i in range(count):
            self.page.run(f"document.getElementById('material-{i}').open = true")
            if self.page.wait(f"document.getElementById('material-{i}-color') ? 1 : 2") == 2:
                continue
            self.page.run(f"const c = document.getElementById('material-{i}-color'); c.value = '#2040ff';"
                          "c.dispatchEvent(new Event('input'))")
        self.page.wait(f"heliograph.state().scene !== '{before['scene']}'")
        self.page.wait_for_end()
        self.page.screenshot("edited")
        edited = self.page.run("return heliograph.pixel(80, 110)")
        self.assertLess(edited["R"] / edited["B"], 0.5 * colour["R"] / colour["B"])
        self.page.run("document.getElementById('edits-reset').click()")
        self.page.wait(f"heliograph.state().scene === '{before['scene']}'")

    # ---- the connection ---------------------------------------------------------------------------------------------

    def test_goes_on_with_a_daemon_that_was_started_again(self):
        self.expected_errors = ("WebSocket connection", "ERR_CONNECTION_REFUSED")
        state = self.open(**FIXED)
        port = self.daemon.port
        self.daemon.kill()
        self.daemon.process.stdout.close()
        self.page.wait("!document.getElementById('banner').hidden && document.getElementById('banner').textContent.length > 10")
        self.page.screenshot("connection-lost")
        type(self).daemon = browser.Daemon(self.options.daemon, SCENES, port)
        self.page.wait(f"document.getElementById('banner').hidden && heliograph.state().session !== '{state['session']}'")
        self.page.wait_for_end()
        self.assertEqual(self.page.state()["scene"], state["scene"])

    def test_wants_the_token_that_the_daemon_has(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "tokens")
            file.write_text("0123456789abcdef\n")
            guarded = browser.Daemon(self.options.daemon, SCENES, arguments=("--token-file", str(file)))
            self.addCleanup(guarded.stop)
            self.hosts = {guarded.http, self.daemon.http}
            self.page.open(address(guarded) + "&token=wrong")
            text = self.page.wait("!document.getElementById('banner').hidden && document.getElementById('banner').textContent")
            self.assertRegex(text, "token")
            self.page.screenshot("token-refused")
            self.page.run("sessionStorage.clear()")
            self.page.open(address(guarded, **FIXED) + "&token=0123456789abcdef")
            self.page.wait_for_picture()
            self.assertNotIn("0123456789abcdef", self.page.driver.current_url)

    def test_a_foreign_page_reaches_nothing(self):
        self.expected_errors = ("WebSocket connection", "403", "favicon")
        other = browser.ForeignPage()
        self.addCleanup(other.stop)
        self.hosts = {self.daemon.http, other.host}
        self.page.open(f"http://{other.host}/")
        outcome = self.page.driver.execute_async_script(
            "const done = arguments[1]; const s = new WebSocket(arguments[0], 'heliograph.v1');"
            "s.onopen = () => done('open'); s.onclose = () => done('closed')", f"ws://{self.daemon.http}/ws")
        self.assertEqual(outcome, "closed")

    def test_a_daemon_answers_to_its_own_names_alone(self):
        foreign = browser.Page(self.options.screenshots, ("--host-resolver-rules=MAP evil.example 127.0.0.1",))
        self.addCleanup(foreign.close)
        foreign.driver.get(f"http://evil.example:{self.daemon.port}/")
        self.assertIn("is not a name of this daemon", foreign.run("return document.body.textContent"))

    def test_a_browser_without_webgl_is_told(self):
        plain = browser.Page(self.options.screenshots, ("--disable-3d-apis",))
        self.addCleanup(plain.close)
        plain.open(address(self.daemon))
        text = plain.wait("!document.getElementById('banner').hidden && document.getElementById('banner').textContent")
        self.assertIn("WebGL 2", text)

    def test_says_what_is_wrong_with_an_address(self):
        self.expected_errors = ()
        self.page.open(address(self.daemon, "no/such/file.gltf"))
        text = self.page.wait("document.getElementById('messages').textContent || document.getElementById('open-note')?.textContent")
        self.assertIn("no/such/file.gltf", text)

    def test_a_lost_context_comes_back(self):
        self.expected_errors = ("CONTEXT_LOST", "context lost")
        self.open(**FIXED)
        self.page.wait_for_end()
        self.page.run("heliograph.loseContext(300)")
        self.page.wait("!document.getElementById('banner').hidden || document.getElementById('messages').textContent")
        self.page.wait_for_picture()
        self.page.screenshot("context-restored")
        browser.eventually(lambda: sum(self.page.run("return heliograph.shown(80, 60)") or [0]) > 0, what="the picture after a lost context")

    @unittest.skipUnless(FULL, "only in ./check --full")
    def test_memory_is_steady_over_five_hundred_views(self):
        self.open(size="160x120", samples=1)
        sizes = []
        for round_number in range(6):
            for _ in range(100):
                self.canvas().send_keys("\ue014")
            self.page.wait_for_picture()
            self.page.driver.execute_cdp_cmd("HeapProfiler.collectGarbage", {})
            sizes.append(self.page.run("return performance.memory.usedJSHeapSize"))
        self.assertLess(sizes[-1], 1.15 * sizes[0] + 1e6, sizes)
