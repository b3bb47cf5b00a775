"""The examples in docstrings run, and every public function, method and property has one."""

import doctest
import inspect
import os

import numpy as np
import pytest

import filiform as ff

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def public():
    """(name, thing) of what users call."""
    for name in ff.__all__:
        thing = getattr(ff, name)
        if not inspect.isclass(thing):
            yield name, thing
            continue
        for member, value in vars(thing).items():
            value = getattr(value, "func", value)  # of a cached_property
            if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
                yield f"{name}.{member}", value


PUBLIC = dict(public())


def test_every_public_name_has_an_example():
    assert len(PUBLIC) > 70
    assert not [name for name, thing in PUBLIC.items() if ">>>" not in (inspect.getdoc(thing) or "")]


@pytest.mark.parametrize("name", PUBLIC)
def test_the_example_gives_what_it_says(name, example, tmp_path, monkeypatch):
    text = inspect.getdoc(PUBLIC[name])
    for module in ("pandas", "networkx"):
        if module in text:
            pytest.importorskip(module)
    if "render(" in text:
        pytest.importorskip("filiform._render", reason="needs OpenGL")
    for entry in example.iterdir():
        (tmp_path / entry.name).symlink_to(entry)
    monkeypatch.chdir(tmp_path)
    with ff.open("column.fil") as s:
        names = {"ff": ff, "np": np, "os": os, "s": s, "c": s.cells["L5_1"]}
        test = doctest.DocTestParser().get_doctest(text, names, name, None, 0)
        said = []
        failed = doctest.DocTestRunner(optionflags=FLAGS).run(test, out=said.append).failed
    assert failed == 0, "".join(said)
