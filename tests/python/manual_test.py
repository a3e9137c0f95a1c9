"""The examples of the manuals run as they stand, with smaller numbers where they would take minutes."""

import os
import re
import subprocess
import sys
import textwrap

import pytest

from conftest import ROOT, eventually
from tev_test import Receiver

# What an example takes for granted.
PRELUDE = """
import heliograph as hg
c = hg.serve()
scene = c.load("scenes/cornell-box/cornell-box.gltf")
a, b = (scene.render(size=(32, 32), until=hg.Samples(16), seed=seed) for seed in (1, 2))
show = repr
"""
MANUAL = re.findall(r"```python\n(.*?)```", (ROOT / "client" / "python" / "README.md").read_text(), re.DOTALL)
FRONT = textwrap.dedent(
    "".join(re.findall(r"    import heliograph as hg\n(?:    .*\n)+", (ROOT / "README.md").read_text()))
)


SMALLER = {
    "range(40)": "range(3)",
    "Samples(256)": "Samples(1)",
    "(640, 360)": "(160, 90)",
    "(0.01)": "(0.05)",
    "=0.02": "=0.1",
    '"samples": (1, 4, 16, 64), "reference_error": 0.05': '"samples": (1, 4), "reference_samples": 64',
    "seeds=5": "seeds=1",
    "seeds=6": "seeds=2",
}


def run(code, program, folder):
    for number, smaller in SMALLER.items():
        code = code.replace(number, smaller)
    (folder / "scenes").symlink_to(ROOT / "scenes")
    environment = dict(os.environ, HELIOGRAPH_DAEMON=program)
    done = subprocess.run(
        [sys.executable, "-B", "-c", code], cwd=folder, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_front_page(program, tmp_path):
    assert len(FRONT.splitlines()) == 5
    assert run(FRONT, program, tmp_path).startswith("(90, 160, 3) 0.0") and (tmp_path / "box.exr").is_file()


@pytest.mark.parametrize("number", range(len(MANUAL)))
def test_manual(number, program, tmp_path):
    code = MANUAL[number]
    if "show_in_tev" in code:
        with Receiver() as receiver:
            code = code.replace("127.0.0.1:14158", receiver.address)
            code = code.replace('show_in_tev("second")', f'show_in_tev("second", address="{receiver.address}")')
            run(PRELUDE + code, program, tmp_path)
            eventually(lambda: set(receiver.images) == {"box", "second"})
        return
    edited = "s.edit(" in code
    if edited:  # shows the picture of the edit, and no other
        code = code.replace("    for frame in s.frames():", "    edited = s.view\n    for frame in s.frames():")
        code += "assert frame.view == edited and (frame.image.rgb != second.rgb).any()\nprint('edited')\n"
    told = run((PRELUDE if "hg.serve()" not in code else "") + code, program, tmp_path)
    assert told.endswith("edited\n") == edited
    if "compare(" in code:
        assert (tmp_path / "box-comparison" / "comparison.json").is_file() and "relative MSE" in told
    if "turn." in code:
        assert sorted(path.name for path in tmp_path.glob("*.png")) == [f"turn.{view:04}.png" for view in range(3)]


def test_manual_has_its_examples():
    assert len(MANUAL) == 7
