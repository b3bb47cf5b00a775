"""Set: opening, closing, pickling, forked processes, damage, addresses, leaks."""

import contextlib
import gc
import multiprocessing
import os
import pathlib
import pickle
import re
import shutil
import subprocess
import sys
import threading
import urllib.request

import numpy as np
import pytest

import filiform as ff
from conftest import points_about


def test_info_is_that_of_the_program(column, s):
    import json
    from conftest import run
    assert s.info() == json.loads(run("info", column, "--json"))
    assert s.revision == s.info()["revision"] and s.bounds.shape == (2, 3) and s.units == "1 micrometer"
    assert "12 cells" in repr(s) and s.path == str(column)


def test_missing_sets_are_oserrors(tmp_path):
    with pytest.raises(FileNotFoundError, match="column.fil"):
        ff.open(tmp_path / "column.fil")
    (tmp_path / "file").write_text("")
    with pytest.raises(NotADirectoryError):
        ff.open(tmp_path / "file")
    with pytest.raises(OSError):
        ff.open(tmp_path)
    for wrong in (3, b"x", None):
        with pytest.raises(TypeError):
            ff.open(wrong)
    with pytest.raises(ValueError):
        ff.open(tmp_path, budget="much")


def test_closed_sets_say_so(column):
    opened = ff.open(column)
    cell, cells = opened.cells.at(0), opened.cells
    opened.close()
    opened.close()
    assert opened.closed and "closed" in repr(opened)
    for call in (lambda: opened.nearest([0, 0, 0]), lambda: opened.info(), lambda: opened.bounds, lambda: len(cells),
                 lambda: cells["x"], lambda: "x" in cells, lambda: cell.nodes, lambda: opened.box_counts([0] * 3, [1] * 3),
                 lambda: opened.navigate(), lambda: opened.levels(np.eye(3)[:2], 3), lambda: ff.render(opened),
                 lambda: pickle.dumps(opened), lambda: opened.ray([0] * 3, [1] * 3), lambda: opened.snap([0] * 3)):
        with pytest.raises(ValueError, match="closed"):
            call()


def test_closing_waits_for_calls_under_way(column, random):
    opened = ff.open(column)
    points = points_about(opened, random, 20_000)
    results = []
    thread = threading.Thread(target=lambda: results.append(opened.nearest(points)))
    thread.start()
    opened.close()
    thread.join()
    assert len(results) in (0, 1)  # 0: the call came after close()


