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


def test_ids_keep_all_digits(tmp_path):
    """Two ids of FlyWire that one float64 stands for, and names that look like numbers."""
    ids = [720575940621039145, 720575940621039146]
    for name in ("a", "b", "c"):
        (tmp_path / f"{name}.swc").write_text("1 1 0 0 0 1 -1\n2 3 9 0 0 1 1\n")
    (tmp_path / "t.csv").write_text(f"name,root,code,depth\na,{ids[0]},7e5,1.50\nb,{ids[1]},7f3,2\nc,,700000,3\n")
    run("ingest", *(tmp_path / f"{n}.swc" for n in "abc"), "-o", tmp_path / "a.fil", "--attributes", tmp_path / "t.csv", "--key", "name")
    with ff.open(tmp_path / "a.fil") as opened:
        assert opened.attribute("root").tolist() == [*ids, None]
        assert opened.attribute("code").tolist() == ["7e5", "7f3", "700000"]
        assert opened.attribute("depth").tolist() == [1.5, 2, 3]
        for i in (0, 1):
            assert [c.name for c in opened.where(root=ids[i])] == ["ab"[i]]
            told = run("cells", tmp_path / "a.fil", "--where", f"root={ids[i]}", "--tsv")
            assert [line.split("\t")[1] for line in told.splitlines()[1:]] == ["ab"[i]]
        assert len(run("cells", tmp_path / "a.fil", "--where", f"root>{ids[0]}", "--tsv").splitlines()) == 2


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
