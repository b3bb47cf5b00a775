"""Set.segments, densities by group, counts of each segment once."""

import os
import threading

import numpy as np
import pytest

import filiform as ff
from filiform import _core


def key(rows):
    return np.sort(rows, order=["cell", "segment"])


def test_all_segments_are_those_of_the_cells(s):
    rows = key(s.segments())
    cells = s.cells.find("*").load()
    start = 0
    for cell in cells:
        of_cell = rows[rows["cell"] == cell.index]
        real = of_cell[(cell.ends[of_cell["segment"], 0] != cell.ends[of_cell["segment"], 1])]
        assert len(real) == cell.segments
        child, parent = cell.ends[of_cell["segment"]].T
        assert (np.stack([of_cell["x0"], of_cell["y0"], of_cell["z0"]], 1) == cell.vertices[child]).all()
        assert (np.stack([of_cell["x1"], of_cell["y1"], of_cell["z1"]], 1) == cell.vertices[parent]).all()
        assert (of_cell["type"] == cell.types[child]).all() and (of_cell["sample"] == cell.node_ids[child]).all()
        assert np.array_equal(of_cell["radius"], cell.radius[child], equal_nan=True)
        start += len(of_cell)
    assert start == len(rows)


def test_a_set_with_loops_and_isolated_samples(small):
    with ff.open(small) as opened:
        rows = opened.segments()
        assert len(rows) == 4 + 5 + 1
        single = rows[rows["cell"] == opened.cells.index("é one")]
        assert single["sample"].tolist() == [7] and single["x0"] == single["x1"] == 100
        loop = opened.segments("length", cells="loop")
        assert loop.sum() == pytest.approx(opened.cells["loop"].length)


@pytest.mark.parametrize("chunks", [1, 7, 1000, 10**9, 10**30])
def test_chunks_hold_the_same_rows(s, chunks):
    some = s.cells.find("*")[:2]
    whole = s.segments(cells=some)
    parts = list(s.segments(cells=some, chunks=chunks))
    assert all(len(part) == chunks for part in parts[:-1]) and 0 < len(parts[-1]) <= chunks
    assert (np.concatenate(parts) == whole).all()
    assert (s.segments(cells=some, workers=3) == whole).all()


def test_a_whole_set_is_one_array(s, monkeypatch):
    asked = []

    class Watched(_core.SegmentReader):
        def next(self, rows):
            asked.append(rows)
            return super().next(rows)

    monkeypatch.setattr(_core, "SegmentReader", Watched)
    assert len(s.segments("cell")) == s.info()["segments"] and len(asked) == 1


def test_boxes_and_types_choose(s):
    lo, hi = s.bounds
    box = [lo + 0.3 * (hi - lo), lo + 0.6 * (hi - lo)]
    found = key(s.segments(["cell", "segment"], box=box))
    asked = key(s.box_query(*box, fields=["cell", "segment"]))
    assert len(found) > 10 and (found == asked).all()
    everything = s.segments()
    axons = s.segments(type="axon")
    assert 0 < len(axons) < len(everything) and (axons == everything[everything["type"] == 2]).all()
    assert len(s.segments(box=[[1e9] * 3] * 2)) == 0
    assert s.segments("length", box=[[1e9] * 3] * 2).shape == (0,)


def test_one_name_gives_values(s):
    lengths = s.segments("length")
    assert lengths.dtype == np.float64 and lengths.sum() == pytest.approx(sum(c.length for c in s.cells.find("*")))
    assert s.segments("cell,type").dtype.names == ("cell", "type")
    assert all(part.dtype == np.uint32 for part in s.segments("cell", chunks=100))


def test_mistakes_are_named(s):
    for arguments, text in (
        (dict(fields="radii"), "fields: unknown field 'radii'; choose from cell segment sample"),
        (dict(fields=["cell", "cell"]), "give each field once"),
        (dict(chunks=0), "chunks: must be 1 row or more"),
        (dict(box=[1, 2, 3]), "box: expected two corners"),
        (dict(box=[[1, 2], [3, 4]]), "box: expected shape"),
        (dict(type="axxon"), "did you mean .axon"),
        (dict(workers=0), "workers"),
    ):
        with pytest.raises(ValueError, match=text.replace("(", "\\(")):
            s.segments(**arguments)
    with pytest.raises(KeyError, match="no cell 'nobody'"):
        s.segments(cells="nobody")
    with pytest.raises(TypeError):
        s.segments(chunks="many")
    with pytest.raises(TypeError, match="step: expected a number, got str"):
        s.density("coarse")


def test_a_closed_set_ends_no_pass_that_began(column):
    opened = ff.open(column)
    rows = opened.segments(chunks=10)
    first = next(rows)
    opened.close()
    assert len(first) == 10 and len(next(rows)) == 10
    with pytest.raises(ValueError, match="closed"):
        opened.segments()


def test_a_forked_process_begins_anew(s):
    rows = s.segments(chunks=10, workers=2)
    next(rows)
    child = os.fork()
    if child == 0:
        try:
            next(rows)
        except ValueError as error:
            os._exit(0 if "begun before fork" in str(error) and len(s.segments()) > 10 else 1)
        os._exit(2)
    assert os.waitpid(child, 0)[1] == 0


def test_threads_read_at_once(s):
    expected, found = s.segments(), []
    threads = [threading.Thread(target=lambda: found.append(s.segments())) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4 and all((rows == expected).all() for rows in found)


def test_groups_of_densities_add_up(s):
    whole = s.density(40)
    by_both = s.density(40, group_by="cell,type")
    boxes = np.zeros(by_both.shape)
    rows = by_both.rows
    np.add.at(boxes, (rows["x"], rows["y"], rows["z"]), rows["length"])
    assert np.allclose(boxes / 40**3, whole.density) and (by_both.origin == whole.origin).all()
    axon = s.density(40, type="axon").density.sum() * 40**3
    assert rows["length"][rows["type"] == 2].sum() == pytest.approx(axon)
    assert set(s.density(40, group_by="type").rows["cell"]) == {0}
    with pytest.raises(ValueError, match="group_by: expected 'cell', 'type' or 'cell,type', got 'layer'"):
        s.density(40, group_by="layer")


def test_boxes_side_by_side_count_each_segment_once(s):
    lo, hi = s.bounds
    steps = [np.linspace(a - 1, b + 1, 4) for a, b in zip(lo, hi)]
    counts, touched = {}, 0
    for x in range(3):
        for y in range(3):
            for z in range(3):
                corners = [steps[0][x], steps[1][y], steps[2][z]], [steps[0][x + 1], steps[1][y + 1], steps[2][z + 1]]
                touched += s.box_counts(*corners)
                for cell, count in s.box_counts(*corners, group_by="cell", once=True).items():
                    counts[cell] = counts.get(cell, 0) + count
    assert counts == {cell.index: cell.segments for cell in s.cells.find("*")}
    assert touched > sum(counts.values())


def test_reprs_are_short(s):
    cell = s.cells.find("*")[0]
    for thing in (cell, cell.path("soma"), s.density(40), s.density(40, group_by="type"), s.levels(s.bounds, 100), s.cells,
                  s.cells.find("*")):
        assert repr(thing).startswith("<") and len(repr(thing)) < 250 and "\n" not in repr(thing)
