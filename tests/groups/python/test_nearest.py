"""Set.nearest and what is like it: shapes, types, brute force, scipy's meanings, wrong arguments."""

import numpy as np
import pytest

import filiform as ff
from conftest import points_about

FIELDS = ("distance", "x", "y", "z", "cell", "segment", "sample", "exact", "type", "radius", "t")


def test_shapes_are_those_of_scipy(s, random):
    spatial = pytest.importorskip("scipy.spatial", reason="needs python3-scipy")
    tree = spatial.cKDTree(s.cells.find("*")[0].vertices)
    for points in (np.zeros(3), np.zeros((1, 3)), np.zeros((4, 3)), np.zeros((2, 5, 3)), np.zeros((0, 3))):
        for k in (1, 2, [1], [2, 1], 7):
            assert s.nearest(points, k)["distance"].shape == np.shape(tree.query(points, k)[0]), (points.shape, k)


def test_dtype_has_the_fields_in_order(s):
    hits = s.nearest(np.zeros((3, 3)))
    assert hits.dtype.names == FIELDS
    assert [hits.dtype[name].str for name in FIELDS] == ["<f8"] * 4 + ["<u4", "<u4", "<i8", "|b1", "<i4", "<f8", "<f8"]
    assert hits.flags.owndata and hits.flags.writeable and hits.flags.aligned


def test_one_point_is_one_row(s):
    hit = s.nearest([0.0, 0.0, 0.0])
    assert isinstance(hit, np.void) and isinstance(hit["distance"], float)
    assert bool(hit["exact"]) is True


def test_distances_are_those_of_brute_force(s, brute, random):
    points = points_about(s, random, 60)
    hits = s.nearest(points, k=5)
    for point, row in zip(points, hits):
        wanted = np.sort(brute.distances(point))[:5]
        np.testing.assert_allclose(row["distance"], wanted, rtol=1e-12)
        np.testing.assert_allclose(
            np.linalg.norm(np.stack([row["x"], row["y"], row["z"]], axis=1) - point, axis=1), wanted, rtol=1e-9)


def test_sample_is_the_end_of_the_segment_in_the_file(s, random):
    for hit in s.nearest(points_about(s, random, 30)):
        cell = s.cells[hit["cell"]]
        child = cell.nodes[hit["segment"]]  # in a forest, a segment has the rank of its child
        assert child["node_id"] == hit["sample"]
        parent = cell.nodes[cell.nodes["node_id"] == child["parent_id"]][0]
        ends = np.array([[child[a] for a in "xyz"], [parent[a] for a in "xyz"]])
        place = np.array([hit["x"], hit["y"], hit["z"]])
        assert np.isclose(np.linalg.norm(place - ends, axis=1).sum(), np.linalg.norm(ends[0] - ends[1]))


def test_type_radius_and_place_are_those_of_the_samples(s, random):
    def expect(hit):
        nodes = s.cells[hit["cell"]].nodes
        child = nodes[hit["segment"]]
        parent = nodes[nodes["node_id"] == child["parent_id"]][0]
        for field in ("x", "y", "z", "radius"):
            assert hit[field] == pytest.approx(child[field] + hit["t"] * (float(parent[field]) - child[field]), abs=1e-5)
        assert hit["type"] == child["label"]

    for hit in s.nearest(points_about(s, random, 20), k=2).ravel():
        expect(hit)
    expect(s.nearest([1.0, 2.0, 3.0]))
    center = s.bounds.mean(axis=0)
    for hit in [*s.sphere_query(center, 60)[:10], *s.ray(center, [1, 1, 0], radius=40, k=10)]:
        expect(hit)
    hit = s.nearest([1.0, 2.0, 3.0], approximate=True)
    assert hit["type"] == -1 and np.isnan(hit["radius"]) and 0 <= hit["t"] <= 1


