"""The tutorial: every cell runs, and its page has its pictures."""

import base64
import json
import os
import pathlib
import re
import subprocess
import sys

import pytest

SOURCE = pathlib.Path(__file__).parents[3] / "tools" / "python"


def test_the_notebook_holds_no_outputs():
    for cell in json.loads((SOURCE / "tutorial.ipynb").read_text())["cells"]:
        assert not cell.get("outputs") and not cell.get("execution_count")


def test_the_tutorial_counts_its_cells():
    cells = json.loads((SOURCE / "tutorial.ipynb").read_text())["cells"]
    stated = re.search(r"run the (\d+) cells", "".join(cells[0]["source"]))
    assert int(stated[1]) == sum(cell["cell_type"] == "code" for cell in cells)


def test_the_tutorial_runs_and_its_page_has_pictures(tmp_path):
    for module in ("nbconvert", "ipykernel", "matplotlib", "pandas", "networkx"):
        pytest.importorskip(module, reason=f"needs {module} (tools/setup --python)")
    done = subprocess.run([SOURCE / "make_page", tmp_path / "tutorial.html"], env={**os.environ, "PYTHON": sys.executable, "PATH": os.defpath},
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-4000:]
    page = (tmp_path / "tutorial.html").read_text()
    assert "Traceback" not in page and "Error" not in re.sub(r"<[^>]*>", "", page)[-2000:]
    pictures = re.findall(r'src="data:image/png;base64,([^"]*)"', page)
    assert len(pictures) >= 5
    assert all(base64.b64decode(p).startswith(b"\x89PNG") for p in pictures)
