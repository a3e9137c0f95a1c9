"""The viewer as a person uses it. Each test ends with no error in the console and no request to another machine."""
import json
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
        hosts = self.page.requested_hosts()
        self.page.driver.get("about:blank")  # before the test's own daemon stops
        self.assertEqual(errors, [])
        self.assertLessEqual(hosts, self.hosts)

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

    def set(self, control, value):
        """Types a value into a control, or chooses it."""
        self.page.run("const c = document.getElementById(arguments[0]); c.value = arguments[1];"
                      "c.dispatchEvent(new Event('change'))", control, str(value))

    def wait_for_message(self, text):
        return self.page.wait(f"document.getElementById('messages').textContent.includes({json.dumps(text)})")

    def brightness(self):
        """Mean byte of what the screen shows around the middle of the picture."""
        box = self.page.run("const r = document.getElementById('view').getBoundingClientRect();"
                            "return [r.left + r.width / 2, r.top + r.height / 2]")
        with tempfile.TemporaryDirectory() as folder:
            file, raw = pathlib.Path(folder, "screen.png"), pathlib.Path(folder, "screen.ppm")
            file.write_bytes(self.page.driver.get_screenshot_as_png())
            cut = f"100x100{int(box[0]) - 50:+d}{int(box[1]) - 50:+d}"
            subprocess.run(["oiiotool", str(file), "--ch", "0,1,2", "--cut", cut, "-o", str(raw)], check=True,
                           capture_output=True)
            return sum(raw.read_bytes()[-30000:]) / 30000

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
        for _ in range(120):
            actions.move_by_offset(1, 0)
        actions.perform()
        during = self.page.run("return {...heliograph.counters}")
        middle = self.page.run("return heliograph.shown(160, 120)")
        self.page.screenshot("drag")
        self.actions().release().perform()
        self.assertGreater(sum(middle), 0, "black while moving")
        self.assertGreater(during["views"], before["views"] + 3)
        self.assertGreaterEqual(during["previews"], before["previews"] + 2)
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
        self.page.wait_for_picture()
        moved = self.position()
        for kind, points in (("touchStart", [{"x": box[0] + 9, "y": box[1] + 7}]), ("touchEnd", [])):
            driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        self.page.wait("!document.getElementById('inspector').hidden")
        self.assertEqual(self.position(), moved, "a tap moves nothing")

    def test_keys_inspect_pixels_and_leave_the_region(self):
        self.open(**FIXED)
        self.page.wait_for_end()
        self.canvas().send_keys("\ue007")  # enter
        self.assertEqual(self.page.wait("heliograph.app.inspector.current && heliograph.app.inspector.at"), [80, 60])
        self.canvas().send_keys("\ue00a\ue014")  # alt, arrow right
        self.page.wait("heliograph.app.inspector.at[0] === 81")
        self.canvas().send_keys("b")
        self.page.wait("document.getElementById('view').dataset.tool === 'region'")
        self.canvas().send_keys("\ue00c")  # escape
        self.page.wait("document.getElementById('view').dataset.tool === undefined")

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

    def test_tells_differences_in_standard_errors(self):
        self.open(**{**FIXED, "samples": 256})
        self.page.wait_for_end()
        self.page.run("document.getElementById('pin').click()")
        self.set("seed", 8)
        self.page.wait_for_end()
        told = self.page.run("""const z = [];
            const { picture } = heliograph.app.main;
            for (let y = 0; y < 120; y++) for (let x = 0; x < 160; x++) {
              if (heliograph.pixel(x, y)['variance.G'] > 0) z.push(picture.standardErrors(x, y));
            }
            return [z.length, Math.sqrt(z.reduce((sum, v) => sum + v * v, 0) / z.length),
              z.filter((v) => Math.abs(v) > 2).length / z.length];""")
        self.assertGreater(told[0], 10000)
        self.assertTrue(0.8 < told[1] < 1.1, told)
        self.assertLess(told[2], 0.07, told)

    def test_edits_a_material(self):
        before = self.open(**FIXED)
        self.page.wait_for_end()
        # On the floor: red over blue.
        ratio = """let r = 0, b = 0;
            for (let y = 108; y < 114; y++) for (let x = 70; x < 90; x++) {
              const p = heliograph.pixel(x, y);
              r += p.R, b += p.B;
            }
            return r / b;"""
        before_edits = self.page.run(ratio)
        self.show("section-scene")
        rows = "[...document.querySelectorAll('#materials > details')]"
        materials = self.page.wait(f"{rows}.length > 1 && {rows}.map((row) => Number(row.id.split('-')[1]))")
        for i in materials:
            self.page.run(f"document.getElementById('material-{i}').open = true")
            self.page.wait(f"document.getElementById('material-{i}-color')")
            self.page.run(f"const c = document.getElementById('material-{i}-color'); c.value = '#2040ff';"
                          "c.dispatchEvent(new Event('input'))")
        self.page.wait(f"heliograph.app.scenes.edits.length === {len(materials)}")
        self.assertNotEqual(self.page.state()["scene"], before["scene"])
        time.sleep(0.5)  # the last one's film begins
        self.page.wait_for_end()
        self.page.screenshot("edited")
        self.assertLess(self.page.run(ratio), 0.5 * before_edits)
        self.page.run("document.getElementById('edits-reset').click()")
        self.page.wait(f"heliograph.state().scene === '{before['scene']}'")
        # Edited scenes that are shown no more leave the daemon.
        self.page.wait_for_end()
        browser.eventually(lambda: not [s for s in self.scenes() if s.get("edited_from") == before["scene"]],
                           what="the edited scenes' end")

    def scenes(self):
        """SceneInfo of all that the daemon holds."""
        return self.page.driver.execute_async_script(
            "const done = arguments[0]; heliograph.app.connection.call('list_scenes').then(({ scenes }) => "
            "done(scenes.map(({ scene_id, edited_from }) => ({ scene_id, edited_from }))))")

    def test_lists_what_can_be_edited(self):
        """Of a scene with many objects, a map to light it with, and something to note."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        scene = json.loads((SCENES / CORNELL).read_text())
        block = next(node for node in scene["nodes"] if node["name"] == "tall block")
        first = len(scene["nodes"])
        scene["nodes"] += [{**block, "name": f"copy {i}"} for i in range(1100)]
        scene["scenes"][0]["nodes"] += range(first, first + 1100)
        scene["nodes"].append({**block, "name": "flat", "scale": [0, 0, 0]})
        scene["scenes"][0]["nodes"].append(first + 1100)
        pathlib.Path(folder.name, "many.gltf").write_text(json.dumps(scene))
        subprocess.run(["oiiotool", "--pattern", "constant:color=0.5,0.6,0.9", "8x4", "3", "-d", "float", "-o",
                        str(pathlib.Path(folder.name, "sky.hdr"))], check=True, capture_output=True)
        daemon = browser.Daemon(self.options.daemon, folder.name)
        self.addCleanup(daemon.stop)
        self.hosts = {daemon.http, self.daemon.http}
        moved = [1, 0, 0, -50, 0, 1, 0, 25, 0, 0, 1, 0]
        edits = json.dumps([["object:5", {"object": {"index": 5, "transform": moved}}]]).replace(" ", "")
        self.page.open(address(daemon, "many.gltf", size="160x120", samples=1, mode=1, preview_rate=0, edits=edits))
        self.page.wait_for_picture()
        # What was noted at loading lies folded in the section, not over the picture.
        self.assertIn("no area", self.page.run("return document.getElementById('scene-notices').textContent"))
        self.assertFalse(self.page.run("return document.getElementById('scene-notices').open"))
        self.assertNotIn("no area", self.page.run("return document.getElementById('messages').textContent"))
        self.show("section-scene")
        rows = "document.querySelectorAll('#objects > details').length"
        self.page.wait(f"{rows} === 1024")
        self.page.run("document.getElementById('objects-more').click()")
        self.page.wait(f"{rows} === 1108")
        self.assertIsNone(self.page.run("return document.getElementById('objects-more')"))
        # What shines comes first, materials that do among it.
        lights = self.page.run("return document.querySelector('#scene-lists .list').innerText")
        self.assertEqual(lights.strip(), "lamp")
        self.page.run("const f = document.getElementById('objects-filter'); f.value = 'copy 109';"
                      "f.dispatchEvent(new Event('input'))")
        shown = "document.querySelectorAll('#objects > details:not([hidden])').length"
        self.assertEqual(self.page.run(f"return {shown}"), 11)
        # A row begins with the edit that there is.
        self.page.run("document.getElementById('object-5').open = true")
        self.page.wait("document.getElementById('object-5-x')")
        self.assertEqual(self.page.run("return document.getElementById('object-5-x').value"), "-50")
        self.page.screenshot("scene-lists")
        # With a map around it the scene keeps its edits and the camera.
        self.canvas().send_keys("\ue014")
        time.sleep(0.3)
        place = self.position()
        self.page.run("heliograph.app.panels.open.light('sky.hdr')")
        self.page.wait("heliograph.app.scenes.source.environment === 'sky.hdr'"
                       " && heliograph.app.scenes.edits.length === 1")
        self.assertEqual(self.position(), place)
        self.page.wait_for_picture()
        # A page that rests opens a scene, and renders it when it goes on.
        self.page.run("heliograph.app.pause(true); heliograph.app.panels.open.open('many.gltf')")
        self.page.wait("heliograph.app.scenes.source.environment === ''")
        time.sleep(0.3)
        self.assertFalse(self.page.state()["attached"])
        self.page.run("heliograph.app.pause(false)")
        self.page.wait("heliograph.state().attached")
        self.page.wait_for_picture()

    def test_a_link_has_the_size_of_the_picture(self):
        self.open(samples=1, mode=1, preview_rate=0)
        self.page.run("navigator.clipboard.writeText = async (text) => { globalThis.copied = text; };"
                      "document.getElementById('copy-link').click()")
        state = self.page.state()
        self.assertIn(f"size={state['width']}x{state['height']}&", self.page.wait("globalThis.copied"))

    def test_a_second_session_comes_and_goes(self):
        self.open(**FIXED)
        for on in (True, False, True):
            self.page.run("document.getElementById('side-by-side').click()")
            if on:
                self.page.wait("heliograph.state(true).complete")
        self.assertNotIn("made again", self.page.run("return document.getElementById('messages').textContent"))
        self.page.run("document.getElementById('side-by-side').click()")

    def test_a_slow_link_becomes_fast_again(self):
        self.open(**FIXED)
        rates = self.page.run("""const link = new heliograph.app.link.constructor(() => {}), rates = [];
            const measured = (times, size, ms) => {
              for (let i = 0; i < times; i++) link.measured(size, ms);
              rates.push(link.rate);
            };
            measured(3, 1e6, 1000);
            measured(4, 1e5, 105);
            measured(4, 1e5, 500);
            measured(8, 1e5, 10);
            measured(1, 5e6, 10);
            measured(9, 5e6, 5000);
            return rates;""")
        self.assertEqual(rates[0], 1e6)
        self.assertGreater(rates[1], rates[0])
        self.assertLess(rates[2], rates[1])
        self.assertEqual(rates[3:], [0, 0, 0])

    # ---- settings ---------------------------------------------------------------------------------------------------

    def test_a_film_that_grows_goes_on(self):
        self.open(size="160x120", samples=4)
        self.set("size-custom", "640x480")
        self.page.wait("heliograph.state().width === 640", 60)
        self.page.wait_for_picture(60)
        before = self.page.run("return {...heliograph.counters}")
        actions = self.actions().click_and_hold(self.canvas())
        for _ in range(60):
            actions.move_by_offset(1, 0)
        actions.release().perform()
        self.page.wait(f"heliograph.counters.previews >= {before['previews'] + 2}", 60)
        self.page.wait_for_picture(60)
        self.assertGreater(self.page.run("return heliograph.counters.whole"), before["whole"])

    def test_brings_numbers_into_their_range(self):
        self.open(size="160x120", samples=4, mode=1, preview_rate=0)
        self.set("budget-samples", "1e13")
        self.assertEqual(self.page.run("return heliograph.app.budget.samples"), 2**30)
        self.set("budget-samples", "64")
        self.page.wait("heliograph.state().end && heliograph.state().progress.samples_per_pixel === 64")
        # What gets past that is refused by the daemon, and the page goes on with what there was.
        self.page.run("heliograph.app.main.session.setBudget({samples: 2 ** 31})")
        self.wait_for_message("samples")
        self.page.wait("heliograph.state().attached")
        self.set("budget-samples", "80")
        self.page.wait("heliograph.state().end && heliograph.state().progress.samples_per_pixel === 80")

    def test_a_size_that_is_too_large_changes_nothing(self):
        self.open(size="160x120", samples=4, region="10,10,60,60")
        self.set("size-custom", "50000x50000")
        self.wait_for_message("at most")
        self.assertEqual(self.page.run("return heliograph.app.wanted.size"), "160x120")
        # And one that the daemon alone refuses.
        self.page.run("const a = heliograph.app; a.info = {...a.info, limits: {}}; a.setSize('60000x60000')")
        self.page.wait("heliograph.app.wanted.size === '160x120'")
        self.assertEqual(self.page.run("return heliograph.app.wanted.region"), [10, 10, 60, 60])
        self.page.wait("heliograph.state().attached")
        self.set("budget-samples", "8")
        self.page.wait("heliograph.state().end && heliograph.state().progress.samples_per_pixel >= 8")
        self.assertEqual(self.page.state()["width"], 160)

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
        # Its time begins anew: two pictures that took this page's budget took no more than the second one's own.
        seconds = self.page.run("return heliograph.app.main.end.totals.seconds")
        self.assertEqual(self.page.state()["progress"]["seconds"], seconds)
        self.assertLess(seconds, 5)

    def test_wants_the_token_that_the_daemon_has(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "tokens")
            file.write_text("0123456789abcdef\n")
            guarded = browser.Daemon(self.options.daemon, SCENES, arguments=("--token-file", str(file)))
            self.addCleanup(guarded.stop)
            self.hosts = {guarded.http, self.daemon.http}
            self.page.open(address(guarded) + "&token=wrong")
            text = self.page.wait("!document.getElementById('banner').hidden && document.getElementById('banner').textContent")
            self.assertRegex(text, "not one of the daemon's")
            self.page.screenshot("token-refused")
            self.page.run("sessionStorage.clear()")
            self.page.open(address(guarded, **FIXED))
            self.page.wait("document.getElementById('banner').textContent.includes('wants a token')")
            self.page.screenshot("token-wanted")
            # Typed into the page.
            self.page.driver.find_element("id", "token").send_keys("0123456789abcdef\n")
            self.page.wait_for_picture()
            # Appended to the address of a page that was refused.
            self.page.run("sessionStorage.clear()")
            self.page.open(address(guarded, **FIXED))
            self.page.wait("document.getElementById('token')")
            self.page.run("location.hash += '&token=0123456789abcdef'")
            self.page.wait_for_picture()
            self.assertNotIn("0123456789abcdef", self.page.driver.current_url)
            # In the address from the start.
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
        self.assertGreater(self.brightness(), 20)
        self.page.run("heliograph.loseContext(800)")
        self.page.wait("document.getElementById('messages').textContent.includes('The graphics context was lost')")
        self.page.wait("document.getElementById('messages').textContent.includes('The graphics context is back')")
        self.page.wait_for_picture()
        self.page.screenshot("context-restored")
        self.assertGreater(self.brightness(), 20)
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
