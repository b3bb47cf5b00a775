"""Travel: the caller is the device."""

import os
import threading

import numpy as np
import pytest

import filiform as ff


def route(travel, ticks=400):
    forces = []
    for i in range(ticks):
        forces.append(travel.tick([0.00002 * i, 0.00001 * i, 0]).force)
    return np.array(forces)


def test_the_result_depends_on_the_calls_alone(s):
    hit = s.nearest(s.bounds.mean(axis=0))
    found = []
    for _ in range(2):
        with ff.Travel(s) as travel:
            travel.jump(hit)
            found.append(route(travel))
    assert (found[0] == found[1]).all() and 0 < np.linalg.norm(found[0], axis=1).max() <= 8
    with ff.Travel(s) as travel:
        travel.jump(hit)
        place = travel.tick([0, 0, 0])
        assert (place.cell, place.segment) == (hit["cell"], hit["segment"]) and place.t == pytest.approx(hit["t"])
        assert place.proxy == pytest.approx([hit["x"], hit["y"], hit["z"]])


def test_the_force_pulls_back_to_the_neurite(example):
    with ff.open(example / "column.fil") as s, ff.Travel(s, zoom=120) as travel:  # 1 mm of the hand is 1 um
        travel.jump([0, 20, 0])  # the axon of L5_1 runs along y
        for _ in range(1000):
            tick = travel.tick([0.004, 0, 0])
        assert tick.force[0] < -0.1 and abs(tick.force[1]) < 1e-6 and tick.proxy == pytest.approx([0, 20, 0])
        for i in range(1000):
            tick = travel.tick([0.004, 0.00001 * i, 0])
        assert tick.proxy[1] > 25 and tick.hand == pytest.approx([4, 29.99, 0])


def test_realtime_and_options(s):
    with ff.Travel(s, realtime=True, method="force", zoom=100, stiffness=150, budget="64MiB") as travel:
        travel.jump(s.bounds.mean(axis=0))
        route(travel, 50)
        assert travel.residency()["budget_bytes"] == 64 * 2**20
        travel.zoom(2)
        travel.rotate(0.1, 0)
        travel.centre()
        assert np.isfinite(travel.tick([0, 0, 0]).force).all()


def test_mistakes_are_named(s, small):
    for arguments, error, text in (
        (dict(method="fly"), ValueError, "fly"),
        (dict(zoom=0), ValueError, "zoom: must be above 0"),
        (dict(stiffness="stiff"), TypeError, "stiffness"),
        (dict(budget=1), ValueError, "budget"),
    ):
        with pytest.raises(error, match=text):
            ff.Travel(s, **arguments)
    with pytest.raises(TypeError, match="scene: expected a Set, got str"):
        ff.Travel("column.fil")
    with ff.Travel(s) as travel:
        for call, error, text in (
            (lambda: travel.tick([0, 0]), ValueError, "hand: expected shape"),
            (lambda: travel.tick([0, 0, 0], 0), ValueError, "dt: must be above 0"),
            (lambda: travel.tick([0, 0, np.nan]), ValueError, "hand"),
            (lambda: travel.jump("soma"), (TypeError, ValueError), "place"),
            (lambda: travel.zoom(-1), ValueError, "factor: must be above 0"),
        ):
            with pytest.raises(error, match=text):
                call()
        with ff.open(small) as other, pytest.raises(ValueError, match="this row is not of a segment of the set"):
            travel.jump(other.nearest([1e6, 0, 0]))
    travel.close()  # once more
    with pytest.raises(ValueError, match="travel: it is closed"):
        travel.tick([0, 0, 0])


def test_one_thread_at_a_time_and_a_closed_set(column):
    s = ff.open(column)
    travel = ff.Travel(s, realtime=True)
    travel.jump(s.bounds.mean(axis=0))
    s.close()
    assert np.isfinite(travel.tick([0, 0, 0]).force).all()  # it keeps the set open
    errors = []

    def work():
        try:
            route(travel, 200)
        except ValueError as error:
            errors.append(str(error))

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all("another thread is in a call" in error for error in errors)
    assert np.isfinite(travel.tick([0, 0, 0]).force).all()
    travel.close()


def test_a_forked_process_opens_its_own(s):
    travel = ff.Travel(s, realtime=True)
    travel.jump(s.bounds.mean(axis=0))
    child = os.fork()
    if child == 0:
        try:
            travel.tick([0, 0, 0])
        except ValueError as error:
            own = ff.Travel(s)
            own.jump(s.bounds.mean(axis=0))
            os._exit(0 if "before fork" in str(error) and np.isfinite(own.tick([0, 0, 0]).force).all() else 1)
        os._exit(2)
    assert os.waitpid(child, 0)[1] == 0
