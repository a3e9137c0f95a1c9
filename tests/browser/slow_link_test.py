"""The page over links that take one megabyte a second, and less."""
import pathlib
import subprocess
import tempfile
import unittest

import slow_link
from viewer_case import CORNELL, FULL, SCENES, ViewerCase, address, read_exr

RATE = 1e6
SLOWER = 3e5
SIZE = "400x300"


class SlowLinkTest(ViewerCase):
    def open_over_link(self, rate=RATE, **state):
        self.link = slow_link.SlowLink(self.daemon.http, rate)
        self.addCleanup(self.link.stop)
        self.hosts = {self.link.host}
        self.page.open(address(self.daemon, **state).replace(self.daemon.http, self.link.host))

    def test_is_known_and_whole_pictures_come_while_the_camera_moves(self):
        # Samples without an end: the film sends all the time.
        self.open_over_link(size=SIZE, samples=0, seed=7)
        self.page.wait("globalThis.heliograph && heliograph.app.link.slow", 60)
        rate = self.page.run("return heliograph.app.link.rate")
        self.assertGreater(rate, 0.4 * RATE)
        self.assertLess(rate, 2.5 * RATE)
        self.page.wait_for_picture(60)
        before, passed = self.page.run("return {...heliograph.counters}"), self.link.passed
        actions = self.actions().click_and_hold(self.canvas())
        for step in range(90):
            actions.move_by_offset(1 if step < 45 else -1, 0)
        actions.release().perform()
        self.page.wait(f"heliograph.counters.previews >= {before['previews'] + 4}", 60)
        self.assertLess((self.link.passed - passed) / 4, 400 * 300 * 6, "previews are not JPEG")
        self.assertEqual(self.page.run("return heliograph.app.link.jpeg"), True)

    def test_a_picture_at_rest_comes_in_full(self):
        self.open_over_link(size="320x240", samples=64, seed=7, mode=1, preview_rate=0)
        self.page.wait("globalThis.heliograph && heliograph.app.link.slow", 60)
        self.page.wait_for_end(90)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "reference.exr")
            subprocess.run([self.options.program, "render", str(SCENES / CORNELL), "--server", self.daemon.rpc, "--size", "320x240",
                            "--samples", "64", "--seed", "7", "--mode", "pt", "--output", str(file)], check=True,
                           capture_output=True)
            reference = read_exr(file)
        places = [(x, y) for x in range(5, 320, 13) for y in range(5, 240, 13)]
        shown = self.page.run("return arguments[0].map(([x, y]) => heliograph.pixel(x, y))", places)
        for place, pixel in zip(places, shown):
            for name in ("R", "variance.G", "samples"):
                expected = reference[place][name]
                self.assertAlmostEqual(pixel[name], expected, delta=2**-24 + 2**-9 * expected, msg=(place, name))

    # ---- a film of the window's size, which takes some 20 s ----------------------------------------------------------

    def watch(self):
        """Notes each change of the pixels that show the view."""
        self.page.wait("globalThis.heliograph?.app.viewports.length")
        self.page.run("""globalThis.covered = [0];
            globalThis.watching = setInterval(() => {
              const { covered: now } = heliograph.state();
              if (now !== covered.at(-1)) covered.push(now);
            }, 20);""")

    def assert_never_less(self):
        covered = self.page.run("clearInterval(watching); return covered")
        self.assertEqual(covered, sorted(covered))
        return covered

    def test_the_first_picture_comes_soon_and_stays(self):
        self.open_over_link(SLOWER, samples=0, seed=7)
        self.watch()
        self.page.wait("heliograph.state().width > 600 && heliograph.state().covered"
                       " === heliograph.state().width * heliograph.state().height", 30)
        self.page.screenshot("slow-link-first-picture")
        self.assertTrue(self.page.state()["preview"])
        self.page.wait("heliograph.counters.filmTiles >= 4", 30)
        self.assert_never_less()

    @unittest.skipUnless(FULL, "only in ./check --full")
    def test_tiles_stay_when_the_budget_changes(self):
        # Without previews, so that tiles alone cover the view.
        self.open_over_link(SLOWER, samples=0, seed=7, preview_rate=0)
        self.watch()
        self.page.wait("heliograph.app.link.slow && heliograph.app.main.picture.valid.size >= 3", 30)
        revision = self.page.state()["revision"]
        self.page.run("heliograph.app.setBudget({ samples: 5000 })")
        self.page.wait(f"heliograph.state().revision > {revision}", 30)
        self.page.wait("heliograph.app.main.picture.fresh.size >= 1", 30)
        self.assertFalse(self.page.state()["complete"], "too fast to tell anything")
        self.assertGreater(len(self.assert_never_less()), 3)

    def test_a_rate_is_the_median_of_reports(self):
        self.page.open(address(self.daemon, size="160x120", samples=1))
        self.page.wait_for_picture()
        told = self.page.run("""let settled = false, changes = 0;
            const link = new heliograph.app.link.constructor(() => changes++, () => settled), told = [];
            const reports = (...rates) => {
              for (const rate of rates) link.heldUp(rate);
              told.push(link.rate);
            };
            reports(3.9e5);
            reports(2.6e5, 4e5, 2.5e5, 2.6e5, 2.6e5); // not while nothing is whole
            reports(1e5, 1e5, 1e5); // but where it is far off
            settled = true;
            reports(1.4e5, 1.6e5);
            reports(1.4e5);
            return told;""")
        self.assertEqual(told, [3.9e5, 3.9e5, 1e5, 1e5, 1.4e5])