def test_filters_choose_segments(s, random):
    points = points_about(s, random, 20)
    everything = s.nearest(points, k=4000)
    for options, wanted in (
        ({"cell": s.cells.at(3)}, lambda h: h["cell"] == 3),
        ({"cell": [s.cells.at(1), s.cells.at(5).name], "not_cell": s.cells.at(1)}, lambda h: h["cell"] == 5),
        ({"type": "axon"}, lambda h: h["type"] == 2),
        ({"type": ["basal", 4], "not_cell": [s.cells.at(i) for i in range(3)]}, lambda h: np.isin(h["type"], (3, 4)) & (h["cell"] > 2)),
    ):
        for row, hits in zip(everything, s.nearest(points, k=3, **options)):
            row = row[np.isfinite(row["distance"]) & wanted(row)][:3]
            np.testing.assert_array_equal(hits[: len(row)], row)
    point = points[0]
    np.testing.assert_array_equal(s.nearest(point, 2, cell=[])["cell"], [2**32 - 1] * 2)
    own = s.nearest(point)["cell"]
    others = s.nearest(point, k=4, own=False, of_cells=True)["cell"]
    assert own not in others and len(set(others)) == 4
    low, high = s.bounds
    box = s.box_query(low, high, cell=s.cells.at(3), type="axon")
    assert len(box) and (box["cell"] == 3).all() and (box["type"] == 2).all()
    assert s.box_counts(low, high, cell=s.cells.at(3), type="axon") == len(box)
    assert list(s.sphere_counts(point, 1e4, not_cell=s.cells.at(0), group_by="cell")) == list(range(1, 12))
    assert set(s.sphere_query(point, 100, type="axon")["type"]) <= {2}
    assert (s.ray(low, high - low, radius=100, type="axon", of_cells=True)["type"] == 2).all()
    lengths = s.measure(features="length", frame=False)["length_um"]
    long_ones = s.nearest(point, k=50, where=[f"measure:length>{np.median(lengths)}", "measure:tips>0"])
    assert (lengths[long_ones["cell"]] > np.median(lengths)).all()
    for wrong, name in (({"type": "axn"}, "axon"), ({"where": "depth=1"}, "where"), ({"own": False, "approximate": True}, "")):
        with pytest.raises(ValueError, match=name):
            s.nearest(point, **wrong)
    with pytest.raises(KeyError):
        s.nearest(point, cell="nobody")


def test_ranks_choose_columns(s, random):
    points = points_about(s, random, 20)
    all_ranks = s.nearest(points, k=6)
    np.testing.assert_array_equal(s.nearest(points, k=[5, 1]), all_ranks[:, [4, 0]])
    np.testing.assert_array_equal(s.nearest(points, k=np.int64(1)), all_ranks[:, 0])


def test_fewer_neighbours_than_k_give_blank_rows(small):
    with ff.open(small) as opened:
        hits = opened.nearest([0, 0, 0], k=20)
    found = np.isfinite(hits["distance"])
    assert found.sum() == 4 + 5 + 1
    blank = hits[~found]
    assert np.isnan(blank["x"]).all() and (blank["sample"] == -1).all() and (blank["cell"] == 2**32 - 1).all()


def test_bound_is_open_as_in_scipy(small):
    with ff.open(small) as opened:
        point = [100, 3, 0]
        assert np.isinf(opened.nearest(point, distance_upper_bound=3.0)["distance"])
        assert opened.nearest(point, distance_upper_bound=np.nextafter(3.0, 4))["distance"] == 3.0
        assert np.isinf(opened.nearest([100, 0, 0], distance_upper_bound=0)["distance"])


def test_eps_bounds_the_error_and_is_not_exact(s, random):
    points = points_about(s, random, 200)
    exact, loose = s.nearest(points), s.nearest(points, eps=0.5)
    assert (loose["distance"] <= exact["distance"] * 1.5).all() and not loose["exact"].any()


def test_workers_change_nothing(s, random):
    points = points_about(s, random, 3000)
    one = s.nearest(points, k=2)
    for workers in (2, -1):
        np.testing.assert_array_equal(s.nearest(points, k=2, workers=workers), one)


def test_approximate_reads_no_tile(s, random):
    hits = s.nearest(points_about(s, random, 50), approximate=True)
    assert s.resident_bytes == 0 and not hits["exact"].any() and np.isfinite(hits["distance"]).all()


