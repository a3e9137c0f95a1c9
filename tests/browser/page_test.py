"""The page around the picture: small screens, messages, keys that are let go elsewhere, saved files."""
import pathlib
import subprocess
import tempfile

import browser
from viewer_case import FIXED, ViewerCase, read_exr


class PageTest(ViewerCase):
    def screen(self, width, height, ratio):
        """A telephone's, with fingers for a pointer."""
        devtools = self.page.driver.execute_cdp_cmd
        devtools("Emulation.setDeviceMetricsOverride", {"width": width, "height": height, "deviceScaleFactor": ratio,
                                                        "mobile": True})
        devtools("Emulation.setTouchEmulationEnabled", {"enabled": True})
        self.addCleanup(devtools, "Emulation.setTouchEmulationEnabled", {"enabled": False})
        self.addCleanup(devtools, "Emulation.clearDeviceMetricsOverride", {})

    def box(self, selector):
        return self.page.run("const r = document.querySelector(arguments[0]).getBoundingClientRect();"
                             "return [r.left, r.top, r.right, r.bottom]", selector)

    def text(self, control):
        return self.page.run(f"return document.getElementById('{control}').textContent")

    def test_on_a_telephone(self):
        self.screen(390, 844, 2)
        self.open(**{**FIXED, "samples": 256, "mode": 4})
        self.page.wait_for_end()
        # The error is there to be read, wherever the line ends.
        status = self.text("status-text").split(" · ")
        self.assertLess([part.startswith("error") for part in status].index(True), 2, status)
        spill = self.page.run("const t = document.getElementById('status-text');"
                              "return [t.scrollWidth - t.clientWidth, t.scrollHeight - t.clientHeight]")
        self.assertLessEqual(max(spill), 1, status)
        for hold in ("hold X", "Hold X"):
            self.assertNotIn(hold, self.text("compare-note"))
        self.page.run("document.getElementById('pin').click()")
        for control in ("messages", "compare-note"):
            self.assertNotIn("old X", self.text(control))
        # A tap opens the inspector in short, its buttons tell all and close it.
        middle = self.box("#view")
        point = {"x": (middle[0] + middle[2]) / 2 + 30, "y": (middle[1] + middle[3]) / 2 - 40}
        for kind, points in (("touchStart", [point]), ("touchEnd", [])):
            self.page.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        self.page.wait("!document.getElementById('inspector').hidden")
        self.page.screenshot("telephone-portrait")
        short = self.box("#inspector")
        self.page.run("document.getElementById('inspector-more').click()")
        self.page.screenshot("telephone-inspector")
        whole = self.box("#inspector")
        self.assertGreater(whole[3] - whole[1], short[3] - short[1] + 20)
        self.page.run("document.getElementById('inspector-close').click()")
        self.assertTrue(self.page.run("return document.getElementById('inspector').hidden"))
        # Lying on its side, the panel is beside the picture.
        self.screen(667, 375, 2)
        self.page.wait("innerWidth === 667")
        stage, panel = self.box("#stages"), self.box("#panel")
        self.assertGreaterEqual(stage[2] - stage[0], 0.6 * 667 - 1)
        self.assertGreaterEqual(panel[0], stage[2])
        self.page.screenshot("telephone-landscape")
        # A film with a pixel for each of the screen's.
        self.set("size", "screen")
        self.page.wait(f"heliograph.state().width === {2 * round(stage[2] - stage[0])}")
        self.page.wait("heliograph.state().zoom === 1")

    def test_what_is_held_is_let_go_with_the_focus(self):
        self.open(**FIXED)
        self.page.wait_for_end()
        self.page.run("document.getElementById('pin').click()")
        shown = self.page.state()["look"]["compare"]
        for leave in ("dispatchEvent(new Event('blur'))", "document.dispatchEvent(new Event('visibilitychange'))"):
            self.page.run("""const view = document.getElementById('view');
                view.focus();
                for (const code of ['KeyX', 'KeyW'])
                  view.dispatchEvent(new KeyboardEvent('keydown', { code, bubbles: true }));""")
            self.assertEqual(self.page.state()["look"]["compare"], 1)
            self.page.run(leave)
            self.assertEqual(self.page.state()["look"]["compare"], shown)
            still = self.page.driver.execute_async_script("""const done = arguments[0], frames = 4;
                const wait = (n, then) => (n ? requestAnimationFrame(() => wait(n - 1, then)) : then());
                wait(2, () => {
                  const before = String(heliograph.camera.position);
                  wait(frames, () => done(before === String(heliograph.camera.position)));
                });""")
            self.assertTrue(still, "the camera flies on")

    def test_messages(self):
        self.open(**FIXED)
        # A notice with other numbers is the same one.
        for size in ("200x100", "220x100", "240x100"):
            self.set("size-custom", size)
            self.page.wait(f"heliograph.state().width === {size[:3]}")
        aspects = self.page.run("return [...document.querySelectorAll('.message')].filter((m) => "
                                "m.textContent.includes('the camera frames an aspect')).length")
        self.assertEqual(aspects, 1)
        # Escape closes the newest.
        self.page.run("heliograph.app.say('one'); heliograph.app.say('two', 'error')")
        self.canvas().send_keys("\ue00c")
        self.assertIn("one", self.text("messages"))
        self.assertNotIn("two", self.text("messages"))
        # A copied link says what it lacks.
        self.page.run("""navigator.clipboard.writeText = async () => {};
            const { connection, copyLink } = heliograph.app;
            connection.token = 'secret';
            heliograph.app.copyLink();""")
        self.wait_for_message("without the token")
        self.page.run("heliograph.app.connection.token = ''; heliograph.app.copyLink()")
        self.wait_for_message("The link is on the clipboard.")
        self.page.wait("document.getElementById('plot-target')")
        group = "return document.getElementById('plot-target').closest('[role=group]').ariaLabel"
        self.assertEqual(self.page.run(group), "Standard error against time")

    def test_finds_the_noisiest_pixel(self):
        self.open(**FIXED)
        self.page.wait_for_end()
        self.canvas().send_keys("g")
        at = self.page.wait("heliograph.app.inspector.mark")
        told = self.text("live")
        self.assertIn(f"Noisiest: Pixel {at[0]}, {at[1]}: red", told)
        self.assertIn("plus or minus", told)
        variance = self.page.run("""const { film } = heliograph.app.main.picture;
            return Array.from({ length: 120 }, (_, y) => Array.from({ length: 160 }, (_, x) =>
              ['R', 'G', 'B'].reduce((sum, name) => sum + film.at(`variance.${name}`, x, y), 0) / 3));""")
        blocks = {(x, y): [(variance[v][u], [u, v]) for v in range(y, min(y + 16, 120)) for u in range(x, x + 16)]
                  for y in range(0, 120, 16) for x in range(0, 160, 16)}
        noisiest = max(blocks.values(), key=lambda block: sum(v for v, _ in block) / len(block))
        self.assertEqual(max(noisiest)[1], at)
        # Of what is shown alone.
        self.page.run("heliograph.app.main.showBox([0, 0, 40, 30]); document.getElementById('noisiest').click()")
        x, y = self.page.run("return heliograph.app.inspector.at")
        self.assertTrue(x < 45 and y < 35, (x, y))
        self.page.screenshot("noisiest")

    def test_saves_compressed(self):
        with tempfile.TemporaryDirectory() as folder:
            self.page.driver.execute_cdp_cmd("Browser.setDownloadBehavior",
                                             {"behavior": "allow", "downloadPath": folder})
            self.open(**{**FIXED, "region": "16,8,144,115"})
            self.page.wait_for_end()
            self.page.run("""globalThis.said = [];
                new MutationObserver((list) => list.forEach(({ addedNodes }) =>
                  addedNodes.forEach((node) => said.push(node.textContent))))
                  .observe(document.getElementById('messages'), { childList: true });
                document.getElementById('save-exr').click()""")
            self.wait_for_message("Saved cornell-box.exr")
            said = self.page.run("return said")
            self.assertEqual(said, ["Saving cornell-box.exr …", "Saved cornell-box.exr."])
            file = browser.eventually(lambda: next(pathlib.Path(folder).glob("*.exr"), None), what="the saved file")
            info = subprocess.run(["oiiotool", "--info", "-v", str(file)], capture_output=True, text=True, check=True)
            self.assertIn('compression: "zip"', info.stdout)
            saved = read_exr(file)
            self.assertEqual(len(saved), 128 * 107)
            places = [(x, y) for x in range(16, 144, 9) for y in range(8, 115, 7)] + [(143, 114)]
            shown = self.page.run("return arguments[0].map(([x, y]) => heliograph.pixel(x, y))", places)
            for place, pixel in zip(places, shown):
                for name in ("R", "G", "variance.B", "samples", "display.R"):
                    self.assertAlmostEqual(saved[place][name], pixel[name], delta=1e-6 + 1e-3 * abs(pixel[name]))
            # An error is told.
            self.page.run("heliograph.app.main.picture.film.names = () => { throw new Error('no memory'); };"
                          "heliograph.app.save('exr')")
            self.wait_for_message("could not be saved: no memory")
