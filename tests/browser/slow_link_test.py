"""The page over a link that takes one megabyte a second."""
import pathlib
import subprocess
import tempfile

import slow_link
from viewer_case import CORNELL, SCENES, ViewerCase, address, read_exr

RATE = 1e6
SIZE = "400x300"


class SlowLinkTest(ViewerCase):
    def setUp(self):
        super().setUp()
        self.link = slow_link.SlowLink(self.daemon.http, RATE)
        self.addCleanup(self.link.stop)
        self.hosts = {self.link.host}

    def open_over_link(self, **state):
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
        self.open_over_link(size=SIZE, samples=256, seed=7, mode=1, preview_rate=0)
        self.page.wait("globalThis.heliograph && heliograph.app.link.slow", 60)
        self.page.wait_for_end(90)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "reference.exr")
            subprocess.run([self.options.program, "render", str(SCENES / CORNELL), "--server", self.daemon.rpc, "--size", SIZE,
                            "--samples", "256", "--seed", "7", "--mode", "pt", "--output", str(file)], check=True,
                           capture_output=True)
            reference = read_exr(file)
        places = [(x, y) for x in range(5, 400, 13) for y in range(5, 300, 13)]
        shown = self.page.run("return arguments[0].map(([x, y]) => heliograph.pixel(x, y))", places)
        for place, pixel in zip(places, shown):
            for name in ("R", "variance.G", "samples"):
                expected = reference[place][name]
                self.assertAlmostEqual(pixel[name], expected, delta=2**-24 + 2**-9 * expected, msg=(place, name))