@pytest.mark.parametrize("make", [
    lambda p: p.astype("f4"), lambda p: np.asfortranarray(p), lambda p: p.tolist(), lambda p: p[::-1][::-1],
    lambda p: np.frombuffer(b"x" + p.tobytes(), "f8", offset=1).reshape(p.shape), lambda p: p.astype(">f8"),
    lambda p: np.ma.masked_array(p), lambda p: np.concatenate([p, p], axis=1)[:, :3]])
def test_layouts_and_types_of_points_are_taken(s, make):
    points = np.array([[0.0, 700, 0], [12.5, 300, -8], [1, 2, 3]])
    np.testing.assert_array_equal(s.nearest(make(points)), s.nearest(points))


@pytest.mark.parametrize("arguments, error, name", [
    (dict(points=[0, 0]), ValueError, "points"), (dict(points=5.0), ValueError, "points"),
    (dict(points=np.zeros((3, 2))), ValueError, "points"), (dict(points=[]), ValueError, "points"),
    (dict(points=[0, 0, np.nan]), ValueError, "points"), (dict(points=[[0, 0, 0], [0, np.inf, 0]]), ValueError, "points"),
    (dict(points="abc"), TypeError, "points"), (dict(points=None), TypeError, "points"),
    (dict(points=[1j, 0, 0]), TypeError, "points"), (dict(points=["1", "2", "3"]), TypeError, "points"),
    (dict(points=[[0, 0, 0], [0, 0]]), ValueError, "points"), (dict(points=[1e200, 0, 0]), ValueError, "point"),
    (dict(k=0), ValueError, "k"), (dict(k=-1), ValueError, "k"), (dict(k=1.5), TypeError, "k"),
    (dict(k=[0]), ValueError, "k"), (dict(k=[]), ValueError, "k"), (dict(k="3"), TypeError, "k"),
    (dict(k=2**70), ValueError, "k"), (dict(k=2**60), MemoryError, "k"),
    (dict(eps=-1), ValueError, "eps"), (dict(eps=np.nan), ValueError, "eps"), (dict(eps="x"), TypeError, "eps"),
    (dict(distance_upper_bound=-1), ValueError, "distance_upper_bound"),
    (dict(distance_upper_bound=np.nan), ValueError, "distance_upper_bound"),
    (dict(workers=0), ValueError, "workers"), (dict(workers=None), TypeError, "workers")])
def test_wrong_arguments_are_named(s, arguments, error, name):
    with pytest.raises(error, match=name):
        s.nearest(**{"points": [0, 0, 0], **arguments})


def test_snap_moves_points_onto_neurites(s, brute, random):
    points = points_about(s, random, 25)
    moved, distance = s.snap(points)
    np.testing.assert_allclose(np.linalg.norm(moved - points, axis=1), distance)
    np.testing.assert_allclose(distance, [brute.distances(p).min() for p in points])
    one, single = s.snap(points[0])
    assert one.shape == (3,) and float(single) == distance[0]


def meeting(brute, lo, hi):
    """Segments that meet a box, by clipping the parameter range."""
    a, d = brute.ends[:, 0], brute.ends[:, 1] - brute.ends[:, 0]
    begin, end = np.zeros(len(a)), np.ones(len(a))
    inside = np.ones(len(a), bool)
    for axis in range(3):
        still = d[:, axis] == 0
        inside &= ~still | ((a[:, axis] >= lo[axis]) & (a[:, axis] <= hi[axis]))
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.sort(np.stack([(lo[axis] - a[:, axis]) / d[:, axis], (hi[axis] - a[:, axis]) / d[:, axis]]), axis=0)
        begin, end = np.where(still, begin, np.maximum(begin, t[0])), np.where(still, end, np.minimum(end, t[1]))
    return inside & (begin <= end)


def test_messages_name_the_argument_and_the_shape(s):
    with pytest.raises(ValueError, match=r"^points: expected shape \(3,\) or \(..., 3\), got \(3, 5\); transpose it with .T$"):
        s.nearest(np.zeros((3, 5)))
    with pytest.raises(ValueError, match=r"^opposing_corner: expected shape \(3,\), got \(2,\)$"):
        s.box_query([0, 0, 0], [1, 2])


