"""The code in documents runs: Python, C++ and C. `tests/tools/documents_test.cpp` runs the commands in them."""

import json
import os
import pathlib
import re
import shlex
import subprocess

import pytest

import filiform as ff

ROOT = pathlib.Path(__file__).parents[3]
DOCUMENTS = sorted(path for room in ("", ".github", "index", "device", "solver", "viewer", "tools", "tests")
                   for path in (ROOT / room).glob("**/*.md" if room else "*.md"))
TEXTS = {str(path.relative_to(ROOT)): path.read_text() for path in DOCUMENTS}


def blocks(language):
    """(document and line, code) of each block."""
    return [(f"{name}:{text[:found.start()].count(chr(10)) + 1}", found[1]) for name, text in TEXTS.items()
            for found in re.finditer(rf"^```{language}\n(.*?)^```$", text, re.M | re.S)]


# They need accounts, and the document says that no test runs them.
ACCOUNTS = ("from neuprint import", "from caveclient import")


@pytest.mark.parametrize("place, code", [block for block in blocks("python") if not block[1].startswith(ACCOUNTS)])
def test_python_runs(place, code, column, tmp_path, monkeypatch):
    if "import dask" in code:
        pytest.importorskip("dask", reason="needs dask (tools/setup --python)")
    for name in "column.fil", "my.fil", "day.fil":
        (tmp_path / name).symlink_to(column)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(code, names)
    assert "hits" not in names or names["hits"]["exact"].all()
    assert "force" not in names or (0 < max(map(abs, names["force"])) <= 8 and len(code.splitlines()) <= 20)


@pytest.mark.parametrize("readme", ["README.md", "tools/python/README.md"])
def test_the_first_lines_are_few(readme):
    code = re.search(r"^```python\n(.*?)^```$", TEXTS[readme], re.M | re.S)[1]
    assert 3 <= len(code.splitlines()) <= 4


def test_two_blocks_need_accounts():
    unrun = [place for place, code in blocks("python") if code.startswith(ACCOUNTS)]
    assert len(unrun) == 2 and "No test runs these two: they need accounts." in TEXTS["tools/python/README.md"]


# What a fragment stands in.
FRAGMENT = """
#include "index/query/nearest.h"
#include "index/set/tile_set.h"
#include "solver/travel/session/stepped_travel.h"
#include <iostream>
using namespace filiform;
void example([[maybe_unused]] Vector3d hand_m, [[maybe_unused]] Vector3d force_N) {
%s
}
"""


def compiler():
    """The command that compiles the program, without its files."""
    listed = pathlib.Path(os.environ.get("FILIFORM_BUILD", "")) / "compile_commands.json"
    if not listed.exists():
        pytest.skip("needs the build of the program (FILIFORM_BUILD)")
    [command] = [entry["command"] for entry in json.loads(listed.read_text()) if entry["file"].endswith("1_tools_commands_.cpp")]
    return shlex.split(command.split(" -o ")[0])


@pytest.mark.parametrize("document", sorted({place.rsplit(":", 1)[0] for place, _ in blocks("cpp")}))
def test_cpp_compiles(document, tmp_path):
    command, header = compiler(), None
    for place, code in blocks("cpp"):
        if not place.startswith(document + ":"):
            continue
        if "#pragma once" in code:  # its name is in the source after it
            header = code
            continue
        if header is not None:
            path = tmp_path / re.search(r'#include "(.*)"', code)[1]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(header)
            header = None
        source = tmp_path / f"block_{place.rsplit(':', 1)[1]}.cpp"
        source.write_text(code if "#include" in code else FRAGMENT % code)
        done = subprocess.run([*command, "-I", str(tmp_path), "-fsyntax-only", str(source)], capture_output=True, text=True)
        assert done.returncode == 0, f"{place}: {done.stderr}"
    assert header is None


@pytest.mark.parametrize("place, code", blocks("c"))
def test_c_compiles(place, code, tmp_path):
    (tmp_path / "block.c").write_text(code)
    done = subprocess.run(["cc", "-std=c17", "-Wall", "-Wextra", "-Werror", "-I", ROOT / "tools/c", "-fsyntax-only", tmp_path / "block.c"],
                          capture_output=True, text=True)
    assert done.returncode == 0, f"{place}: {done.stderr}"


def test_the_table_of_contents_names_what_exists():
    text = (ROOT / "tools/python/README.md").read_text()
    called = set(re.findall(r"`(ff|s|c)\.(\w+)", text))
    kinds = {"ff": ff, "s": ff.Set, "c": ff.Cell}
    missing = [f"{owner}.{name}" for owner, name in called if not hasattr(kinds[owner], name)]
    assert len(called) > 20 and not missing, missing
