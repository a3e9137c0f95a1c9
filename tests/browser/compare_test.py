"""Comparisons with a pinned picture."""
import time

from viewer_case import FIXED, ViewerCase


class CompareTest(ViewerCase):
    def test_pins_and_compares(self):
        self.open(**FIXED)
        self.page.wait_for_end()
        self.show("section-compare")
        self.page.run("document.getElementById('pin').click()")
        self.assertTrue(self.page.wait("heliograph.state().pinned"))
        self.canvas().send_keys("\ue014" * 6)
        self.page.wait_for_end()
        left, right = "heliograph.shown(20, 60)", "heliograph.shown(140, 60)"
        present = self.page.run(f"return [{left}, {right}]")

        def choose(way):
            self.page.run("const c = document.getElementById('compare'); c.selectedIndex = arguments[0];"
                          "c.dispatchEvent(new Event('change'))", way)
            time.sleep(0.2)
            self.page.screenshot(f"compare-{way}")
            return self.page.run(f"return [{left}, {right}]")

        pinned = choose(1)
        self.assertNotEqual(pinned, present)
        split = choose(2)
        self.assertIn(split, ([pinned[0], present[1]], [present[0], pinned[1]]))
        for way in (3, 4, 5):
            self.assertNotIn(choose(way), (present, pinned))

    def test_tells_differences_in_standard_errors(self):
        self.open(**{**FIXED, "samples": 256})
        self.page.wait_for_end()
        self.page.run("document.getElementById('pin').click()")
        self.set("seed", 8)
        self.page.wait_for_end()
        told = self.page.run("""const z = [];
            const { picture } = heliograph.app.main;
            for (let y = 0; y < 120; y++) for (let x = 0; x < 160; x++) {
              if (heliograph.pixel(x, y)['variance.G'] > 0) z.push(picture.standardErrors(x, y));
            }
            return [z.length, Math.sqrt(z.reduce((sum, v) => sum + v * v, 0) / z.length),
              z.filter((v) => Math.abs(v) > 2).length / z.length];""")
        self.assertGreater(told[0], 10000)
        self.assertTrue(0.8 < told[1] < 1.1, told)
        self.assertLess(told[2], 0.07, told)
        self.set("compare", 5)
        self.assertIn("independent", self.page.run("return document.getElementById('scale-name').textContent"))

    def test_differences_within_one_film_are_those_of_nested_samples(self):
        """64 samples pinned, the same film grown to 256: var(b - a) = var(a) - var(b), three fifths of their sum."""
        self.open(**{**FIXED, "samples": 64})
        self.page.wait_for_end()
        self.page.run("document.getElementById('pin').click()")
        self.set("compare", 5)
        self.set("channel", "radiance")  # another stream of the same film
        self.page.wait("heliograph.state().planes.length && !heliograph.state().planes.includes('display.R')")
        # The same samples: there is no difference that could be measured.
        self.page.wait_for_end()
        self.assertTrue(self.page.run("return Number.isNaN(heliograph.app.main.picture.standardErrors(80, 60))"))
        self.set("budget-samples", 256)
        self.page.wait("heliograph.state().end && heliograph.state().progress.samples_per_pixel === 256")
        name = self.page.run("return document.getElementById('scale-name').textContent")
        self.assertIn("of one film", name)
        self.page.screenshot("nested-errors")
        told = self.page.run("""const { picture } = heliograph.app.main, nested = [], independent = [];
            const names = ['R', 'G', 'B', 'variance.R', 'variance.G', 'variance.B', 'samples'];
            const luminance = ([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b;
            let wrong = 0, undefinedOnes = 0, background = 0;
            for (let y = 0; y < 120; y++) for (let x = 0; x < 160; x++) {
              const a = names.map((name) => picture.film.at(name, x, y));
              const b = names.map((name) => picture.reference.at(name, x, y));
              const [later, earlier] = [a, b].map((p) => luminance(p.slice(3, 6).map(Math.sqrt)) ** 2);
              const difference = luminance(a) - luminance(b), z = picture.standardErrors(x, y);
              if (a[6] !== 256 || b[6] !== 64) wrong++;
              if (difference === 0 && earlier === 0 && later === 0) { background++; if (z !== 0) wrong++; continue; }
              if (!(earlier > later)) { undefinedOnes++; if (!Number.isNaN(z)) wrong++; continue; }
              const expected = difference / Math.sqrt(earlier - later);
              if (Math.abs(z - expected) > 1e-9 * Math.abs(expected)) wrong++;
              nested.push(z);
              independent.push(difference / Math.sqrt(earlier + later));
            }
            const rms = (list) => Math.sqrt(list.reduce((sum, v) => sum + v * v, 0) / list.length);
            return { wrong, undefinedOnes, background, count: nested.length, nested: rms(nested),
              independent: rms(independent) };""")
        self.assertEqual(told["wrong"], 0, told)
        self.assertGreater(told["count"], 0.9 * (160 * 120 - told["background"]), told)
        # Taken as independent, the two would seem closer than they are by sqrt(3/5).
        self.assertTrue(0.8 < told["nested"] < 1.15, told)
        self.assertTrue(0.6 < told["independent"] < 0.9, told)
        # The screen shows what is told: chequered where it is not defined, a colour of the scale elsewhere.
        colours = self.page.run("""const { picture } = heliograph.app.main, image = picture.snapshot();
            const found = { grey: 0, other: 0, undefinedGrey: 0, undefinedOther: 0 };
            for (let y = 0; y < 120; y++) for (let x = 0; x < 160; x++) {
              const [r, g, b] = image.data.subarray(4 * (y * 160 + x));
              const grey = r === g && g === b, none = Number.isNaN(picture.standardErrors(x, y));
              if (none) found[grey ? 'undefinedGrey' : 'undefinedOther']++;
              else if (Math.abs(picture.standardErrors(x, y)) > 1) found[grey ? 'grey' : 'other']++;
            }
            return found;""")
        self.assertEqual([colours["grey"], colours["undefinedOther"]], [0, 0], colours)
        self.assertEqual(colours["undefinedGrey"], told["undefinedOnes"], colours)
        # Another view with the same seed is another film.
        self.canvas().send_keys("\ue014")
        self.page.wait_for_end()
        self.assertIn("one seed", self.page.run("return document.getElementById('scale-name').textContent"))
