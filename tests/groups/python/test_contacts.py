"""Set.contacts: the rows of `filiform contacts`."""

import numpy as np
import pytest

from conftest import run


def test_rows_are_those_of_the_command(s, tmp_path):
    told = tmp_path / "contacts.npz"
    run("contacts", s.path, "--within", 5, "--types", "axon,dendrite", "-o", told)
    expected = np.load(told)
    found = s.contacts(5, types=["axon", "dendrite"], frame=False)
    assert len(found["from"]) > 0
    for title in expected.files:
        if title != "cells":
            np.testing.assert_array_equal(found[title], expected[title])
    assert [s.cells.at(i).name for i in found["from"]] == list(found["from_name"])
    assert [s.cells.at(i).name for i in found["to"]] == list(found["to_name"])


def test_sides_choose_cells(s):
    all_of = s.contacts(5, frame=False)
    first = s.cells.at(int(all_of["from"][0]))
    some = s.contacts(5, from_=first, to=s.cells.find("*"), frame=False, workers=2)
    assert set(some["from_name"]) == {first.name}
    pairs = (all_of["from"] == first.index) | (all_of["to"] == first.index)
    assert len(some["to"]) == np.count_nonzero(pairs)
    assert len(s.contacts(5, from_=first.name, to=[first], frame=False)["from"]) == 0


def test_a_frame_has_a_row_a_site(s):
    pandas = pytest.importorskip("pandas")
    frame = s.contacts(5, surface=True)
    assert isinstance(frame, pandas.DataFrame) and len(frame) == len(s.contacts(5, surface=True, frame=False)["from"])


def test_mistakes_are_named(s):
    for within in (0, -1, float("nan"), float("inf"), 1e9):
        with pytest.raises(ValueError, match="distance|within"):
            s.contacts(within)
    with pytest.raises(ValueError, match="did you mean 'axon'"):
        s.contacts(2, types="axno")
    with pytest.raises(KeyError):
        s.contacts(2, from_="nobody")
