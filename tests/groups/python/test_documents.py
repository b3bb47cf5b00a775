"""The first Python example of each README runs, and gives what its remark says."""

import pathlib
import re

import pytest

import filiform as ff

ROOT = pathlib.Path(__file__).parents[3]


@pytest.mark.parametrize("readme", ["README.md", "tools/python/README.md"], ids=["of_the_repository", "of_the_package"])
def test_the_first_lines_run(readme, column, tmp_path, monkeypatch):
    for name in "column.fil", "my.fil":
        (tmp_path / name).symlink_to(column)
    monkeypatch.chdir(tmp_path)
    code = re.search(r"^```python\n(.*?)^```$", (ROOT / readme).read_text(), re.M | re.S)[1]
    assert 3 <= len(code.splitlines()) <= 4
    names = {}
    exec(code, names)
    assert names["hits"].shape == (1, 3) and names["hits"]["exact"].all()
    assert names["hits"].dtype.names == ("distance", "x", "y", "z", "cell", "segment", "sample", "exact", "type", "radius", "t")


RECIPES = re.findall(r"^\*\*([^*]+)\.\*\*(?:(?!^```).)*?^```python\n(.*?)^```$",
                     (ROOT / "tools/python/README.md").read_text().split("## Recipes")[1], re.M | re.S)


@pytest.mark.parametrize("name, code", [recipe for recipe in RECIPES if "SWC from" not in recipe[0]], ids=lambda text: text[:20])
def test_the_recipes_run(name, code, column, tmp_path, monkeypatch):
    if "dask" in name:
        pytest.importorskip("dask", reason="needs dask (tools/setup --python)")
    (tmp_path / "column.fil").symlink_to(column)
    monkeypatch.chdir(tmp_path)
    names = {}
    exec(code, names)
    if "device" in name:
        assert 0 < max(map(abs, names["force"])) <= 8 and len(code.splitlines()) <= 20
    else:
        assert names["hits"].shape == (1000,)


def test_all_recipes_are_found():
    assert [name for name, _ in RECIPES] == ["A device of your own", "asyncio", "dask and joblib", "SWC from neuPrint", "SWC from CAVE"]


def test_the_table_of_contents_names_what_exists():
    text = (ROOT / "tools/python/README.md").read_text()
    called = set(re.findall(r"`(ff|s|c)\.(\w+)", text))
    kinds = {"ff": ff, "s": ff.Set, "c": ff.Cell}
    missing = [f"{owner}.{name}" for owner, name in called if not hasattr(kinds[owner], name)]
    assert len(called) > 20 and not missing, missing