def damage(folder, pattern):
    for pack in pathlib.Path(folder).rglob(pattern):
        content = bytearray(pack.read_bytes())
        for i in range(len(content) // 3, len(content), 97):
            content[i] ^= 0x55
        pack.write_bytes(content)


def test_damage_is_corrupt_set(column, tmp_path, random):
    shutil.copytree(column, tmp_path / "bad.fil")
    for file in (tmp_path / "bad.fil").rglob("*"):
        if file.is_file() and file.stat().st_size > 20_000:
            damage(file.parent, file.name)
    with pytest.raises(ff.CorruptSet):
        with ff.open(tmp_path / "bad.fil") as opened:
            opened.nearest(points_about(opened, random, 2000))
            opened.cells.at(0).nodes
    assert not issubclass(ff.CorruptSet, (OSError, ValueError))


def test_sets_and_cells_pickle_as_paths(s, column, monkeypatch, tmp_path):
    pickled = pickle.dumps((s, s.cells.at(3)))
    assert len(pickled) < 1000
    monkeypatch.chdir(tmp_path)  # a worker may have another folder
    again, cell = pickle.loads(pickled)
    assert again == s and again is not s and cell == s.cells.at(3) and hash(again) == hash(s)
    np.testing.assert_array_equal(again.nearest([[0, 0, 0]]), s.nearest([[0, 0, 0]]))
    np.testing.assert_array_equal(cell.nodes, s.cells.at(3).nodes)


@pytest.fixture
def published(tmp_path):
    """A set, and a function that publishes another revision of it."""
    def publish(name):
        (tmp_path / f"{name}.swc").write_text("1 1 0 0 0 1 -1\n2 3 9 0 0 1 1\n")
        ff.ingest(tmp_path / f"{name}.swc", tmp_path / "a.fil", force=True)

    publish("first")
    return tmp_path / "a.fil", publish


def _names(opened):
    return opened.revision, opened.cells.names


def test_a_pickle_is_the_same_revision_or_an_error(published):
    path, publish = published
    with ff.open(path) as old:
        pickled = pickle.dumps((old, old.cells.at(0)))
        assert pickle.loads(pickled) == (old, old.cells.at(0))
        revision, cell = old.revision, old.cells.at(0)
        publish("second")
        with ff.open(path) as new:
            assert old != new and hash(old) != hash(new) and cell != new.cells.at(0)
            assert old.__dask_tokenize__() != new.__dask_tokenize__() and old.revision == revision
            assert cell.__dask_tokenize__() != new.cells.at(0).__dask_tokenize__()
            with pytest.raises(ValueError, match="another revision"):
                new.cells.index(cell)
        for again in (lambda: pickle.loads(pickled)[0].cells.names, lambda: pickle.loads(pickled)[1].name,
                      lambda: ff.open(path, revision=revision)):
            with pytest.raises(OSError, match=f"{revision} cannot be read .*open the set again") as raised:
                again()
            assert "\n" not in str(raised.value)
        assert old.cells.names == ["first"]  # what is open stays
    with pytest.raises(ValueError, match="not the name of a revision"):
        ff.open(path, revision="newest")


@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_a_pool_sees_one_revision_while_another_is_published(published, method):
    path, publish = published
    with ff.open(path) as opened, multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.apply(_names, (opened,)) == (opened.revision, ["first"])
        publish("second")
        with pytest.raises(OSError, match="open the set again"):
            pool.apply(_names, (opened,))
        assert _names(opened)[1] == ["first"]


def test_a_forked_process_sees_the_revision_of_its_parent_or_an_error(published):
    path, publish = published
    with ff.open(path) as opened:
        publish("second")
        child = os.fork()
        if child == 0:
            try:
                status = 2 if opened.cells.names == ["second"] else 0
            except OSError:
                status = 1
            os._exit(status)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 1


def test_pickles_hold_neither_token_nor_cache(column, tmp_path):
    with ff.open(column, token="SECRET", cache=tmp_path / "kept_here") as opened:
        pickled = pickle.dumps((opened, opened.cells.at(0), opened.cells))
        assert b"SECRET" not in pickled and b"kept_here" not in pickled
        import copy
        assert copy.copy(opened) is opened and copy.deepcopy([opened]) == [opened]


def _distances(job):
    opened, points = job
    return opened.nearest(points)["distance"].sum()


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_processes_share_a_set(s, random, method):
    points = points_about(s, random, 400)
    with multiprocessing.get_context(method).Pool(2) as pool:
        sums = pool.map(_distances, [(s, part) for part in np.split(points, 4)])
    assert sum(sums) == pytest.approx(s.nearest(points)["distance"].sum())


def test_a_graph_of_tasks_pickles(s, random):
    """What dask does: functions with a set in their arguments, pickled, run elsewhere."""
    from concurrent.futures import ProcessPoolExecutor
    points = points_about(s, random, 100)
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        futures = [pool.submit(_distances, (s, part)) for part in np.array_split(points, 3)]
        assert sum(f.result() for f in futures) == pytest.approx(s.nearest(points)["distance"].sum())


def test_a_fork_uses_the_set_while_other_threads_do(s, random):
    points = points_about(s, random, 20_000)
    wanted = s.nearest(points[:50])
    busy = threading.Event()
    ended = threading.Event()

    def search():
        while not ended.is_set():
            busy.set()
            s.nearest(points)

    threads = [threading.Thread(target=search) for _ in range(3)]
    for thread in threads:
        thread.start()
    busy.wait()
    try:
        for _ in range(10):
            child = os.fork()
            if child == 0:
                status = 1
                try:
                    status = 0 if (s.nearest(points[:50]) == wanted).all() else 2
                finally:
                    os._exit(status)
            assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    finally:
        ended.set()
        for thread in threads:
            thread.join()


@contextlib.contextmanager
def served(path, *options):
    """The address of a server with this set."""
    program = os.environ.get("FILIFORM_PROGRAM", "filiform")
    server = subprocess.Popen([program, "serve", str(path), "--no-token", "--listen", "127.0.0.1:0", *options], stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, text=True)
    try:
        found = next(filter(None, (re.search(r"http://[0-9.]+:[0-9]+", line) for line in server.stdout)), None)
        assert found, "filiform serve tells no address"
        yield found[0]
    finally:
        server.terminate()
        server.wait()
        server.stdout.close()


def test_a_set_at_an_address_answers_alike(s, column, random):
    points = points_about(s, random, 50)
    with served(column) as address:
        with ff.open(address + "/v1/sets/column") as remote:
            np.testing.assert_array_equal(remote.nearest(points, k=2), s.nearest(points, k=2))
            assert remote.cells.names == s.cells.names
            np.testing.assert_array_equal(remote.cells.at(1).nodes, s.cells.at(1).nodes)
            assert pickle.loads(pickle.dumps(remote)) == remote
            child = os.fork()
            if child == 0:
                os._exit(0 if (remote.nearest(points) == s.nearest(points)).all() else 1)
            assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
        with pytest.raises(OSError):
            ff.open(address + "/v1/sets/nothing")
    with pytest.raises(ValueError):
        ff.open("http://")


# The client reads tiles, so a service needs no route for these.
ASKED = {
    "box_counts": lambda s, lo, hi: s.box_counts(lo, hi, group_by="cell"),
    "box_counts_once": lambda s, lo, hi: s.box_counts(lo, hi, once=True, type="axon"),
    "sphere_counts": lambda s, lo, hi: s.sphere_counts((lo + hi) / 2, 100, group_by="cell"),
    "density": lambda s, lo, hi: s.density(100).density,
    "density_by_cell": lambda s, lo, hi: s.density(100, group_by="cell,type").rows,
    "box_query": lambda s, lo, hi: s.box_query(lo, hi),
    "ray": lambda s, lo, hi: s.ray(lo, hi - lo, radius=20),
    "segments": lambda s, lo, hi: s.segments(box=(lo, hi)),
    "levels": lambda s, lo, hi: s.levels(s.bounds, pixels=100).segments,
    "measure": lambda s, lo, hi: s.measure(frame=False)["length_um"],
    "contacts": lambda s, lo, hi: s.contacts(2, frame=False)["distance_um"],
    "path": lambda s, lo, hi: s.cells.at(0).path("soma").points,
}


@pytest.fixture(scope="module")
def remote(column):
    with served(column) as address, ff.open(address + "/v1/sets/column") as opened:
        yield opened


@pytest.mark.parametrize("question", ASKED)
def test_every_question_runs_on_a_set_at_an_address(s, remote, question):
    lo, hi = s.bounds.mean(axis=0) - 150, s.bounds.mean(axis=0) + 150
    here, there = (ASKED[question](opened, lo, hi) for opened in (s, remote))
    assert here if np.ndim(here) == 0 else np.size(here)  # a dict, a number or rows
    np.testing.assert_equal(there, here)


def test_a_view_of_a_set_at_an_address_names_the_page_for_travel(column):
    for option, framed in ((), False), (("--frame-origin", "http://localhost:8888"), True):
        with served(column, *option) as address, ff.open(address + "/v1/sets/column") as opened:
            view = opened.view()
            assert view.page == address + "/travel/column" and view.frames == framed
            with urllib.request.urlopen(view.page) as answer:
                assert answer.status == 200
            assert ("crossOriginIsolated" in view._repr_html_()) == framed


def memory():
    for line in pathlib.Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) << 10
    raise AssertionError


