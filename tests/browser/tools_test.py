"""What the mouse does, by keys alone and by fingers alone."""
import contextlib
import time

import browser
from viewer_case import FIXED, ViewerCase


class ToolsTest(ViewerCase):
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

    def test_keys_alone_reach_the_tools(self):
        """Region, zoom, split, pivot, focus, and the target in the plot, with the keyboard alone."""
        self.open(**FIXED)
        self.page.wait_for_end()
        arrow, shift, enter, up = "\ue014", "\ue008", "\ue007", "\ue013"
        # The inspected pixel, which the enlarged picture follows.
        self.canvas().send_keys("++++++++" + enter)
        self.page.wait("heliograph.app.inspector.current")
        self.assertIn("red", self.page.run("return document.getElementById('live').textContent"))
        for _ in range(4):
            self.canvas().send_keys("\ue00a" + shift + arrow)
        self.page.wait("heliograph.app.inspector.at[0] === 120")
        inside = """const { inspector } = heliograph.app, [x, y] = heliograph.app.main.stageAt(...inspector.at);
            return [x, heliograph.app.main.stage.clientWidth, heliograph.state().frame.centre[0]];"""
        x, width, centre = self.page.run(inside)
        self.assertTrue(0 <= x <= width, x)
        self.assertGreater(centre, 0.5)
        self.canvas().send_keys("h" + arrow)
        self.page.wait(f"heliograph.state().frame.centre[0] > {centre}")
        pressed = "return document.getElementById('tool-hand').getAttribute('aria-pressed')"
        self.assertEqual(self.page.run(pressed), "true")
        self.canvas().send_keys("\ue00c0")
        self.assertEqual(self.page.run(pressed), "false")
        # Pivot and focus at the inspected pixel.
        before = self.page.run("return heliograph.camera.pivot")
        self.canvas().send_keys("o")
        browser.eventually(lambda: self.page.run("return heliograph.camera.pivot") != before, what="another pivot")
        self.canvas().send_keys("f")
        self.page.wait("heliograph.camera.optics.lens_radius > 0")
        self.page.wait_for_end()
        # A box of a quarter of the picture, moved to the right by an arrow and made taller by another.
        self.canvas().send_keys("b" + enter + arrow)
        self.canvas().send_keys(shift + "\ue015")
        self.canvas().send_keys(enter)
        self.page.wait("heliograph.app.wanted.region")
        self.assertEqual(self.page.run("return heliograph.app.wanted.region"), [44, 30, 124, 94])
        self.page.screenshot("region-by-keys")
        self.page.wait_for_end()
        self.page.run("document.getElementById('region-clear').click()")
        self.page.wait_for_end()
        # Pinned, and the split moved.
        self.canvas().send_keys("p")
        self.canvas().send_keys(">>")
        self.assertAlmostEqual(self.page.state()["look"]["split"], 0.54)
        self.show("section-compare")
        self.page.driver.find_element("id", "split").send_keys(arrow)
        self.assertAlmostEqual(self.page.state()["look"]["split"], 0.55)
        # The target in the plot.
        self.page.wait("document.getElementById('plot-target')")
        target = self.page.driver.find_element("id", "plot-target")
        target.send_keys(up)
        self.page.wait("heliograph.app.budget.error > 0")
        self.assertNotEqual(target.get_attribute("aria-valuetext"), "none")
        target.send_keys("\ue017")  # delete
        self.page.wait("heliograph.app.budget.error === 0")

    def test_fingers_alone_reach_the_tools(self):
        """Inspector, region, zoom, split and the moved picture by touch."""
        self.open(**FIXED)
        self.page.wait_for_end()
        start = self.position()

        def touch(element, *points, held_s=0):
            """Down at the first point, moved over the others; of the element's size."""
            box = self.page.run("const r = arguments[0].getBoundingClientRect();"
                                "return [r.left, r.top, r.width, r.height]", element)
            at = [{"x": box[0] + u * box[2], "y": box[1] + v * box[3]} for u, v in points]
            if len(at) > 1:
                at.append(at[-1])  # rests at the end: the tap after a fling would only stop it
            for i, point in enumerate(at):
                if i and i == len(at) - 1:
                    time.sleep(0.15)
                self.page.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {
                    "type": "touchMove" if i else "touchStart", "touchPoints": [point]})
            time.sleep(held_s)
            self.page.driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

        def tap(control, outcome):
            """Again where a busy page saw a long press."""
            element = self.page.driver.find_element("id", control)
            for attempt in range(6):
                self.page.run("arguments[0].scrollIntoView({ block: 'center' })", element)
                self.page.wait_for_frames(2)  # what a finger hits is known when the scrolled page was drawn
                touch(element, (0.5, 0.5), held_s=0.06 * (attempt % 2))
                with contextlib.suppress(AssertionError):
                    return self.page.wait(outcome, 5)
                self.page.screenshot(f"tap-{control}-{attempt}")
            hit = self.page.run("const r = arguments[0].getBoundingClientRect(), x = r.left + r.width / 2,"
                                "y = r.top + r.height / 2; return [x, y, document.elementFromPoint(x, y)?.outerHTML.slice(0, 120),"
                                "document.getElementById('messages').textContent]", element)
            self.fail(f"{control} is out of a finger's reach: {outcome}; x, y, what is there, and the messages: {hit}")

        touch(self.canvas(), (0.5, 0.4))
        self.page.wait("heliograph.app.inspector.mark")
        self.page.wait("!document.getElementById('inspector').hidden")
        tool = "document.getElementById('view').dataset.tool === "
        tap("tool-zoom", tool + "'zoom'")
        touch(self.canvas(), (0.4, 0.4), (0.5, 0.5), (0.6, 0.6))
        frame = self.page.wait("heliograph.state().frame")
        tap("tool-hand", tool + "'hand'")
        touch(self.canvas(), (0.5, 0.5), (0.4, 0.5), (0.3, 0.5))
        self.page.wait(f"heliograph.state().frame.centre[0] > {frame['centre'][0]} + 0.01")
        tap("tool-hand", tool + "undefined")
        tap("fit", "heliograph.state().frame === null")
        tap("tool-region", tool + "'region'")
        touch(self.canvas(), (0.4, 0.4), (0.5, 0.5), (0.6, 0.6))
        self.page.wait("heliograph.app.wanted.region")
        tap("region-clear", "heliograph.app.wanted.region === null")
        self.page.wait_for_end()
        self.assertEqual(self.position(), start, "no tool has moved the camera")
        self.show("section-compare")
        tap("pin", "heliograph.state().pinned")
        touch(self.canvas(), (0.51, 0.5), (0.4, 0.5), (0.3, 0.5))
        self.page.wait("heliograph.state().look.split < 0.4")
        self.assertEqual(self.position(), start)
        self.show("section-camera")
        touch(self.canvas(), (0.5, 0.4))
        tap("focus-here", "heliograph.camera.optics.lens_radius > 0")
