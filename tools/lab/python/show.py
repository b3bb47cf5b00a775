"""Opens a set, asks for a thousand nearest points and makes one cell a graph of networkx; prints time and memory.

    python3 show.py SET
"""

import pathlib
import sys
import time

import numpy as np

import filiform as ff


def memory():
    for line in pathlib.Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return float("nan")


def step(name, function):
    begin = time.perf_counter()
    result = function()
    print(f"{name:<44} {1000 * (time.perf_counter() - begin):9.1f} ms, {memory():6.0f} MiB")
    return result


print(f"{'after import filiform, numpy':<44} {'':>9}     {memory():6.0f} MiB")
s = step("open", lambda: ff.open(sys.argv[1]))
print(s)
points = np.random.default_rng(1).uniform(*s.bounds, (1000, 3))
hits = step("a thousand nearest points, cold", lambda: s.nearest(points))
step("the same again", lambda: s.nearest(points))
cell = step("the cell of the first", lambda: s.cells[hits[0]["cell"]])
step("its arrays", lambda: (cell.nodes, cell.edges))
step("import networkx", lambda: __import__("networkx"))
graph = step("the cell as a graph", lambda: cell.to_networkx())
print(graph)
