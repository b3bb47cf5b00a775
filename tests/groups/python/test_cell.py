"""Cells: names, arrays, paths, other libraries."""

import sys
import types

import numpy as np
import pytest

import filiform as ff
from conftest import run


def test_names_find_cells(s):
    names = s.cells.names
    assert len(s.cells) == len(names) == 12 and list(s.cells) == names
    cell = s.cells[names[3]]
    assert cell.name == names[3] and s.cells.at(cell.index) == cell and names[3] in s.cells and "nobody" not in s.cells
    assert [c.name for c in s.cells.find(names[3][:-1] + "?")] == [n for n in names if n[:-1] == names[3][:-1]]
    assert s.cells.find("") == [] and len(s.cells.find("*")) == 12
    with pytest.raises(KeyError, match="did you mean"):
        s.cells[names[3].upper()]
    for wrong in (99, -1, np.uint32(2**32 - 1)):
        with pytest.raises(KeyError):
            s.cells.at(wrong)
    with pytest.raises(TypeError):
        s.cells[1.5]


def test_lists_read_their_cells_in_one_pass(s, small):
    everything = s.cells.find("*")
    assert not any(cell.is_loaded for cell in everything)
    twice = ff.CellList([*everything[::-1], everything[0]])
    for cell, vertices, nodes in zip(twice, twice.vertices, twice.nodes):
        alone = s.cells[cell.name]
        assert cell.is_loaded and np.array_equal(vertices, alone.vertices)
        for field in nodes.dtype.names:
            assert np.array_equal(nodes[field], alone.nodes[field], equal_nan=field == "radius")
    with ff.open(small) as other:
        both = ff.CellList([s.cells.at(0), *other.cells.find("*")]).load()
        assert [c.vertices.shape for c in both] == [(c.samples, 3) for c in both]
    assert ff.CellList().load() == []


def test_an_integer_is_never_another_cell(tmp_path):
    """Ids of bodies are integers in neuPrint and CAVE; names are text, and only a result's uint32 is an index."""
    for name in range(12):
        (tmp_path / f"{name}.swc").write_text("1 1 0 0 0 1 -1\n2 3 9 0 0 1 1\n")
    ff.ingest(list(tmp_path.glob("*.swc")), tmp_path / "bodies.fil")
    with ff.open(tmp_path / "bodies.fil") as opened:
        for body in (2, np.int64(2), np.uint64(2), 2**60):
            assert body not in opened.cells
            with pytest.raises(TypeError, match=f"use '{body}', or cells.at"):
                opened.cells[body]
            with pytest.raises(TypeError, match="names are text"):
                opened.navigate(cell=body)
        assert opened.cells["2"].name == "2" and opened.cells.at(2).name == opened.cells[np.uint32(2)].name == "10"


def test_nodes_are_those_of_the_file(small):
    with ff.open(small) as opened:
        nodes = opened.cells["fork"].nodes
        assert nodes.dtype.names == ("node_id", "label", "x", "y", "z", "radius", "parent_id")
        assert nodes["node_id"].tolist() == [1, 2, 3, 4, 5] and nodes["parent_id"].tolist() == [-1, 1, 2, 2, 1]
        assert nodes["label"].tolist() == [1, 3, 3, 3, 2] and nodes["x"].tolist() == [0, 10, 20, 20, 0]
        assert nodes["radius"][:4].tolist() == [5, 1, 0.5, 0.5] and np.isnan(nodes["radius"][4])


def test_arrays_are_read_only_and_kept(s):
    cell = s.cells.at(0)
    for name in ("nodes", "node_ids", "vertices", "ends", "edges", "radius", "types"):
        array = getattr(cell, name)
        assert array is getattr(cell, name) and not array.flags.writeable
        with pytest.raises(ValueError):
            array[0] = 0
    radius = cell.radius
    del cell
    assert np.isfinite(radius.sum())  # the array keeps what it shares


def test_vertices_and_edges_are_a_skeleton(s):
    cell = s.cells.at(0)
    assert cell.vertices.shape == (cell.samples, 3) and cell.edges.shape == (cell.segments, 2)
    assert cell.edges.dtype == np.uint32 and cell.radius.dtype == np.float32
    np.testing.assert_array_equal(cell.node_ids[cell.edges[:, 1]],
                                  cell.nodes["parent_id"][cell.nodes["parent_id"] >= 0])
    assert (cell.vertices >= cell.bounds[0]).all() and (cell.vertices <= cell.bounds[1]).all()


