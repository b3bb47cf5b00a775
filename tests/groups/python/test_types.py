"""Types and docstrings: mypy over the package, stubs against the compiled modules."""

import inspect
import json
import os
import pathlib
import subprocess
import sys

import pytest

import filiform as ff

PACKAGE = pathlib.Path(ff.__file__).parent


def mypy(*arguments):
    pytest.importorskip("mypy", reason="needs mypy (tools/setup --python)")
    environment = {**os.environ, "MYPYPATH": str(PACKAGE.parent)}
    return subprocess.run([sys.executable, "-m", *arguments], capture_output=True, text=True, env=environment,
                          cwd=PACKAGE.parent)


def test_mypy_finds_nothing(tmp_path):
    done = mypy("mypy", "--strict", "--ignore-missing-imports", "--cache-dir", str(tmp_path), "-p", "filiform")
    assert done.returncode == 0, done.stdout + done.stderr


def test_stubs_are_those_of_the_modules(tmp_path):
    # pybind11 does not tell its signatures: names and kinds are compared.
    allow = tmp_path / "allow"
    allow.write_text("filiform\\._core\\..*\\.__.*__\nfiliform\\._core\\.(SetHandle|CellData|OpenSet|RecordReader|SegmentReader|TravelData)(\\..*)?\n")
    done = mypy("mypy.stubtest", "--ignore-missing-stub", "--ignore-unused-allowlist", "--ignore-positional-only",
                "--allowlist", str(allow), "filiform._core")
    assert done.returncode == 0, done.stdout + done.stderr


def test_a_wrong_use_is_seen_by_mypy(tmp_path):
    (tmp_path / "use.py").write_text(
        "import filiform as ff\ns = ff.open('a.fil')\nx: int = s.units\ns.nearest([1., 2., 3.], k=2)\ns.nearst([1.])\n")
    done = mypy("mypy", "--cache-dir", str(tmp_path / "cache"), str(tmp_path / "use.py"))
    assert ":3: error" in done.stdout and ":5: error" in done.stdout and ":4: error" not in done.stdout


def test_the_tutorial_passes_strict(tmp_path):
    notebook = json.loads((pathlib.Path(__file__).parents[3] / "tools/python/tutorial.ipynb").read_text())
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    use = "\n".join(
        ["s = ff.open('a.fil')", "n: int = s.box_counts([0, 0, 0], [1, 1, 1], once=True)",
         "by_cell: dict[int, int] = s.sphere_counts([0, 0, 0], 1, group_by='cell')",
         "d: ff.Density = s.density(50)", "g: ff.GroupedDensity = s.density(50, group_by='type')",
         "lengths: float = s.segments('length').sum()", "parts: list[int] = [len(rows) for rows in s.segments(chunks=9)]"])
    (tmp_path / "tutorial.py").write_text("\n".join(["from typing import Any", *cells, use]) + "\n")
    done = mypy("mypy", "--strict", "--ignore-missing-imports", "--cache-dir", str(tmp_path / "cache"), str(tmp_path / "tutorial.py"))
    assert done.returncode == 0, done.stdout + done.stderr


def test_everything_public_is_documented():
    missing = []
    for name in ff.__all__:
        thing = getattr(ff, name)
        if not inspect.getdoc(thing):
            missing.append(name)
        if inspect.isclass(thing) and not issubclass(thing, (BaseException, tuple)):
            for member, value in vars(thing).items():
                if not member.startswith("_") and not inspect.getdoc(value):
                    missing.append(f"{name}.{member}")
    assert not missing


def test_stub_lists_what_the_module_has():
    stub = (PACKAGE / "_core.pyi").read_text()
    for name in dir(ff._core):
        assert name.startswith("__") or name in stub, name


def test_without_numpy_one_line_says_so():
    code = "import sys; sys.modules['numpy'] = None; import filiform"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 1 and done.stderr.splitlines()[-1].startswith("ImportError: filiform needs NumPy")
