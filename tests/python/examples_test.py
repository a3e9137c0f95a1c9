"""The notebooks of client/python/examples: without outputs in the repository, and they run (full tier)."""

import importlib.util
import json
import os
import shutil

import pytest

from conftest import ROOT

EXAMPLES = sorted((ROOT / "client" / "python" / "examples").glob("*.ipynb"))
NEEDED = ("nbclient", "nbformat", "ipykernel")
WRITES = {
    "01_first_picture": ["first.exr", "first.png"],
    "02_error_against_time": [],
    "03_camera_path_to_video": ["frames/0000.png", "frames/0031.png"],
}
SECONDS = 120  # of a cell, at most; all of a notebook takes less than a minute on an idle machine


def test_all_are_known():
    assert [path.stem for path in EXAMPLES] == sorted(WRITES)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_outputs_are_stripped(path):
    book = json.loads(path.read_text())
    assert path.read_text().endswith("}\n") and book["nbformat"] == 4
    assert set(book["metadata"]) == {"kernelspec", "language_info"}
    for cell in book["cells"]:
        assert cell["metadata"] == {}
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None


@pytest.mark.skipif(os.environ.get("HELIO_TEST_TIER") != "full", reason="of the full tier")
@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_notebook_runs(path, program, tmp_path, monkeypatch):
    lack = [name for name in NEEDED if importlib.util.find_spec(name) is None]
    if lack:
        pytest.skip(f"{', '.join(lack)} not installed in this Python")
    import nbclient
    import nbformat

    folder = tmp_path / "client" / "python" / "examples"
    folder.mkdir(parents=True)
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    shutil.copy(path, folder)
    for name, value in {
        "HELIOGRAPH_DAEMON": program,
        "IPYTHONDIR": tmp_path / "ipython",
        "JUPYTER_RUNTIME_DIR": tmp_path / "runtime",
        "MPLCONFIGDIR": tmp_path / "matplotlib",
        "PYTHONWARNINGS": "error::UserWarning:heliograph",
    }.items():
        monkeypatch.setenv(name, str(value))
    book = nbformat.read(folder / path.name, as_version=4)
    nbclient.NotebookClient(
        book, timeout=SECONDS, kernel_name="python3", resources={"metadata": {"path": str(folder)}}
    ).execute()
    for cell in book.cells:
        for output in cell.get("outputs", []):
            assert output.output_type != "error" and output.get("name") != "stderr", output
    assert [name for name in WRITES[path.stem] if not (folder / name).is_file()] == []
    kinds = {kind for cell in book.cells for output in cell.get("outputs", []) for kind in output.get("data", {})}
    if path.stem == "01_first_picture":
        assert "image/png" in kinds
        if importlib.util.find_spec("anywidget"):
            assert "application/vnd.jupyter.widget-view+json" in kinds
    if path.stem == "03_camera_path_to_video" and (shutil.which("ffmpeg") or importlib.util.find_spec("PIL")):
        assert list(folder.glob("turn.*"))[0].stat().st_size > 10000