def test_opening_leaks_nothing(column):
    count = 100_000 if os.environ.get("FILIFORM_CAMPAIGN") else 2000

    def use():
        with ff.open(column) as opened:
            opened.nearest([0, 0, 0])
            opened.cells.at(0).bounds

    for _ in range(count // 10):
        use()
    gc.collect()
    before, files = memory(), len(os.listdir("/proc/self/fd"))
    for _ in range(count):
        use()
    gc.collect()
    grown = memory() - before
    print(f"campaign: opens of a set: {count}, memory grew by {grown} bytes")
    assert len(os.listdir("/proc/self/fd")) == files
    assert grown < max(4 << 20, 100 * count)


def test_results_leak_nothing(s, random):
    points = points_about(s, random, 1000)
    cell = s.cells.at(0)

    def use():
        s.nearest(points)
        s.box_query(points[0], points[1])
        ff.Cell(s, 0).nodes
        cell.path(int(cell.node_ids[0]))
        with pytest.raises(ValueError):
            s.nearest([0, 0])

    for _ in range(10):
        use()
    before = memory()
    for _ in range(50):
        use()
    assert memory() - before < 8 << 20


def test_import_is_light():
    """Only NumPy is imported, and no OpenGL. How long it takes is in RESULTS.md."""
    code = ("import sys, filiform; heavy = {'scipy', 'pandas', 'networkx', 'matplotlib', 'navis', 'filiform._render'};"
            "sys.exit(', '.join(heavy & set(sys.modules)) or None)")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_interrupting_a_search(column):
    """Ctrl-C ends a call that takes long, with KeyboardInterrupt."""
    code = f"""
import numpy as np, filiform as ff, sys
s = ff.open({str(column)!r})
points = np.random.default_rng(1).uniform(*s.bounds, (10_000_000, 3))
print("searching", flush=True)
try:
    s.nearest(points)
except KeyboardInterrupt:
    s.nearest([0, 0, 0])
    sys.exit(42)
"""
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    import signal
    import time
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    assert process.wait(60) == 42


def test_eight_threads_use_one_set(column, random):
    """Also run by tests/groups/python/threads.py under the thread sanitizer's build."""
    from threads import hammer
    with ff.open(column, budget=1 << 20) as opened:  # a small budget: tiles come and go
        hammer(opened, seconds=2, threads=8)
