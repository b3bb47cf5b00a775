"""Set.measure: the values of `filiform measure`."""

import json

import numpy as np
import pytest

import filiform as ff
from conftest import run


def test_values_are_those_of_the_command(s):
    told = json.loads(run("measure", s.path, "--json", "--features", "all", "--sholl", 20))
    for frame in (False, True):
        if frame:
            pytest.importorskip("pandas")
        columns = s.measure(features="all", sholl=20, frame=frame)
        assert list(columns) == list(told[0]) and len(columns["name"]) == len(told)
        for title in told[0]:
            for row, value in zip(told, columns[title]):
                if title.startswith("sholl"):
                    assert list(value)[: len(row[title])] == row[title] and not any(list(value)[len(row[title]) :])
                elif row[title] is None:
                    assert np.isnan(value)
                else:
                    assert row[title] == value


def test_parts_of_a_cell(s):
    cell = s.cells.at(0)
    branches = s.measure(cell, per="branch", features=["length", "segments"], frame=False)
    whole = s.measure([cell.name], features="length,segments", frame=False)
    assert branches["segments"].sum() == whole["segments"][0] and branches["segments"].dtype == np.int64
    assert branches["length_um"].sum() == pytest.approx(whole["length_um"][0])
    assert s.measure(per="set", frame=False, workers=2)["cells"].tolist() == [len(s.cells)]
    assert len(s.measure([], frame=False)["id"]) == 0


def test_density_adds_up_to_the_length(s):
    found = s.density(40)
    assert found.density.ndim == 3 and found.step == 40 and (found.origin % 40 == 0).all()
    lengths = s.measure(features="length", frame=False)["length_um"]
    assert found.density.sum() * 40**3 == pytest.approx(lengths.sum(), rel=1e-9)
    np.testing.assert_array_equal(s.density(40, workers=3).density, found.density)
    one = s.density(40, cells=s.cells.at(2))
    assert one.density.sum() * 40**3 == pytest.approx(lengths[2], rel=1e-9)
    assert (s.density(40, type="axon").density <= found.density).all()
    for wrong in (0, -1, float("nan"), 1e-5):
        with pytest.raises(ValueError):
            s.density(wrong)


def test_mistakes_name_what_is_near(s):
    with pytest.raises(ValueError, match="did you mean 'length'"):
        s.measure(features="lenght")
    with pytest.raises(ValueError, match="did you mean 'axon'"):
        s.measure(type=["axno"])
    with pytest.raises(ValueError, match="sholl"):
        s.measure(sholl=-1)
    with pytest.raises(KeyError):
        s.measure("nobody")
