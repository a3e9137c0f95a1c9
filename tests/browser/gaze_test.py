"""With foveation samples go where the person looks: the pointer, an inspected pixel, or a pinned point."""
import browser
from viewer_case import ViewerCase

FOVEATED = {"mode": 1, "seed": 7, "samples": 64, "size": "160x120", "preview_rate": 0, "foveation": 2}


class GazeTest(ViewerCase):
    def samples_at(self, x):
        """In the middle row."""
        return self.page.run(f"return heliograph.app.main.picture.film.at('samples', {x}, 60)")

    def samples_at_left(self):
        """Of each session, mean over pixels around (24, 60)."""
        return self.page.run("""return heliograph.app.viewports.map(({ picture: { film } }) => {
              let sum = 0;
              for (let y = 52; y < 68; y++) for (let x = 16; x < 32; x++) sum += film.at('samples', x, y);
              return sum / 256;
            });""")

    def place(self, x, y, number=0):
        """A point of a film, in CSS pixels of the window."""
        return self.page.run("const [x, y, number] = arguments, v = heliograph.app.viewports[number];"
                             "const r = v.overlay.getBoundingClientRect(), at = v.stageAt(x, y);"
                             "return [r.left + at[0], r.top + at[1]]", x, y, number)

    def point_at(self, x, number=0):
        at = self.place(x, 60, number)
        self.page.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {"type": "mouseMoved", "x": at[0], "y": at[1]})

    def tap(self, x, y):
        at = self.place(x, y)
        for kind, points in (("touchStart", [{"x": at[0], "y": at[1]}]), ("touchEnd", [])):
            self.page.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def wait_for_gaze(self, x, y):
        self.page.wait(f"Math.hypot(heliograph.state().gaze.x - {x}, heliograph.state().gaze.y - {y}) < 2")

    def gazes(self):
        """How often one was told between views."""
        return self.page.run("return heliograph.counters.gazes")

    def status(self):
        return self.page.run("return document.getElementById('status-text').textContent")

    def test_samples_go_where_the_pointer_is(self):
        self.open(**FOVEATED)
        self.page.wait_for_end()
        state = self.page.state()
        self.assertEqual(state["gaze"], {"x": 80, "y": 60}, "the middle, where nobody has pointed yet")
        revision = state["revision"]
        samples = "heliograph.app.main.picture.film.at('samples', {}, 60)"
        corner = self.samples_at(8)
        self.assertLess(corner, self.samples_at(80))
        self.point_at(8)
        self.page.wait(f"{samples.format(8)} > {2 * corner}")
        state = self.page.state()
        self.assertLess(abs(state["gaze"]["x"] - 8), 2)
        self.assertEqual(state["revision"], revision)
        self.assertNotIn("gaze", self.status())
        self.canvas().send_keys("l")
        self.page.wait("heliograph.state().gazePinned")
        self.assertIn("gaze pinned", self.status())
        self.page.screenshot("pinned-gaze")
        self.point_at(100)
        self.canvas().send_keys("\ue007")  # enter inspects the middle
        self.page.wait_for_frames(3)
        self.assertLess(abs(self.page.state()["gaze"]["x"] - 8), 2, "a pinned gaze moved")
        self.canvas().send_keys("l")
        self.assertNotIn("gaze", self.status())
        self.point_at(101)
        self.page.wait("heliograph.state().gaze.x > 90")
        self.canvas().send_keys("\ue014")  # arrow right: the view takes the gaze along
        self.page.wait_for_end()
        self.page.wait(f"{samples.format(101)} > {2 * corner}")
        self.page.run("heliograph.app.setSettings({ foveation: 0 })")
        self.assertIsNone(self.page.state()["gaze"])
        self.assertEqual(self.page.errors(), [])

    def test_keys_and_fingers_move_it(self):
        self.open(**FOVEATED)
        self.page.wait_for_end()
        self.page.run("document.getElementById('view').focus()")
        self.canvas().send_keys("\ue007")
        self.wait_for_gaze(80.5, 60.5)
        actions = self.actions().key_down("\ue00a").key_down("\ue008")  # alt, shift
        actions.send_keys("\ue012").key_up("\ue008").key_up("\ue00a").perform()  # arrow left: ten pixels
        self.wait_for_gaze(70.5, 60.5)
        self.tap(40, 30)
        self.wait_for_gaze(40, 30)
        # By fingers alone it is pinned, too.
        self.assertFalse(self.page.run("return document.getElementById('gaze-pin').parentElement.hidden"))
        self.page.run("document.getElementById('gaze-pin').click()")
        self.assertEqual(self.page.run("return document.getElementById('gaze-pin').ariaPressed"), "true")
        self.tap(100, 30)
        self.page.wait("heliograph.app.inspector.at[0] > 90")
        self.page.wait_for_frames(3)
        self.wait_for_gaze(40, 30)
        self.page.run("document.getElementById('gaze-pin').click()")
        self.tap(120, 90)
        self.wait_for_gaze(120, 90)

    def test_it_is_told_with_the_settings(self):
        """At once when foveation is switched on, and scaled when the size changes."""
        self.open(**FOVEATED | {"foveation": 1, "samples": 16})
        self.page.wait_for_end()
        self.assertEqual(self.page.run("return document.getElementById('foveation').value"), "0")
        self.assertTrue(self.page.run("return document.getElementById('gaze-pin').parentElement.hidden"))
        self.assertIsNone(self.page.state()["gaze"])
        self.assertEqual(self.gazes(), 0)
        view = self.page.state()["sentViewId"]
        self.set("foveation", 2)
        self.page.wait("heliograph.state().settings.foveation === 2")
        self.page.wait_for_end()
        self.assertEqual(self.gazes(), 1)
        self.assertLess(self.samples_at(8), self.samples_at(80))
        self.point_at(40)
        self.wait_for_gaze(40, 60)
        self.assertEqual(self.gazes(), 2)
        self.page.run("heliograph.app.setSettings({ seed: 8 })")
        self.page.wait("heliograph.state().settings.seed === 8")
        self.assertEqual(self.gazes(), 2, "it was told again though nothing has changed")
        self.set("size-custom", "320x240")
        self.page.wait("heliograph.state().width === 320")
        self.page.wait_for_end()
        self.wait_for_gaze(80, 120)
        self.assertEqual(self.gazes(), 3)
        row = self.page.run("const { film } = heliograph.app.main.picture;"
                            "return [80, 310].map((x) => film.at('samples', x, 120))")
        self.assertGreater(row[0], 2 * row[1])
        self.assertEqual(self.page.state()["sentViewId"], view, "a gaze is no view")

    def test_previews_as_published(self):
        """They come while the camera is dragged; the film that follows is as without a gaze."""
        self.open(**FOVEATED | {"preview_rate": 20, "samples": 4})
        self.set("foveation", 3)
        self.page.wait("heliograph.state().settings.foveation === 3")
        self.page.wait_for_end()
        self.assertIn("a baseline", self.page.run("return document.getElementById('foveation').title"))
        self.assertEqual(self.page.run("return document.getElementById('foveation').value"), "3")
        self.page.wait("location.hash.includes('foveation=3')")
        self.wait_for_gaze(80, 60)
        self.point_at(40)
        self.wait_for_gaze(40, 60)
        before = self.page.run("return heliograph.counters.previews")
        actions = self.actions().click_and_hold(self.canvas())
        for _ in range(60):
            actions.move_by_offset(1, 0)
        actions.perform()
        self.page.wait(f"heliograph.counters.previews >= {before + 2}")
        self.assertGreater(sum(self.page.run("return heliograph.shown(80, 60)")), 0, "black while moving")
        self.page.screenshot("as-published")
        self.actions().release().perform()
        self.page.wait_for_end()
        self.assertEqual(self.samples_at(8), self.samples_at(80))
        self.assertEqual(self.page.errors(), [])

    def test_one_gaze_is_told_to_all(self):
        """To sessions side by side, whichever picture the pointer is over."""
        sessions = FOVEATED | {"sessions": "1,1;2,1;1,1,seed=9"}
        del sessions["mode"]
        self.open(**sessions)
        self.page.wait("[0, 1, 2].every((i) => heliograph.state(i)?.complete && heliograph.state(i).end)")
        revisions = self.page.run("return [0, 1, 2].map((i) => heliograph.state(i).revision)")
        before = self.samples_at_left()
        told = self.gazes()
        self.point_at(24, 1)
        self.wait_for_gaze(24, 60)
        self.page.wait(f"heliograph.counters.gazes === {told + 3}")
        points = self.page.run("return heliograph.app.viewports.map(({ session }) => session.gaze)")
        self.assertEqual(points, [self.page.state()["gaze"]] * 3)
        # The mode of the second sends samples to noise, too.
        browser.eventually(lambda: all(now > 1.3 * then for now, then in zip(self.samples_at_left(), before)),
                           what="samples at the gaze in each picture")
        self.assertEqual(self.page.run("return [0, 1, 2].map((i) => heliograph.state(i).revision)"), revisions)
        self.point_at(24, 1)
        self.page.wait_for_frames(3)
        self.assertEqual(self.gazes(), told + 3, "it was told again though it rests")
        # One that is added looks there, too.
        self.page.run("document.getElementById('session-add').click()")
        self.page.wait("heliograph.state(3)?.complete && heliograph.state(3).end")
        self.assertEqual(self.page.run("return heliograph.app.viewports[3].session.gaze"), points[0])