def test_box_query_is_brute_force(s, brute, random):
    middle = s.bounds.mean(axis=0)
    for _ in range(10):
        corner = middle + random.uniform(-300, 300, 3)
        other = corner + random.uniform(-80, 80, 3)
        lo, hi = np.round(np.sort([corner, other], axis=0) * 512) / 512
        wanted = meeting(brute, lo, hi)
        rows = s.box_query(corner, other)
        assert len(rows) == wanted.sum() == s.box_counts(corner, other)
        cells, counts = np.unique(brute.cells[wanted], return_counts=True)
        assert s.box_counts(other, corner, group_by="cell") == dict(zip(cells.tolist(), counts.tolist()))
        assert (np.diff(rows["distance"]) >= 0).all()


def test_fields_choose_columns_and_ends(s):
    point = s.nearest(s.bounds.mean(axis=0))
    corner = np.array([point["x"], point["y"], point["z"]])
    rows = s.box_query(corner - 20, corner + 20, fields=["cell", "segment", "x0", "x1", "y1", "z1"])
    assert rows.dtype.names == ("cell", "segment", "x0", "x1", "y1", "z1") and len(rows) > 0
    for row in rows:
        cell = s.cells[row["cell"]]
        child = cell.nodes[row["segment"]]
        parent = cell.nodes[cell.nodes["node_id"] == child["parent_id"]][0]
        assert row["x0"] == child["x"] and [row["x1"], row["y1"], row["z1"]] == [parent[a] for a in "xyz"]
    np.testing.assert_array_equal(s.box_query(corner - 20, corner + 20, fields="cell"), rows["cell"])
    for wrong in ("nothing", [], ["x", "x"]):
        with pytest.raises(ValueError, match="fields"):
            s.box_query(corner - 20, corner + 20, fields=wrong)
    assert len(s.box_query([1e6] * 3, [1e6 + 1] * 3, fields=["x0"])) == 0


def test_sphere_query_is_brute_force(s, brute, random):
    for point in points_about(s, random, 10):
        radius = float(brute.distances(point).min() + random.uniform(1, 60))
        wanted = brute.distances(point) <= radius
        assert len(s.sphere_query(point, radius)) == wanted.sum() == s.sphere_counts(point, radius)
    with pytest.raises(ValueError, match="radius"):
        s.sphere_query([0, 0, 0], -1)
    with pytest.raises(ValueError, match="group_by"):
        s.sphere_counts([0, 0, 0], 1, group_by="type")


def test_ray_finds_what_it_passes(small):
    with ff.open(small) as opened:
        hits = opened.ray([-100, 0, 0], [1, 0, 0], radius=0.5)
        assert (np.diff(hits["along"]) >= 0).all() and hits["along"][-1] == pytest.approx(200)
        assert {opened.cells[i].name for i in hits["cell"]} == {"fork", "loop", "é one"}
        assert len(opened.ray([-100, 0, 0], [1, 0, 0], radius=0.5, k=2)) == 2
        assert len(opened.ray([-100, 0, 0], [1, 0, 0], radius=0.5, length=10)) == 0
        for wrong in (dict(direction=[0, 0, 0]), dict(radius=-1), dict(slope=-1), dict(k=0), dict(length=np.nan)):
            with pytest.raises(ValueError, match=next(iter(wrong))):
                opened.ray(**{"origin": [0, 0, 0], "direction": [1, 0, 0], **wrong})


def test_levels_draw_a_box(s):
    picture = s.levels(s.bounds, 500)
    full = s.levels(s.bounds, 1e6)
    assert 0 < len(picture.segments) <= len(full.segments) and full.error <= picture.error
    assert picture.error <= (s.bounds[1] - s.bounds[0]).max() / 500 * 1.001 or picture.limited
    for wrong in (dict(box=[0, 0, 0]), dict(pixels=0), dict(pixels=np.nan), dict(segments=0), dict(box=np.zeros((2, 3)))):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            s.levels(**{"box": s.bounds, "pixels": 100, **wrong})


def test_levels_are_needed(archive, tmp_path):
    ff.ingest(archive, tmp_path / "plain.fil", levels=False)
    with ff.open(tmp_path / "plain.fil") as opened, pytest.raises(ValueError, match="levels"):
        opened.levels(opened.bounds, 100)
