"""Set.navigate: arrays of a travel, the same as the program's."""

import csv
import io

import numpy as np
import pytest

import filiform as ff
from conftest import run


def test_a_route_is_travelled(s):
    travel = s.navigate(cell=s.cells.at(0), route="longest", seconds=60)
    assert travel.outcome == "completed" and travel.summary["cell"] == s.cells.at(0).name
    count = len(travel)
    assert travel.time.shape == (count,) and travel.proxy.shape == travel.force.shape == travel.hand.shape == (count, 3)
    assert np.isfinite(travel.ticks["force"]).all() and np.linalg.norm(travel.force, axis=1).max() <= 10
    hits = s.nearest(travel.proxy[::50])
    np.testing.assert_allclose(hits["distance"], 0, atol=1e-9)  # the proxy is on a neurite
    assert "completed" in repr(travel)


def test_rows_are_those_of_the_program(column, s):
    travel = s.navigate(route="random:3", hand="firm", seed=4, seconds=1)
    rows = list(csv.DictReader(io.StringIO(run(
        "navigate", column, "--route", "random:3", "--hand", "firm", "--seed", 4, "--seconds", 1, "--csv", "-"))))
    assert len(rows) == len(travel)
    head = list(rows[0])
    position = [name for name in head if name.startswith(("px", "proxy_x", "p_x"))]
    assert position, head
    at = head.index(position[0])
    columns = np.array([[float(row[name]) for name in head[at:at + 3]] for row in rows])
    np.testing.assert_array_equal(columns, travel.proxy)


def test_recordings_are_replayed(s, tmp_path):
    travel = s.navigate(cell=s.cells.at(0), seconds=0.5, record=tmp_path / "a.rec")
    again = s.navigate(cell=s.cells.at(0), seconds=0.5, device=f"replay:{tmp_path / 'a.rec'}")
    np.testing.assert_array_equal(travel.ticks, again.ticks)


@pytest.mark.parametrize("wrong, error", [
    (dict(cell="nobody"), KeyError), (dict(route="nowhere"), ValueError), (dict(method="x"), ValueError),
    (dict(hand="iron"), (ValueError, RuntimeError)), (dict(seed=-1), ValueError), (dict(seconds=np.nan), ValueError),
    (dict(zoom=0), ValueError), (dict(leap=1.5), ValueError), (dict(rate=0), ValueError), (dict(stiffness=-5), ValueError), (dict(budget=1), ValueError),
    (dict(budget="x"), ValueError), (dict(seconds="1"), TypeError), (dict(record="/nowhere/a.rec"), OSError)])
def test_wrong_travels_are_refused(s, wrong, error):
    with pytest.raises(error):
        s.navigate(**wrong)
