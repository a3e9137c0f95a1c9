"""A first visit to the page, from opening a scene to saving the picture."""
import pathlib
import subprocess
import tempfile
import time
import unittest

import browser
from viewer_case import FULL, ViewerCase


class VisitTest(ViewerCase):
    @unittest.skipUnless(FULL, "only in ./check --full")
    def test_a_first_visit(self):
        """What a person does who has never seen the page, by mouse and keys alone; a screenshot of each step."""
        driver = self.page.driver
        steps = iter(range(1, 100))

        def shot(name):
            time.sleep(0.4)
            self.page.screenshot(f"visit-{next(steps):02}-{name}")

        def find(control):
            return driver.find_element("id", control)

        def first(selector):
            return browser.eventually(lambda: driver.find_elements("css selector", selector), what=selector)[0]

        def choose(control, text):
            from selenium.webdriver.support.select import Select
            Select(find(control)).select_by_visible_text(text)

        def unfold(section):
            if not find(section).get_property("open"):
                driver.find_element("css selector", f"#{section} > summary").click()

        with tempfile.TemporaryDirectory() as folder:
            driver.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": folder})
            # Opens a scene.
            self.page.open(f"http://{self.daemon.http}/")
            self.page.wait("document.querySelectorAll('#files button').length")
            shot("welcome")
            for name in ("cornell-spheres", "cornell-spheres.gltf"):
                first(f"#files [data-path$='{name}']").click()
            self.page.wait_for_picture()
            self.assertIn("cornell-spheres", find("scene-name").text)
            shot("opened")
            # Looks at it from elsewhere.
            start = self.position()
            drag = self.actions().click_and_hold(self.canvas())
            for _ in range(20):
                drag.move_by_offset(4, 1)
            drag.perform()
            shot("orbits")
            self.actions().release().perform()
            self.assertNotEqual(self.position(), start)
            self.page.wait_for_picture()
            shot("orbited")
            # Looks for the noisiest part, and reads its error.
            choose("channel", "Standard error")
            self.page.wait_for_picture()
            time.sleep(1)  # the range follows the picture
            shot("noise")
            self.assertEqual(find("scale-name").text, "Standard error")
            block = self.page.run("""const { picture } = heliograph.app.main, { width, height } = picture;
                let worst = [0, 0, 0];
                for (let y = 0; y + 16 <= height; y += 8) for (let x = 0; x + 16 <= width; x += 8) {
                  let sum = 0;
                  for (let i = 0; i < 256; i++) sum += picture.film.at('variance.G', x + i % 16, y + (i >> 4));
                  if (sum > worst[0]) worst = [sum, x, y];
                }
                return worst;""")
            self.actions().move_to_element(find("tool-zoom")).click().perform()
            shot("box")
            from_middle = ("const [x, y] = heliograph.app.main.stageAt(...arguments);"
                           "const r = document.getElementById('view').getBoundingClientRect();"
                           "return [x - r.width / 2, y - r.height / 2]")
            corners = [self.page.run(from_middle, *[v + more for v in block[1:]]) for more in (0, 16)]
            (x0, y0), (x1, y1) = corners
            self.actions().move_to_element_with_offset(self.canvas(), int(x0), int(y0)).click_and_hold().move_by_offset(
                int(x1) - int(x0), int(y1) - int(y0)).release().perform()
            self.assertGreater(self.page.state()["zoom"], 10)
            self.actions().move_to_element(self.canvas()).perform()
            self.page.wait("!document.getElementById('inspector').hidden")
            self.assertIn("±", find("inspector").text)
            shot("error-of-a-pixel")
            self.canvas().send_keys("0")
            choose("channel", "Display")
            # Changes a light, with the picture before it pinned.
            self.page.run("heliograph.app.setBudget({ samples: 24 })")
            self.page.wait_for_end()
            unfold("section-compare")
            find("pin").click()
            shot("pinned")
            unfold("section-scene")
            first("#lights summary").click()
            strength = first("#lights input[type=number]")
            shot("light")
            value = float(strength.get_attribute("value"))
            strength.clear()
            strength.send_keys(f"{value / 2}\n")
            self.page.wait("heliograph.app.scenes.edits.length === 1")
            time.sleep(0.5)  # its film begins
            self.page.wait_for_end()
            shot("before-and-after")
            ratio = self.page.run("""const { film, reference, width, height } = heliograph.app.main.picture;
                const sums = [0, 0];
                for (let y = 0; y < height; y++) for (let x = 0; x < width; x++) {
                  [film, reference].forEach((layer, i) => { sums[i] += layer.at('G', x, y); });
                }
                return sums[0] / sums[1];""")
            self.assertAlmostEqual(ratio, 0.5, delta=0.05)
            for way in ("Absolute difference", "Relative difference", "In standard errors"):
                choose("compare", way)
                time.sleep(1)
                shot(way.lower().replace(" ", "-"))
            # Saves the picture.
            find("save-exr").click()
            file = browser.eventually(lambda: list(pathlib.Path(folder).glob("*.exr")), what="the saved file")[0]
            time.sleep(0.5)
            shot("saved")
            saved = subprocess.run(["oiiotool", "--info", "-v", str(file)], capture_output=True, text=True, check=True)
            self.assertIn("variance.R", saved.stdout)
            self.assertIn(f"Saved {file.name}", find("messages").text)
            find("help-open").click()
            shot("keys")
            top = self.page.run("return document.querySelector('#help h1').getBoundingClientRect().top")
            self.assertGreaterEqual(top, 0)
            find("help-close").click()