def test_segment_is_the_row_of_ends_in_every_cell(small, s, random, tmp_path):
    import conftest
    (tmp_path / "loop.edges").write_text(conftest.LOOP + "node 9 50 50 0 1 2\n")  # and an isolated sample
    (tmp_path / "two.swc").write_text("3 3 100 0 0 1 -1\n1 1 100 9 0 1 -1\n2 2 109 9 0 1 1\n")
    ff.ingest([tmp_path / "loop.edges", tmp_path / "two.swc"], tmp_path / "a.fil")
    with ff.open(small) as first, ff.open(tmp_path / "a.fil") as second:
        for opened in (first, second, s):
            points = random.uniform(*(opened.bounds + [[-9] * 3, [9] * 3]), (300, 3))
            hits = opened.nearest(points)
            assert len(opened.cells.where(hits["cell"])) > 1
            for cell in opened.cells.where(hits["cell"]):
                here = hits[hits["cell"] == cell.index]
                child, parent = cell.ends[here["segment"]].T
                np.testing.assert_array_equal(cell.node_ids[child], here["sample"])
                a, b = cell.vertices[child], cell.vertices[parent]
                at = np.stack([here["x"], here["y"], here["z"]], axis=1)
                there = np.linalg.norm(at - a, axis=1) + np.linalg.norm(at - b, axis=1)
                np.testing.assert_allclose(there, np.linalg.norm(a - b, axis=1), atol=0.01)
                assert (cell.edges == cell.ends[cell.ends[:, 0] != cell.ends[:, 1]]).all() and len(cell.edges) == cell.segments


def test_loops_and_isolated_samples(small, tmp_path):
    with ff.open(small) as opened:
        loop = opened.cells["loop"]
        assert loop.loops == 1 and len(loop.edges) == 5 and loop.length == pytest.approx(45)
        assert loop.path(1, 3).length == pytest.approx(20)
        with pytest.raises(ValueError, match="loop"):
            loop.to_swc()
        one = opened.cells["é one"]
        assert one.edges.shape == (0, 2) and one.length == 0 and one.path(7, 7).length == 0
        with pytest.raises(ValueError, match="tip"):
            one.path(7)


def test_path_is_that_of_the_program(column, s):
    cell = s.cells.at(0)
    first, last = int(cell.node_ids[0]), int(cell.tips(int(cell.node_ids[0]))[-1])
    path = cell.path(first)
    assert path.samples[0] == first and path.samples[-1] == last
    import json
    told = json.loads(run("path", column, f"{cell.name}:{first}", "--to-farthest-tip", "--json"))
    assert path.length == pytest.approx(told["length_um"]) and path.straight == pytest.approx(told["straight_um"])
    steps = np.linalg.norm(np.diff(path.points, axis=0), axis=1)
    np.testing.assert_allclose(np.cumsum(steps), path.along[1:])
    assert cell.distances(first)[cell.node_ids == last][0] == pytest.approx(path.length)


