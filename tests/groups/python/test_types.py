"""Types and docstrings: mypy over the package, stubs against the compiled modules."""

import inspect
import json
import os
import pathlib
import re
import subprocess
import sys
import typing

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


# What a checker of types knows of each answer.
ANSWERS = """
import filiform as ff
import numpy as np
import numpy.typing as npt
from typing import Any, Iterator, assert_type

Rows = npt.NDArray[np.void]
Floats = npt.NDArray[np.float64]
Ids = npt.NDArray[np.int64]
Array = npt.NDArray[Any]
s = ff.open("a.fil")
c = s.cells["a"]
many = np.zeros((9, 3))
n = 2
assert_type(s.nearest([1, 2.5, 3]), np.void)
assert_type(s.nearest((1.0, 2.0, 3.0), type="axon"), np.void)
assert_type(s.nearest([1, 2, 3], k=2), Rows)
assert_type(s.nearest([1, 2, 3], k=[1, 2]), Rows)
assert_type(s.nearest([[1, 2, 3]]), Rows)
assert_type(s.nearest(many), Rows)
assert_type(s.nearest(many, n, own=False), Rows)
assert_type(s.snap([1, 2, 3]), tuple[Floats, np.float64])
assert_type(s.snap(many), tuple[Floats, Floats])
assert_type(s.ray([0, 0, 0], [1, 0, 0]), Rows)
assert_type(s.bounds, Floats)
assert_type(s.measure(frame=False), dict[str, Array])
assert_type(s.contacts(2, frame=False), dict[str, Array])
assert_type(s.box_counts([0, 0, 0], [1, 1, 1]), int)
assert_type(s.sphere_counts([0, 0, 0], 1, group_by="cell"), dict[int, int])
assert_type(s.density(50).density, Floats)
assert_type(s.density(50, group_by="type").rows, Rows)
assert_type(s.segments(), Array)
assert_type(s.segments(chunks=9), Iterator[Array])
assert_type(s.levels(s.bounds, 100).segments, Rows)
assert_type(s.navigate("a").force, Floats)
assert_type(s.where(layer=5).vertices, list[Floats])
assert_type(s.render(), npt.NDArray[np.uint8])
assert_type(c.nodes, Rows)
assert_type(c.vertices, Floats)
assert_type(c.edges, npt.NDArray[np.uint32])
assert_type(c.radius, npt.NDArray[np.float32])
assert_type(c.types, npt.NDArray[np.uint16])
assert_type(c.snap([1, 2, 3]), tuple[np.int64, np.float64])
assert_type(c.snap(many), tuple[Ids, Floats])
assert_type(c.distances("soma"), Floats)
assert_type(c.tips("soma"), Ids)
assert_type(c.path("soma").points, Floats)
assert_type(ff.Travel(s).tick([0, 0, 0]).force, Floats)
"""


def test_mypy_knows_what_each_call_gives(tmp_path):
    (tmp_path / "answers.py").write_text(ANSWERS)
    done = mypy("mypy", "--strict", "--ignore-missing-imports", "--python-version", "3.11", "--cache-dir", str(tmp_path / "cache"),
                str(tmp_path / "answers.py"))
    assert done.returncode == 0, done.stdout + done.stderr


# JSON, and tables that are a DataFrame only where pandas is installed.
ANY = {"Set.info": ["dict[str, Any]"], "Set.measure": ["Any", "Any"], "Set.contacts": ["Any", "Any"]}


def test_no_public_call_returns_any():
    found = {}
    for name in ff.__all__:
        thing = getattr(ff, name)
        members = [(f"{name}.{m}", v) for m, v in vars(thing).items() if not m.startswith("_")] if inspect.isclass(thing) else [(name, thing)]
        for where, value in members:
            call = getattr(value, "fget", None) or getattr(value, "func", value)
            for one in [*(typing.get_overloads(call) if inspect.isfunction(call) else []), call]:
                given = getattr(one, "__annotations__", {}).get("return", "Any" if inspect.isfunction(one) else "")
                if re.search(r"\bAny\b", given):
                    found.setdefault(where, []).append(given)
    assert found == ANY


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
