"""Made-up calls: any function with any arguments gives a result or an exception of Python, never a crash.

Each part runs in a process of its own, which prints the call before it makes it.
"""

import os
import subprocess
import sys
import textwrap

import pytest

from conftest import SEED

PROGRAM = textwrap.dedent("""
    import random, sys
    import numpy as np
    import filiform as ff

    path, seed, count, scratch = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    draw = random.Random(seed)
    opened = ff.open(path)
    closed = ff.open(path)
    closed.close()
    cell = opened.cells.at(0)
    hit = opened.nearest(cell.vertices[5])
    lo, hi = opened.bounds
    VALUES = [
        None, True, 0, 1, 2, 3, -1, 10, 10**9, 2**31, 2**32, 2**63, 2**64, -2**63, 10**30, 0.0, 0.5, -0.5, 1e-300, 1e300,
        float("nan"), float("inf"), -float("inf"), "", "abc", "longest", "front", "cell", "fork", "*", "[", "\\ud800", "a\\0b",
        b"", b"x", [], (), [1, 2], [1, 2, 3], (1.0, 2.0), {}, {"x": 1}, set(), object(), len, int, range(3), [[0, 0, 0], [1, 1, 1]],
        [[0, 0, 0], [100, 100, 100]], [lo, hi], lo, hi, np.zeros(3), np.zeros((0, 3)), np.zeros((2, 3)), np.zeros((3, 2)),
        np.zeros((1, 1, 3)), np.float32([1, 2, 3]), np.array([1, 2, 3]), np.array(["a", "b", "c"]), np.array([1j, 2, 3]),
        np.array([object()] * 3), np.full(3, np.nan), np.full((5, 3), np.inf), np.zeros(()), np.int32(3), np.float64(2.5), np.bool_(1),
        np.uint64(2**63), hit, opened.nearest(np.zeros((2, 3))), opened, closed, cell, opened.cells, np.zeros((3, 3))[:, ::-1],
        np.ma.masked_array(np.zeros(3)), np.broadcast_to(np.zeros(3), (4, 3)), memoryview(np.zeros(3)), iter([1, 2]), Ellipsis,
        np.datetime64(0, "s"), np.zeros(3, dtype=[("x", "f8")]), "http://127.0.0.1:1/v1/sets/x", slice(1),
    ]
    POINTS = [lo, hi, np.zeros(3), [1, 2, 3], np.array([[0.0, 0, 0], [5, 5, 5]]), (hi + lo) / 2]

    def value():
        return draw.choice(POINTS) if draw.random() < 0.3 else draw.choice(VALUES)

    OBJECTS = [opened, opened, opened, closed, cell, cell, opened.cells, hit]
    SKIP = {"close", "to_navis", "to_dataframe", "to_networkx", "render", "navigate", "__class__", "__init_subclass__", "__subclasshook__",
            "__reduce__", "__reduce_ex__", "__getattribute__", "__setattr__", "__delattr__", "__dir__", "__del__", "to_swc"}
    KEYWORDS = {"nearest": ["k", "eps", "distance_upper_bound", "workers", "approximate"], "box_query": ["fields"], "sphere_query": ["fields"],
                "box_counts": ["group_by"], "sphere_counts": ["group_by"], "ray": ["radius", "slope", "length", "k"], "levels": ["segments"],
                "snap": ["workers"], "tips": ["most"]}

    def call():
        target = draw.choice(OBJECTS[:-1])
        if draw.random() < 0.07:
            function, name = ff._core.SetHandle, "SetHandle"
            for_core = [getattr(ff._core, n) for n in ("nearest", "box_query", "ray", "levels", "CellData", "parse_bytes", "navigate", "ingest")]
            function = draw.choice(for_core)
            arguments = [draw.choice([opened._handle, closed._handle, value()])] + [value() for _ in range(draw.randrange(14))]
            return function, arguments, {}
        if draw.random() < 0.05:
            return ff.open, [value()], {draw.choice(["token", "cache", "budget"]): value()}
        if draw.random() < 0.03:
            return ff.ingest, [value(), scratch], {draw.choice(["unit", "memory", "placements", "threads", "quantum", "capacity"]): value()}
        if draw.random() < 0.02:
            return opened.navigate, [value()], {draw.choice(["route", "method", "hand", "seed", "zoom", "rate", "stiffness", "budget", "device"]): value(),
                                                "seconds": 0.01}
        names = [n for n in dir(type(target)) if n not in SKIP and callable(getattr(type(target), n))]
        public = [n for n in names if not n.startswith("_")]
        name = draw.choice(public if draw.random() < 0.9 else names)
        keywords = {k: value() for k in KEYWORDS.get(name, []) if draw.random() < 0.3}
        return getattr(target, name), [value() for _ in range(draw.randrange(4))], keywords

    ended = {}
    for i in range(count):
        function, arguments, keywords = call()
        shown = f"{i} {getattr(function, '__qualname__', function)}"
        sys.stdout.write(shown + "\\n")
        try:
            function(*arguments, **keywords)
            kind = "result"
        except MemoryError:
            kind = "MemoryError"
        except Exception as error:
            kind = type(error).__name__
            if kind in ("SystemError", "AssertionError", "NotImplementedError", "UnboundLocalError", "NameError"):
                raise
        ended[kind] = ended.get(kind, 0) + 1
    print("ended:", ended)
""")


@pytest.mark.parametrize("part", range(4))
def test_no_call_crashes(column, tmp_path, part):
    count = 20_000 if os.environ.get("FILIFORM_CAMPAIGN") else 700
    done = subprocess.run([sys.executable, "-X", "faulthandler", "-c", PROGRAM, str(column), str(SEED + part), str(count),
                           str(tmp_path / "scratch.fil")], capture_output=True, text=True, errors="replace", timeout=1200)
    lines = done.stdout.splitlines()
    print(f"campaign: made-up calls, seed {SEED + part}: {count}, {lines[-1] if lines else ''}")
    assert done.returncode == 0, (lines[-3:], done.stderr[-3000:])