def test_path_between_rows_of_nearest(s):
    cell = s.cells.at(0)
    middle = cell.vertices[cell.edges[len(cell.edges) // 2]].mean(axis=0)
    hit = s.nearest(middle)
    assert s.cells[hit["cell"]] == cell
    path = cell.path(int(cell.node_ids[0]), hit)
    np.testing.assert_allclose(path.points[-1], [hit["x"], hit["y"], hit["z"]], atol=1e-9)
    assert path.samples[-1] == -1
    assert cell.path(hit, int(cell.node_ids[0])).length == pytest.approx(path.length)
    other = s.cells.at((cell.index + 1) % 12)
    for wrong, error in ((hit, ValueError), (10**15, KeyError), ("x", ValueError), (None, TypeError),
                         (s.nearest([middle, middle]), ValueError)):
        with pytest.raises(error, match="start"):
            other.path(wrong, int(other.node_ids[0]))


def test_a_soma_and_a_point_are_places(small):
    with ff.open(small) as opened:
        fork = opened.cells["fork"]
        tip = fork.path("soma").samples[-1]
        assert fork.path("soma", int(tip)).length == fork.path(1, int(tip)).length
        assert fork.path("Soma").length == fork.path(1).length
        where = fork.vertices[fork.node_ids.tolist().index(3)] + [0.25, 0, 0]
        for point in (where, where.tolist(), tuple(where), "%g,%g,%g" % tuple(where)):
            assert fork.path("soma", point).samples[-1] == 3
        assert fork.path("3", 3).length == 0
        for wrong in ("somewhere", "", [1, 2], "1,2"):
            with pytest.raises(ValueError, match="start"):
                fork.path(wrong)
        with pytest.raises(KeyError):
            fork.path("99")
        with pytest.raises(TypeError, match="'soma'"):
            fork.path(1.5)
        with pytest.raises(ValueError) as long:
            fork.path("x" * 60_000)
        assert len(str(long.value)) < 400


def test_rows_without_a_segment_give_no_cell(s):
    far = s.nearest([[0, 0, 0], [1e6, 1e6, 1e6]], distance_upper_bound=1e5)
    assert far["cell"][1] == 2**32 - 1
    assert [c.index for c in s.cells.where(far["cell"])] == [far["cell"][0]]


def test_letter_case_of_a_pattern_does_not_count(s):
    assert s.cells.find(s.cells.names[3].upper()) == s.cells.find(s.cells.names[3].lower()) != []


def test_snap_finds_the_nearest_sample(s, random):
    cell = s.cells.at(2)
    locs = random.uniform(*cell.bounds, (40, 3))
    ids, distances = cell.snap(locs)
    wanted = np.linalg.norm(cell.vertices[None] - locs[:, None], axis=2)
    np.testing.assert_array_equal(ids, cell.node_ids[wanted.argmin(axis=1)])
    np.testing.assert_allclose(distances, wanted.min(axis=1))
    one, distance = cell.snap(locs[0])
    assert one == ids[0] and distance == distances[0]


def test_networkx_has_the_lengths(s):
    networkx = pytest.importorskip("networkx", reason="needs python3-networkx")
    cell = s.cells.at(1)
    graph = cell.to_networkx()
    assert isinstance(graph, networkx.DiGraph) and len(graph) == cell.samples
    assert graph.number_of_edges() == cell.segments
    assert graph.size(weight="weight") == pytest.approx(cell.length)
    root = int(cell.nodes["node_id"][cell.nodes["parent_id"] < 0][0])
    assert graph.out_degree(root) == 0 and set(graph.nodes[root]) == {"x", "y", "z", "radius", "label"}
    tip = int(cell.tips(root)[-1])
    assert networkx.shortest_path_length(graph, tip, root, weight="weight") == pytest.approx(cell.path(root).length)


def test_dataframe_has_the_columns_of_navis(s):
    pandas = pytest.importorskip("pandas", reason="needs python3-pandas")
    frame = s.cells.at(0).to_dataframe()
    assert list(frame.columns) == ["node_id", "label", "x", "y", "z", "radius", "parent_id"]
    assert [str(t) for t in frame.dtypes] == ["int64", "category", "float64", "float64", "float64", "float64", "int64"]
    table = s.cells.to_dataframe()
    assert list(table.columns)[:2] == ["index", "name"] and len(table) == 12


@pytest.mark.parametrize("kind", ["TreeNeuron", "Skeleton"])
def test_navis_gets_a_neuron_list(s, monkeypatch, kind):
    """navis is not in Debian: a stand-in with its two constructors."""
    pytest.importorskip("pandas", reason="needs python3-pandas")
    made = {}

    class Neuron:
        def __init__(self, x, **known):
            self.x, self.known = x, known

    navis = types.ModuleType("navis")
    setattr(navis, kind, Neuron)
    navis.NeuronList = lambda neurons: made.setdefault("list", list(neurons))
    monkeypatch.setitem(sys.modules, "navis", navis)
    neurons = s.cells.find("*").to_navis()
    assert len(neurons) == 12 and neurons[0].known["units"] == "1 micrometer"
    assert list(neurons[0].x.columns) == ["node_id", "label", "x", "y", "z", "radius", "parent_id"]


def test_swc_reads_back(s, column, tmp_path):
    cell = s.cells.at(4)
    assert cell.to_swc(tmp_path / "cell.swc") is None
    assert (tmp_path / "cell.swc").read_text() == cell.to_swc()
    ff.ingest(tmp_path / "cell.swc", tmp_path / "cell.fil")
    with ff.open(tmp_path / "cell.fil") as again:
        np.testing.assert_array_equal(again.cells.at(0).nodes, cell.nodes)
    with pytest.raises(OSError):
        cell.to_swc(tmp_path / "nowhere" / "cell.swc")


def test_indices_of_hits_give_cells(s, random):
    hits = s.nearest(random.uniform(*s.bounds, (100, 3)))
    assert [c.index for c in s.cells.where(hits["cell"])] == sorted(set(hits["cell"].tolist()))
