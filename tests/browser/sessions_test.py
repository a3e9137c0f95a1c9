"""Sessions side by side: one camera drives all, each tells its own error."""
import math

import browser
from viewer_case import CORNELL, FIXED, SCENES, ViewerCase, address


def error_at(points, seconds):
    """On the curve through [seconds, error] points, both axes logarithmic."""
    for (t0, e0), (t1, e1) in zip(points, points[1:]):
        if t0 <= seconds <= t1:
            return e0 * math.exp(math.log(e1 / e0) * math.log(seconds / t0) / math.log(t1 / t0))
    return points[0][1] if seconds == points[0][0] else None


class SessionsTest(ViewerCase):
    def press(self, control):
        self.page.run(f"document.getElementById('{control}').click()")

    def wait_for_all(self, count):
        """Until the films of the newest view are whole in so many sessions."""
        return self.page.wait(f"heliograph.state().sessions === {count} && heliograph.app.viewports.every((v, i) => "
                              "{ const s = heliograph.state(i); return s.complete && s.viewId === s.sentViewId; })")

    def names(self):
        return self.page.run("return heliograph.app.viewports.map(({ name }) => name)")

    def ids(self):
        return self.page.run("return heliograph.app.viewports.map((v, i) => heliograph.state(i).session)")

    def test_pictures_side_by_side_share_zoom_and_pixel(self):
        self.open(**FIXED)
        self.press("session-add")
        self.wait_for_all(2)

        def placed():
            a, b = self.page.run("return [0, 1].map((i) => heliograph.state(i)).map((s) => [s.zoom, ...s.origin])")
            self.assertAlmostEqual(a[0], b[0])
            for i in (1, 2):
                self.assertAlmostEqual(a[i], b[i], delta=1.01)  # the stages' widths may differ by a pixel
            return a

        first = placed()
        second = self.page.driver.find_element("id", "view-2")
        box = second.rect
        self.actions().move_to_element(second).click().perform()
        for x in (box["x"] + box["width"] / 2 + 40, box["x"] + box["width"] / 2 - 50):
            self.page.driver.execute_cdp_cmd("Input.dispatchMouseEvent", {
                "type": "mouseWheel", "x": x, "y": box["y"] + box["height"] / 2, "deltaX": 0, "deltaY": -200,
                "modifiers": 1})  # alt
            self.page.wait(f"heliograph.state().zoom > {first[0]}")
            first = placed()
        # Keys and the box zoom both, too: its first key shows a box of half the sides, an arrow moves it by a fortieth.
        self.page.run("document.getElementById('view').focus()")
        self.canvas().send_keys("+")
        self.assertGreater(browser.eventually(lambda: placed()[0] > first[0] and placed())[0], first[0])
        self.canvas().send_keys("z")
        self.canvas().send_keys("\ue007")
        self.canvas().send_keys("\ue014\ue007")
        zoomed = placed()
        state = self.page.state()
        self.assertEqual(state["frame"]["centre"], [0.525, 0.5])
        rect = self.canvas().rect
        self.assertAlmostEqual(state["zoom"], min(rect["width"] / 80, rect["height"] / 60), places=3)
        self.assertEqual(zoomed[0], state["zoom"])
        # The pixel under the pointer is marked in both, and told of both.
        self.actions().move_to_element_with_offset(second, 10, 20).perform()
        at = self.page.wait("heliograph.app.inspector.at")
        marks = self.page.run("""return heliograph.app.viewports.map((viewport) => {
              const [x, y] = viewport.stageAt(arguments[0][0], arguments[0][1]), { zoom } = viewport.picture;
              const { data } = viewport.overlay.getContext('2d').getImageData(x - 8, y - 8, zoom + 16, zoom + 16);
              return data.some((value) => value > 0);
            })""", at)
        self.assertEqual(marks, [True, True])
        told = self.page.run("return document.querySelector('#inspector .others').textContent")
        self.assertIn("Path tracing", told)
        self.assertEqual(told.count("±"), 3)
        self.page.screenshot("side-by-side-inspected")
        self.canvas().send_keys("0")
        self.page.wait("heliograph.state().frame === null")
        placed()

    def test_sessions_come_and_go(self):
        """Added by a button, moved by one camera, one closed, one replaced, one made the first."""
        self.open(**FIXED)
        self.press("sessions-modes")
        self.wait_for_all(4)
        self.assertEqual(self.names(), ["Path tracing", "Combined", "Reproject", "Adaptive"])
        colours = self.page.run("return heliograph.app.viewports.map(({ colour }) => colour)")
        self.assertEqual(len(set(colours)), 4)
        # One camera.
        before = [self.page.run(f"return heliograph.pixel(70, 60, {i})")["R"] for i in range(4)]
        self.page.run("heliograph.camera.orbit(0.5, 0.1); heliograph.app.moved(performance.now())")
        self.wait_for_all(4)
        self.page.wait("heliograph.app.viewports.every((v) => v.end)")
        views = self.page.run("return heliograph.app.viewports.map(({ session }) => session.view.position.x)")
        self.assertEqual(len(set(views)), 1)
        after = [self.page.run(f"return heliograph.pixel(70, 60, {i})")["R"] for i in range(4)]
        self.assertFalse(set(before) & set(after))
        self.page.screenshot("four-sessions")
        # One is closed: the others go on as they were.
        left = self.ids()
        self.press("tile-2-close")
        del left[1]
        self.assertEqual(self.names(), ["Path tracing", "Reproject", "Adaptive"])
        browser.eventually(lambda: set(self.sessions()) == set(left), what="three sessions of the daemon")
        self.assertEqual(self.ids(), left)
        # Another is the first: its settings are those of the panel, its picture is kept.
        self.press("tile-3-main")
        self.assertEqual(self.names(), ["Adaptive", "Path tracing", "Reproject"])
        self.assertEqual(self.ids(), [left[2], left[0], left[1]])
        self.assertEqual(self.page.run("return [document.getElementById('mode').value, document.activeElement.id]"),
                         ["2", "view"])
        self.assertIn("Adaptive", self.page.run("return document.getElementById('view').closest('section').ariaLabel"))
        # One is replaced; all begin anew, so that their times are equal.
        self.press("tile-3-edit")
        self.set("session-mode", 1)
        self.set("session-more", "seed=8 colour=3")
        self.wait_for_message("colour=3: no number NAME=VALUE")
        self.set("session-more", "seed=8")
        self.page.wait("heliograph.state(2).settings?.seed === 8 && heliograph.state(2).end")
        self.wait_for_all(3)
        self.assertFalse(set(self.ids()) & set(left))
        self.assertNotIn("made again", self.page.run("return document.getElementById('messages').textContent"))
        # Settings that the daemon refuses: those before are in force again, and the tile says why.
        self.set("session-more", "max_segments=65536")
        self.wait_for_message("Path tracing · max_segments=65536: ")
        self.page.wait("heliograph.state(2).own.more === 'seed=8' && heliograph.state(2).complete")
        self.press("session-close")
        self.press("tile-1-close")
        self.assertEqual(self.names(), ["Path tracing"])
        self.assertTrue(self.page.run("return document.getElementById('session-close').disabled"))
        self.wait_for_all(1)

    def test_errors_are_compared_at_equal_time(self):
        self.open(**FIXED | {"samples": 1024, "mode": "", "sessions": "1,1;2,1;1,1,layer=display"})
        self.wait_for_all(3)
        self.page.wait("heliograph.app.viewports.every((v) => v.points.length > 3)")
        self.press("pause")
        self.show("section-error")
        self.page.wait("heliograph.app.panels.plot.plot?.data[0].length > 3")
        told, points = self.page.run("""heliograph.app.viewports.forEach(({ tile }) => tile.tell());
            heliograph.app.panels.plot.refresh();
            return [heliograph.app.viewports.map(({ tile }) => tile.figures.textContent),
                    heliograph.app.viewports.map(({ points }) => points)]""")
        for text, curve in zip(told[1:], points[1:]):
            seconds = min(curve[-1][0], points[0][-1][0])
            ratio = error_at(curve, seconds) / error_at(points[0], seconds)
            shown = float(text.split(" × first")[0].split(" ")[-1])
            self.assertAlmostEqual(shown, ratio, delta=0.01 * ratio, msg=(text, ratio))
        self.assertIn("relMSE", told[1])
        # The layer tells its own error: the root of the mean of what the daemon estimates for its pixels.
        expected = self.page.run("""const { film } = heliograph.app.viewports[2].picture;
            let sum = 0;
            for (let y = 0; y < 120; y++) for (let x = 0; x < 160; x++) sum += film.at('display.error', x, y) ** 2;
            return Math.sqrt(sum / (160 * 120));""")
        self.assertAlmostEqual(float(told[2].split("display error ")[1].split(" ")[0]), expected, delta=0.01 * expected)
        self.set("channel", "radiance")
        channels = self.page.run("return heliograph.app.viewports.map(({ look }) => look.channel)")
        self.assertEqual(channels, ["radiance", "radiance", "display"])
        lines = self.page.run("const { plot } = heliograph.app.panels.plot;"
                              "return plot.data.slice(2).map((column) => column.filter(Boolean).length)")
        self.assertEqual(lines, [len(curve) for curve in points] + 5 * [0])

    def test_one_preview_is_shown_by_all(self):
        """While the camera moves only the first session makes previews, and the others show them."""
        self.open(**FIXED | {"mode": "", "preview_rate": 60, "sessions": "1,1;4,1"})
        self.wait_for_all(2)
        self.page.wait("heliograph.app.viewports.every((v) => v.end)")
        begun = self.page.run("""globalThis.seen = { shown: 0, views: heliograph.state(1).sentViewId };
            const { main } = heliograph.app, [, other] = heliograph.app.viewports;
            const turn = () => {
              if (other.picture.under === other.picture.preview && other.picture.preview) seen.shown++;
              if (seen.shown >= 3) return;
              heliograph.camera.orbit(0.01, 0);
              heliograph.app.moved(performance.now());
              setTimeout(turn, 20);
            };
            turn();
            return heliograph.state(1).viewId;""")
        self.page.wait("seen.shown >= 3")
        self.wait_for_all(2)
        self.page.wait(f"heliograph.state(1).viewId > {begun} && !heliograph.state(1).preview")
        seconds = self.page.run("return [0, 1].map((i) => heliograph.app.viewports[i].meter.times.preview.length)")
        self.assertGreaterEqual(seconds[0], 3)
        self.assertEqual(seconds[1], 0)
        # It was sent the last view, and none of those before.
        self.assertEqual(self.page.run("return heliograph.state(1).sentViewId - seen.views"), 1)
        self.assertEqual(self.page.run("return heliograph.app.viewports[1].session.view"),
                         self.page.run("return heliograph.camera.message()"))

    def test_a_session_that_is_refused_is_told(self):
        daemon = browser.Daemon(self.options.daemon, SCENES, arguments=("--max-sessions", "2"))
        self.addCleanup(daemon.stop)
        self.hosts.add(daemon.http)
        self.page.open(address(daemon, CORNELL, **FIXED | {"mode": "", "sessions": "1,1;2,1;4,1"}))
        self.wait_for_message("Combined: The daemon is full: max_sessions")
        self.page.wait("[0, 1].every((i) => heliograph.state(i).end)")
        tile = self.page.run("return document.getElementById('view-3').closest('section').textContent")
        self.assertIn("The daemon is full: max_sessions", tile)
        self.assertTrue(self.page.run("return document.getElementById('banner').hidden"))
        self.page.screenshot("refused-session")
        # A session that closes makes room for it.
        self.press("tile-2-close")
        self.page.wait("heliograph.state(1).end && heliograph.state(1).trouble === ''")
        self.assertEqual(self.names(), ["Path tracing", "Combined"])
