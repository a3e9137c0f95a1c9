"""The viewer as a person uses it. Each test ends with no error in the console and no request to another machine."""
import json
import math
import pathlib
import re
import subprocess
import tempfile
import time
import unittest

import browser
from viewer_case import CORNELL, FIXED, FULL, SCENES, ViewerCase, address, read_exr


class ViewerTest(ViewerCase):
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

    # ---- compare, edit ----------------------------------------------------------------------------------------------

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
        # Turned and scaled about its own place, as the twelve numbers of a message have it.
        turned = self.page.driver.execute_async_script("""const done = arguments[0];
            import('/camera/transform.js').then(({ placeOf, transformOf, turnedAndScaled }) => {
              const moved = [2, 0, 0, 5, 0, 3, 0, 6, 0, 0, 4, 7];
              done([placeOf(moved), turnedAndScaled(moved, Math.PI / 2, 2, [8, 9, 10]), transformOf([])]);
            });""")
        self.assertEqual(turned[0], [5, 6, 7])
        for value, expected in zip(turned[1], [0, 0, 8, 8, 0, 6, 0, 9, -4, 0, 0, 10]):
            self.assertAlmostEqual(value, expected)
        self.assertEqual(turned[2], [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0])
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

    def test_a_slow_link_becomes_fast_again(self):
        self.open(**FIXED)
        rates = self.page.run("""const link = new heliograph.app.link.constructor(() => {}), rates = [];
            const previews = (times, size, ms) => {
              for (let i = 0; i < times; i++) link.measured(size, ms);
              rates.push(link.rate);
            };
            const heldUp = (rate) => {
              link.heldUp(rate);
              rates.push(link.rate);
            };
            heldUp(5e6); // the picture waits for the browser at most
            heldUp(1e6);
            previews(4, 1e5, 100); // as fast as the limit, which paces them
            previews(1, 1e5, 20); // too few bytes to tell
            previews(1, 1e5, 20);
            heldUp(6e5);
            previews(12, 1e5, 10);
            heldUp(1e6);
            const now = performance.now();
            for (let i = 0; i < 5; i++) link.received(1e6, now + 1000 * i); // as slow as is told
            rates.push(link.rate);
            for (let i = 0; i < 5; i++) link.received(1e6, now + 5000 + 50 * i);
            rates.push(link.rate);
            heldUp(1e6); // by the browser
            return rates;""")
        self.assertEqual(rates[:4], [0, 1e6, 1e6, 1e6])
        self.assertEqual(rates[4:7], [1.5e6, 6e5, 0])
        self.assertEqual(rates[7:], [1e6, 1e6, 0, 0])

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
        self.page.wait(f"heliograph.counters.whole > {before['whole']}")  # counted with its drawing, not its arrival

    def test_brings_numbers_into_their_range(self):
        self.open(size="160x120", samples=4, mode=1, preview_rate=0)
        self.set("budget-samples", "1e13")
        self.assertEqual(self.page.run("return heliograph.app.budget.samples"), 2**30)
        self.set("budget-samples", "64")
        self.page.wait("heliograph.state().end && heliograph.state().progress.samples_per_pixel >= 64")
        reached = int(self.page.run("return heliograph.state().progress.samples_per_pixel"))  # it may have gone past 64
        # What gets past that is refused by the daemon, and the page goes on with what there was.
        self.page.run("heliograph.app.main.session.setBudget({samples: 2 ** 31})")
        self.wait_for_message("samples")
        self.page.wait("heliograph.state().attached")
        self.set("budget-samples", str(reached + 16))
        self.page.wait(f"heliograph.state().end && heliograph.state().progress.samples_per_pixel === {reached + 16}")

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

    def test_a_hidden_tab_asks_for_no_pictures(self):
        self.open(size="160x120", samples=2**30, mode=1)
        self.page.run("document.getElementById('session-add').click()")
        self.page.wait("heliograph.state(1)?.complete")
        self.page.run("""globalThis.log = [];
            const note = () => log.push({ state: document.visibilityState, tiles: heliograph.counters.filmTiles,
              attached: [heliograph.state().attached, heliograph.state(1).attached], bytes: heliograph.state().bytes });
            document.addEventListener('visibilitychange', note);
            globalThis.noting = setInterval(note, 100);""")
        ids = [self.page.state()["session"], self.page.run("return heliograph.state(1).session")]
        driver = self.page.driver
        first = driver.current_window_handle
        # From here on no command may go to the first tab, which would show it again.
        driver.switch_to.new_window("tab")

        def told():
            sessions = self.sessions()
            return [(sessions[i]["attached"], sessions[i]["samples"]) for i in ids]

        browser.eventually(lambda: not any(attached for attached, _ in told()), what="the end of both streams")
        time.sleep(0.5)  # what had begun is over
        before = told()
        time.sleep(1.5)
        self.assertEqual(told(), before)
        driver.close()
        driver.switch_to.window(first)
        log = self.page.run("clearInterval(noting); return log")
        hidden = [entry for entry in log if entry["state"] == "hidden"]
        self.assertGreater(len(hidden), 10, "no tab that is hidden")
        self.assertEqual([entry["attached"] for entry in hidden], [[False, False]] * len(hidden))
        late = hidden[5:]  # the first may still take what was on its way
        self.assertEqual({(entry["tiles"], entry["bytes"]) for entry in late}, {(late[0]["tiles"], late[0]["bytes"])})
        # Shown again, both sessions go on where they were.
        self.assertEqual(self.page.run("return document.visibilityState"), "visible")
        self.page.wait(f"heliograph.counters.filmTiles > {late[0]['tiles']}")
        for was, i in zip(before, ids):
            browser.eventually(lambda: (now := self.sessions()[i])["attached"] and now["samples"] > was[1], what="more samples")

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
