"""What the tests of the viewer share: a daemon, a browser, and what a person does with them."""
import json
import os
import pathlib
import re
import subprocess
import tempfile
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


class ViewerCase(unittest.TestCase):
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

    def scenes(self):
        """SceneInfo of all that the daemon holds."""
        return self.page.driver.execute_async_script(
            "const done = arguments[0]; heliograph.app.connection.call('list_scenes').then(({ scenes }) => "
            "done(scenes.map(({ scene_id, edited_from }) => ({ scene_id, edited_from }))))")

    def sessions(self):
        """What `heliograph info` tells of each session of the daemon, by its id."""
        command = [self.options.program, "info", "--server", self.daemon.rpc, "--json"]
        told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        return {session["session_id"]: session for session in json.loads(told)["sessions"]}
