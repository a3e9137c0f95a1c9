"""The page that `heliograph compare` writes: it needs no daemon, no network and, but for what it adds, no script."""
import pathlib
import subprocess
import tempfile

from viewer_case import CORNELL, SCENES, ViewerCase

SCRIPT = ("--modes", "pt,bdpt", "--seeds", "5", "--samples", "1,2,4", "--size", "64x48", "--reference-samples", "64",
          "--measures", "relmse,mse,flip", "--worst-pixels", "2")
# Bytes of a canvas, and of the picture in the page that has the same pixels.
BYTES = """const bytes = (source) => {
        const canvas = document.createElement('canvas'), context = canvas.getContext('2d');
        canvas.width = source.width;
        canvas.height = source.height;
        context.drawImage(source, 0, 0, canvas.width, canvas.height);
        return [...context.getImageData(0, 0, canvas.width, canvas.height).data];
    };
    const copy = new Image(64, 48);
    copy.src = document.querySelector(`figure[data-name="${arguments[1]}"] img`).src;
    return [bytes(document.getElementById(arguments[0])), bytes(copy)]"""
SHOWN = """return [...document.querySelectorAll('.part')].filter((part) => part.getClientRects().length)
    .map((part) => part.dataset.measure)"""
COUNT = "return [...document.querySelectorAll(arguments[0])].filter((e) => e.getClientRects().length).length"
CURVES = ".part:not([hidden]) .plot .series"


class ReportTest(ViewerCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        command = [cls.options.program, "compare", "--server", cls.daemon.rpc, SCENES / CORNELL, *SCRIPT]
        subprocess.run([*command, "-o", folder.name], check=True, capture_output=True, timeout=60)
        cls.url = pathlib.Path(folder.name, "report.html").as_uri()

    def media(self, name):
        self.page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": name})

    def test_reports_a_comparison(self):
        page, find = self.page, self.page.driver.find_element
        page.open(self.url)
        told = lambda: page.run("return document.getElementById('stage-told').textContent")  # noqa: E731
        page.wait("document.getElementById('stage-told').textContent === 'reference'")

        # One measure at a time, of the regions that it has.
        self.assertEqual(page.run(SHOWN), ["relmse"])
        self.set("region", "dark half")
        self.set("measure", "flip")
        self.assertEqual(page.run(SHOWN), ["flip"])
        self.assertEqual(page.run("return document.getElementById('region').value"), "")
        self.set("measure", "mse")
        self.assertEqual(page.run(SHOWN), ["mse"])
        self.assertEqual(page.run(COUNT, CURVES), 4)
        find("css selector", ".legend li:nth-child(2) button").click()
        self.assertEqual(page.run(COUNT, CURVES), 2)

        # The stage shows what the page shows, from the page's radiance: a pixel's largest channel has 8 bits.
        stage, own = page.run(BYTES, "canvas-a", "reference")
        self.assertLess(sum(abs(a - b) for a, b in zip(stage, own)) / len(own), 0.5)
        self.assertGreater(max(stage), 100)
        visible = "return getComputedStyle(document.getElementById('canvas-b')).visibility"
        self.assertEqual(page.run(visible), "hidden")
        find("id", "stage-frame").send_keys("f")
        self.assertEqual((told(), page.run(visible)), ("pt", "visible"))
        find("id", "canvas-b").click()
        self.assertEqual(told(), "reference")
        page.run("const slider = document.getElementById('stage-exposure'); slider.value = 2;"
                 "slider.dispatchEvent(new Event('input'))")
        page.wait("document.getElementById('stage-stops').textContent === '+2 stops'")
        brighter = page.run(BYTES, "canvas-a", "reference")[0]
        self.assertGreater(sum(brighter), 1.1 * sum(stage))

        # Beside each other along a line that is dragged, or moved by keys.
        self.set("stage-mode", "split")
        divider = find("id", "divider")
        at = lambda: int(divider.get_attribute("aria-valuenow"))  # noqa: E731
        width = page.run("return document.getElementById('stage-pair').clientWidth")
        self.assertEqual(at(), 50)
        self.actions().drag_and_drop_by_offset(divider, -width // 4, 0).perform()
        self.assertLessEqual(abs(at() - 25), 1)
        before = at()
        divider.send_keys("\ue014")  # arrow to the right
        self.assertEqual(at(), before + 1)
        clip = page.run("return getComputedStyle(document.getElementById('canvas-b')).clipPath")
        self.assertAlmostEqual(float(clip.split()[-1].rstrip("%)")), before + 1, delta=1)
        page.screenshot("report")

        # On paper all is there, and nothing to click on.
        self.media("print")
        self.assertEqual(page.run(SHOWN), ["relmse", "relmse", "mse", "mse", "flip"])
        legend = page.run("return document.querySelectorAll('.legend button').length")
        self.assertEqual(page.run(COUNT, "select, button, input"), legend)  # the legend itself
        self.media("")

    def test_needs_no_script(self):
        page = self.page
        page.driver.execute_cdp_cmd("Emulation.setScriptExecutionDisabled", {"value": True})
        self.addCleanup(page.driver.execute_cdp_cmd, "Emulation.setScriptExecutionDisabled", {"value": False})
        page.open(self.url)
        self.assertEqual(page.run(SHOWN), ["relmse", "relmse", "mse", "mse", "flip"])
        self.assertEqual(page.run(COUNT, "img[width='64'][height='48']"), 7)
        self.assertEqual(page.run("return document.querySelector('select').getClientRects().length"), 0)
