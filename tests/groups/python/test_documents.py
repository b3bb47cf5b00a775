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


def test_the_table_of_contents_names_what_exists():
    text = (ROOT / "tools/python/README.md").read_text()
    called = set(re.findall(r"`(ff|s|c)\.(\w+)", text))
    kinds = {"ff": ff, "s": ff.Set, "c": ff.Cell}
    missing = [f"{owner}.{name}" for owner, name in called if not hasattr(kinds[owner], name)]
    assert len(called) > 20 and not missing, missing
