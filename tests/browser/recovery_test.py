"""What was refused or went away does not end the page: cameras, scenes, connections."""
import pathlib
import shutil
import socket
import tempfile

import browser
from viewer_case import CORNELL, FIXED, SCENES, ViewerCase, address

RIGHT = "\ue014"


class RecoveryTest(ViewerCase):
    def test_a_refused_camera_is_taken_back(self):
        self.open(**FIXED)
        self.canvas().send_keys(RIGHT)
        self.page.wait_for_end()
        before = self.page.state()["camera"]
        # Not by the panel, which brings it into its range.
        self.page.run("heliograph.camera.optics.lens_radius = 1e13; heliograph.app.moved(performance.now())")
        self.wait_for_message("lens_radius")
        self.page.wait("heliograph.state().attached && heliograph.state().camera.lens_radius !== 1e13")
        self.page.wait_for_picture()
        self.assertEqual(self.page.state()["camera"], before)
        self.canvas().send_keys(RIGHT)
        self.assertNotEqual(self.page.wait_for_end()["camera"], before)

    def test_a_camera_stays_within_reach(self):
        self.open(**FIXED)
        far = self.page.run("""const { app, camera } = heliograph, { size, middle } = camera;
            const distance = () => Math.hypot(...camera.position.map((v, i) => v - middle[i])) / size;
            const told = [];
            for (let i = 0; i < 300; i++) camera.dolly(Math.exp(0.6), 0.3, 0.2, 1.5);
            told.push(distance());
            for (let i = 0; i < 300; i++) camera.pan(3, 1);
            told.push(distance());
            for (let i = 0; i < 3; i++) camera.move([1e9 * size, 0, 0]);
            told.push(distance());
            camera.set({ lens_radius: 1e13, focus_distance: 1e-20 });
            app.moved(performance.now());
            return told;""")
        for distance in far:
            self.assertAlmostEqual(distance, 1e6, delta=1)
        self.page.wait_for_end()
        self.canvas().send_keys("r")
        self.page.wait_for_end()
        self.assertGreater(self.page.run("return heliograph.pixel(80, 60).G"), 0)
        self.assertEqual(self.page.run("return document.querySelectorAll('.message.error').length"), 0)

    def test_a_bad_camera_of_a_link_is_ignored(self):
        good = [0, 1, 5, 0, 0, -1, 0, 1, 0, 0, 1, 0, 0.8, 0, 0, 0, 0]
        bad = {"no fov": {12: -1}, "wide": {12: 4}, "lens": {14: -5}, "large lens": {14: 1e13}, "focus": {15: -1},
               "aspect": {16: -3}, "parallel up": {3: 0, 4: 1, 5: 0}, "no up": {7: 0}, "no view": {5: 0},
               "far": {0: 1e13}, "two projections": {13: 1}}
        cameras = {name: [change.get(i, v) for i, v in enumerate(good)] for name, change in bad.items()}
        self.open(**FIXED, camera=",".join(map(str, cameras["parallel up"])))
        self.assertIn("camera=", self.page.run("return document.getElementById('link-text').textContent"))
        taken = self.page.driver.execute_async_script("""const [good, cameras, done] = arguments;
            import('/camera/camera.js').then(({ isCamera }) =>
              done([isCamera(good), Object.keys(cameras).filter((name) => isCamera(cameras[name]))]))""", good, cameras)
        self.assertEqual(taken, [True, []])
        # One that the daemon alone refuses: so far away that what it looks at is where it is. The scene's own is taken.
        self.open(**FIXED, camera="1e12,0,0,1,0,0,0,1,0,0,0,0,0.8,0,0,0,0")
        self.page.wait_for_end()
        self.assertTrue(self.page.run("return heliograph.camera.isHome"))

    def test_a_daemon_without_the_scene_is_told_until_it_has_it(self):
        self.expected_errors = ("WebSocket connection", "ERR_CONNECTION_REFUSED")
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder, pathlib.Path(CORNELL).parent)
            shutil.copytree((SCENES / CORNELL).parent, scene)
            own = browser.Daemon(self.options.daemon, folder)
            self.addCleanup(lambda: own.stop())
            self.hosts = {own.http}
            self.page.open(address(own, **FIXED))
            self.page.wait_for_end()
            own.stop()
            away = pathlib.Path(folder, "away")
            scene.rename(away)
            own = browser.Daemon(self.options.daemon, folder, own.port)
            self.page.wait("document.getElementById('banner').textContent.includes('no longer has the scene')")
            self.assertIn("stopped", self.page.run("return document.getElementById('status-text').textContent"))
            self.assertEqual(self.page.run("return document.getElementById('connection').dataset.state"), "stopped")
            self.page.screenshot("scene-gone")
            away.rename(scene)
            self.page.run("document.getElementById('try-again').click()")
            self.page.wait("document.getElementById('banner').hidden")
            self.page.wait_for_end()
            self.assertNotIn("stopped", self.page.run("return document.getElementById('status-text').textContent"))

    def test_a_picture_goes_on_through_a_restart(self):
        """A daemon with a state folder that is stopped and started again at its port: the same session, and samples."""
        self.expected_errors = ("WebSocket connection", "ERR_CONNECTION_REFUSED")
        with tempfile.TemporaryDirectory() as state:
            arguments = ("--state", state)
            own = browser.Daemon(self.options.daemon, SCENES, arguments=arguments)
            self.addCleanup(lambda: own.stop())
            self.hosts = {own.http}
            self.page.open(address(own, **{**FIXED, "samples": 1000000}))
            self.page.wait("globalThis.heliograph?.state()?.progress?.samples_per_pixel >= 64")
            session = self.page.state()["session"]
            self.page.run("""globalThis.states = new Set();
                new MutationObserver(() => states.add(document.getElementById('connection').textContent))
                  .observe(document.getElementById('connection'), { childList: true });""")
            own.stop()
            self.page.wait("states.has('reconnecting')")
            before = self.page.state()["progress"]["samples_per_pixel"]
            own = browser.Daemon(self.options.daemon, SCENES, own.port, arguments=arguments)
            self.page.wait("heliograph.state().connection === 'open' && heliograph.state().attached")
            lowest = self.page.wait("heliograph.state().progress?.samples_per_pixel")
            self.page.wait("document.getElementById('banner').hidden")
            self.assertEqual(self.page.state()["session"], session)
            self.assertGreaterEqual(lowest, before)
            self.page.wait(f"heliograph.state().progress.samples_per_pixel > {lowest}")

    def test_a_full_daemon_leaves_a_sentence(self):
        self.expected_errors = ("503", "Failed to load")
        full = browser.Daemon(self.options.daemon, SCENES, arguments=("--max-http-connections", "2"))
        self.addCleanup(full.stop)
        self.hosts = {full.http, self.daemon.http}
        with socket.create_connection(("127.0.0.1", full.port)):
            self.page.open(f"http://{full.http}/")
            shown = "const p = document.getElementById('loading'); return p?.checkVisibility() ? p.textContent : ''"
            browser.eventually(lambda: any("503" in error for error in self.page.errors()), what="a refused module")
            self.assertIn("full or gone", self.page.run(shown))
            self.page.screenshot("daemon-full")
        # The page itself may load, and only then find no connection.
        self.open(**FIXED)
        self.assertEqual(self.page.run(shown), "")
        told = self.page.driver.execute_async_script("""const done = arguments[0], { fetch } = window;
            window.fetch = async () => ({ status: 503, ok: false });
            const other = new heliograph.app.connection.constructor('', (...told) => {
              other.stop();
              done(told);
            });
            other.start().finally(() => { window.fetch = fetch; });""")
        self.assertEqual(told[0], "lost")
        self.assertIn("--max-http-connections", told[1])
        self.assertIn("Trying again", told[2])

    def test_a_sentence_that_lasts_is_announced_once(self):
        self.open(**FIXED)
        changes = self.page.driver.execute_async_script("""const done = arguments[0];
            import('/messages.js').then(({ banner }) => {
              const alert = document.querySelector('#banner [role=alert]');
              let changes = 0;
              new MutationObserver((list) => { changes += list.length; })
                .observe(alert, { childList: true, characterData: true, subtree: true });
              for (const wait of [1, 2, 4]) banner('Gone.', `Again in ${wait} s.`);
              const told = document.getElementById('banner').textContent;
              setTimeout(() => { banner(''); done([changes, told]); });
            });""")
        self.assertEqual(changes, [1, "Gone. Again in 4 s."])
