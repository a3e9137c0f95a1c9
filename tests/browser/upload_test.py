"""Scenes of the browser's own machine: dropped, refused, cancelled."""
import base64
import hashlib

from viewer_case import CORNELL, FIXED, SCENES, ViewerCase

SCENE = SCENES / CORNELL


class UploadTest(ViewerCase):
    def drop(self, name, data=b"", more=0):
        """Drops a file of this data, and zeros after it, as a person does."""
        self.page.run("""const [name, data, more] = arguments, transfer = new DataTransfer();
            const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
            transfer.items.add(new File([bytes, new Uint8Array(more)], name));
            const event = { dataTransfer: transfer, bubbles: true, cancelable: true };
            document.body.dispatchEvent(new DragEvent('drop', event))""",
                      name, base64.b64encode(data).decode(), more)

    def test_drops_onto_an_open_scene(self):
        before = self.open(**FIXED)
        for name, more, told in (("notes.txt", 10, "None of these files is a scene"),
                                 ("large.glb", None, "takes 5 MB at most")):
            if more is None:
                self.page.run("const a = heliograph.app; a.info = { ...a.info, limits: { ...a.info.limits, "
                              "max_scene_bytes: 5e6 } }")
            self.drop(name, more=more or 6_000_000)
            self.wait_for_message(told)
        self.page.run("delete heliograph.app.info.limits.max_scene_bytes")
        # A folder that cannot be read.
        self.page.run("""const file = (done, failed) => failed(new Error('no right'));
            const entry = { isFile: true, name: 'a.glb', file };
            const event = new Event('drop', { bubbles: true, cancelable: true });
            event.dataTransfer = { items: [{ kind: 'file', webkitGetAsEntry: () => entry }], files: [] };
            document.body.dispatchEvent(event)""")
        self.wait_for_message("no right")
        # One that takes its time: seen over the picture, whose panel is closed; no second one beside it.
        self.page.run("heliograph.app.togglePanel()")
        self.drop("slow.glb", more=80_000_000)
        box = "document.getElementById('upload-box')"
        self.page.wait(f"!{box}.hidden && {box}.getBoundingClientRect().width > 100")
        self.page.screenshot("upload")
        self.drop("second.glb", more=10)
        self.wait_for_message("Another upload is under way")
        self.page.run("document.getElementById('upload-cancel').click()")
        self.wait_for_message("cancelled")
        self.page.wait(f"{box}.hidden")
        self.assertEqual(self.page.state()["scene"], before["scene"])
        # And one that is a scene.
        self.page.run("heliograph.app.togglePanel()")
        self.drop(SCENE.name, SCENE.read_bytes())
        self.page.wait("heliograph.app.scenes.source.files?.length === 1")
        self.page.wait_for_end()
        self.page.wait(f"{box}.hidden")

    def test_digests_are_those_of_sha_256(self):
        """Lengths around a block of 64 bytes, in pieces of all sizes; and the examples of FIPS 180-4."""
        self.open(**FIXED)
        lengths = [0, 1, 3, 55, 56, 63, 64, 65, 119, 120, 128, 1000, 100_003]
        told = self.page.driver.execute_async_script("""const [lengths, done] = arguments;
            import('/protocol/sha256.js').then(({ Sha256 }) => {
              const hex = (bytes) => Array.from(bytes, (b) => b.toString(16).padStart(2, '0')).join('');
              const digest = (bytes, piece) => {
                const sha = new Sha256();
                for (let at = 0; at < bytes.length; at += piece) sha.update(bytes.subarray(at, at + piece));
                return hex(sha.digest());
              };
              const of = (length) => Uint8Array.from({ length }, (_, i) => (i * 7 + (i >> 8)) & 255);
              done([digest(new TextEncoder().encode('abc'), 3),
                ...[1, 7, 64, 1 << 20].map((piece) => lengths.map((length) => digest(of(length), piece)))]);
            });""", lengths)
        self.assertEqual(told[0], "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad")
        expected = [hashlib.sha256(bytes((i * 7 + (i >> 8)) & 255 for i in range(n))).hexdigest() for n in lengths]
        for digests in told[1:]:
            self.assertEqual(digests, expected)
