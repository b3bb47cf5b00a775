"""Measures the Python package: against the same loop in C++, and against scipy. RESULTS.md has figures.

    PYTHONPATH=build/release/python python3 tools/lab/python/compare.py SET LOOP [--points N]

SET: a tile set. LOOP: the program filiform_python_loop (target of the same name). Each row: median of 5, least, most.
"""

import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

import filiform as ff

REPEATS = 5


def memory():
    for line in pathlib.Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return float("nan")


def row(name, values, unit):
    print(f"| {name} | {np.median(values):.3f} {unit} | {min(values):.3f} to {max(values):.3f} |")


def timed(function):
    begin = time.perf_counter()
    function()
    return time.perf_counter() - begin


def against_cpp(s, loop, points):
    with tempfile.NamedTemporaryFile() as file:
        points.tofile(file.name)
        s.nearest(points)
        few = points[:20_000]
        python_all, python_one, cpp_all, cpp_one, python_ndarray = [], [], [], [], []
        rows = [np.ascontiguousarray(p) for p in few]
        for _ in range(REPEATS):  # in turns, so that both meet the same machine
            told = subprocess.run([loop, s.path, file.name, "1"], capture_output=True, text=True, check=True).stdout.split()
            cpp_all.append(float(told[told.index("all") + 1]))
            cpp_one.append(float(told[told.index("one") + 1]))
            python_all.append(timed(lambda: s.nearest(points)))
            nearest = s.nearest
            begin = time.perf_counter()
            for p in rows:
                nearest(p)
            python_one.append(1e6 * (time.perf_counter() - begin) / len(rows))
    row(f"C++, {len(points)} points", cpp_all, "s")
    row(f"Python, {len(points)} points", python_all, "s")
    row("ratio, of each pair", [p / c for p, c in zip(python_all, cpp_all)], "")
    row("C++, one point", cpp_one, "us")
    row("Python, one point", python_one, "us")
    row("one point: Python over C++", [p - c for p, c in zip(python_one, cpp_one)], "us")


def resampled(s, step):
    """Points every `step` um along all segments."""
    parts = []
    for cell in s.cells.find("*"):
        ends = cell.vertices[cell.edges]
        lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        count = np.maximum(np.ceil(lengths / step).astype(int), 1)
        which = np.repeat(np.arange(len(ends)), count)
        t = (np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)) / count[which]
        parts.append(ends[which, 0] + t[:, None] * (ends[which, 1] - ends[which, 0]))
        parts.append(cell.vertices)
    return np.concatenate(parts)


def against_scipy(path, points):
    from scipy.spatial import cKDTree

    before = memory()
    begin = time.perf_counter()
    s = ff.open(path)
    exact = s.nearest(points)
    print(f"| filiform: open, then {len(points)} points, cold | {time.perf_counter() - begin:.3f} s | |")
    row("filiform: the same again", [timed(lambda: s.nearest(points)) for _ in range(REPEATS)], "s")
    print(f"| filiform: memory | {memory() - before:.0f} MiB | |")
    for name, make in (("every 0.5 um", lambda: resampled(s, 0.5)),
                       ("samples only, as navis snaps", lambda: np.concatenate([c.vertices for c in s.cells.find("*")]))):
        sites = make()
        before = memory()
        begin = time.perf_counter()
        tree = cKDTree(sites)
        print(f"| cKDTree, {name}: build, {len(sites)} points | {time.perf_counter() - begin:.3f} s | |")
        row(f"cKDTree, {name}: {len(points)} points", [timed(lambda: tree.query(points)) for _ in range(3)], "s")
        print(f"| cKDTree, {name}: memory, its points included | {memory() - before + sites.nbytes / 2**20:.0f} MiB | |")
        error = tree.query(points)[0] - exact["distance"]
        print(f"| cKDTree, {name}: distance too long by | {error.mean():.4f} um in the mean | at most {error.max():.3f} um |")
        del tree, sites


def importing():
    def spawn(code):
        return timed(lambda: subprocess.run([sys.executable, "-c", code], check=True))

    row("python3 -c 'import numpy'", [spawn("import numpy") for _ in range(REPEATS)], "s")
    row("python3 -c 'import filiform'", [spawn("import filiform") for _ in range(REPEATS)], "s")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("set")
    parser.add_argument("loop")
    parser.add_argument("--points", type=int, default=1_000_000)
    arguments = parser.parse_args()
    with ff.open(arguments.set, budget="4GiB") as s:
        print(s, f"on {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
        points = np.random.default_rng(1).uniform(*s.bounds, (arguments.points, 3))
        print("| what | median | least to most |\n|---|---|---|")
        importing()
        against_cpp(s, arguments.loop, points)
    against_scipy(arguments.set, points[:200_000])


if __name__ == "__main__":
    main()
