"""Attributes of cells: names, columns, Set.where."""

import numpy as np
import pytest

import filiform as ff
from conftest import run


@pytest.fixture(scope="module")
def circuit(tmp_path_factory):
    """A set of a synthetic circuit, whose cells have attributes."""
    import os
    import pathlib
    if not (pathlib.Path(os.environ.get("FILIFORM_PROGRAM", "filiform")).parent / "filiform-hdf5").exists():
        pytest.skip("needs filiform-hdf5, which reads circuits (libhdf5-dev)")
    folder = tmp_path_factory.mktemp("circuit")
    run("synth", "-o", folder / "circuit", "--cells", 12, "--seed", 3, "--format", "sonata")
    run("ingest", folder / "circuit" / "circuit_config.json", "-o", folder / "circuit.fil")
    with ff.open(folder / "circuit.fil") as opened:
        yield opened


def test_a_set_without_attributes_has_none(s):
    assert s.attributes == [] and len(s.where()) == len(s.cells)
    with pytest.raises(KeyError, match="mtype"):
        s.where(mtype="x")
    with pytest.raises(KeyError, match="none"):
        s.attribute("layer")


def test_columns_are_by_cell(circuit):
    assert circuit.attributes == sorted(circuit.attributes) and circuit.attributes
    for name in circuit.attributes:
        column = circuit.attribute(name)
        assert len(column) >= len(circuit.cells) and column.dtype in (np.float64, object)


def test_a_column_is_taken_by_rows_of_nearest(circuit):
    cells = np.array([[0, 2**32 - 1], [2, 1]], np.uint32)
    for name in circuit.attributes:
        column, taken = circuit.attribute(name), circuit.attribute(name, cells)
        assert taken.shape == cells.shape and taken.dtype == column.dtype
        assert taken[1, 0] == column[2] or (taken[1, 0] != taken[1, 0] and column[2] != column[2])
        assert taken[0, 1] is None or np.isnan(taken[0, 1])


def test_where_chooses_cells(circuit):
    for name in circuit.attributes:
        column = circuit.attribute(name)
        value = next(v for v in column if v is not None and v == v)
        chosen = circuit.where(**{name: value})
        assert [c.index for c in chosen] == np.flatnonzero(column == value).tolist()
        assert circuit.where(**{name: [value]}) == chosen
        assert circuit.where(**{name: lambda c: np.zeros(len(c), bool)}) == []
        with pytest.raises(ValueError, match=name):
            circuit.where(**{name: lambda c: 3})
