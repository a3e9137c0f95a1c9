"""Links: the address reproduces the picture, and what is damaged in it is named."""
import json
import time

import browser
from viewer_case import FIXED, ViewerCase, address


class LinkTest(ViewerCase):
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

    def test_a_scene_that_is_held_no_more_is_opened_from_its_file(self):
        self.open(**FIXED)
        scene = self.page.state()["scene"]
        for number in (scene, 64 * "0"):  # held, and not
            self.page.open(address(self.daemon, id=number, **FIXED))
            self.page.wait_for_picture()
            self.assertEqual(self.page.state()["scene"], scene)
            browser.eventually(lambda: "id=" not in self.page.driver.current_url, what="a link by the path")

    def test_a_link_reproduces_all_that_it_names(self):
        self.open(**FIXED)
        self.page.wait_for_end()
        self.canvas().click()
        self.canvas().send_keys("\ue014")
        self.page.run("""heliograph.app.addSessions([
            { mode: 3, integrator: 1, variant: 0, layer: '', more: '' },
            { mode: 2, integrator: 1, variant: 2, layer: 'radiance', more: 'adaptive.min_samples=8' },
            { mode: 1, integrator: 1, variant: 0, layer: '', more: 'roulette=throughput max_segments=6' },
          ])""")
        self.page.wait("[1, 2, 3].every((i) => heliograph.state(i)?.complete)")
        self.page.run("document.getElementById('pin').click()")
        self.set("compare", 3)
        self.page.run("heliograph.app.moveSplit(0.1234)")
        self.set("channel", "relative")
        self.set("filter", "nearest")
        self.set("tone-map", 1)
        self.set("range-low", "0.0123456")
        self.set("range-high", "0.75")
        self.page.run("heliograph.app.main.zoomBy(3.3, 120, 90); heliograph.app.main.shift(-21.7, 4.1)")
        self.page.wait("[0, 1, 2, 3].every((i) => heliograph.state(i).end)")
        time.sleep(0.6)  # the address follows the state after a moment
        reading = """const { look, frame, camera, settings, budget, zoom, origin, scene } = heliograph.state();
            const sessions = [0, 1, 2, 3].map((i) => heliograph.state(i)).map(({ name, own, settings, camera }) =>
              ({ name, own, settings, camera }));
            return { look, frame, camera, settings, budget, zoom, origin, scene, sessions,
              mean: ['R', 'G', 'B'].map((name) => heliograph.pixel(70, 60)[name]) };"""
        before, link = self.page.run(reading), self.page.driver.current_url
        self.page.open(link)
        self.page.wait("globalThis.heliograph?.app.viewports.length === 4"
                       " && [0, 1, 2, 3].every((i) => heliograph.state(i).complete && heliograph.state(i).end)")
        after = self.page.run(reading)
        for kept in before, after:
            del kept["look"]["floor"]  # measured, of the picture
        self.assertEqual(after["look"]["compare"], 3)
        *_, third, last = after["sessions"]
        self.assertEqual([last["settings"]["roulette"], last["settings"]["max_segments"]], [2, 6])
        self.assertEqual(third["settings"]["adaptive"]["min_samples"], 8)
        self.assertEqual(third["name"], "Adaptive · as published · Film · adaptive.min_samples=8")
        # A comparison waits for its reference, and the page says so.
        self.assertFalse(self.page.state()["pinned"])
        told = "return document.getElementById('link-text').textContent"
        self.assertIn("Pin a picture", self.page.run(told))
        self.page.screenshot("link-wants-a-reference")
        self.assertEqual(after, before)
        time.sleep(0.6)
        self.assertEqual(self.page.driver.current_url, link)
        self.page.run("document.getElementById('pin').click()")
        self.assertEqual(self.page.run(told), "")
        self.assertEqual(self.page.run("return heliograph.app.comparing()"), 3)

    def test_names_what_it_ignores_of_a_link(self):
        damaged = {"exposure": "bright", "tone": "7", "channel": "colour", "camera": "1,2,3", "range": "5,1",
                   "region": "9,9,9",
                   "edits": "[1", "filter": "cubic", "zoom": "-1", "centre": "2,2", "compare": "flip", "split": "NaN",
                   "sessions": "1;2,1", "mode": "99", "size": "10", "samples": "", "colour": "red", "__proto__": "1"}
        self.open(**damaged)
        text = self.page.wait("document.getElementById('link-text').textContent.includes('sessions=')"
                              " && document.getElementById('link-text').textContent")
        for name, value in damaged.items():
            self.assertIn(f"{name}={value}", text)
        self.assertIn("exposure=bright (a number from -64 to 64)", text)
        self.page.screenshot("damaged-link")
        look = self.page.state()["look"]
        self.assertEqual([look["exposure"], look["filter"], look["compare"]], [0, "auto", 0])
        self.assertEqual(self.page.state()["sessions"], 1)
        # Settings of sessions that the daemon does not have.
        self.open(**FIXED | {"mode": ""}, sessions="1,1;2,1234;1,1,colour=1;1,1,roulette=never")
        self.page.wait("heliograph.state(1)?.complete")
        text = self.page.run("return document.getElementById('link-text').textContent")
        for part in ("integrator=1234 (the daemon has 1, ", "colour=1: no number NAME=VALUE", "roulette=never: one of"):
            self.assertIn(part, text)
        owns = self.page.run("return heliograph.app.viewports.map(({ own }) => [own.mode, own.integrator, own.more])")
        self.assertEqual(owns, [[1, 1, ""], [2, 1, ""], [1, 1, ""], [1, 1, ""]])
        # An edit of what is not there.
        edits = json.dumps([["material:99", {"material": {"index": 99, "base_color": {"x": 1}}}]]).replace(" ", "")
        self.open(**FIXED, edits=edits)
        self.assertIn("edits (", self.page.run("return document.getElementById('link-text').textContent"))

    def test_a_link_has_the_size_of_the_picture(self):
        self.open(samples=1, mode=1, preview_rate=0)
        self.page.run("navigator.clipboard.writeText = async (text) => { globalThis.copied = text; };"
                      "document.getElementById('copy-link').click()")
        state = self.page.state()
        self.assertIn(f"size={state['width']}x{state['height']}&", self.page.wait("globalThis.copied"))

    def test_says_what_is_wrong_with_an_address(self):
        self.expected_errors = ()
        self.page.open(address(self.daemon, "no/such/file.gltf"))
        text = self.page.wait("document.getElementById('messages').textContent"
                              " || document.getElementById('open-note')?.textContent")
        self.assertIn("no/such/file.gltf", text)
