"""Contacts by points, with scipy's cKDTree as navis does, beside filiform: time, memory, and what points miss.

    filiform export SET --all -o cells/
    filiform contacts SET --types axon,dendrite --within 2 -o contacts.tsv
    python3 tools/lab/python/contacts_points.py cells contacts.tsv [--within 2] [--step 0.5]

cells: SWC files. Points lie at most `step` apart on each segment, ends included. A pair of segments of two cells is
found if a point of one lies within the distance of a point of the other. contacts.tsv has all pairs.
"""

import argparse
import csv
import pathlib
import resource
import time

import numpy as np
from scipy.spatial import cKDTree

AXON, DENDRITES = 2, (3, 4)


def segments(folder):
    """Child, parent, type of the child, and cell of each segment."""
    parts = []
    for cell, path in enumerate(sorted(pathlib.Path(folder).rglob("*.swc"))):
        rows = np.loadtxt(path, ndmin=2)
        order = np.argsort(rows[:, 0])
        ids = rows[order, 0]
        child = rows[rows[:, 6] >= 0]
        parent = rows[order[np.searchsorted(ids, child[:, 6])]]
        parts.append((child[:, 2:5], parent[:, 2:5], child[:, 1].astype(int), np.full(len(child), cell)))
    return [np.concatenate(columns) for columns in zip(*parts)]


def points(child, parent, step):
    """Points on the segments, and the segment of each."""
    steps = np.maximum(np.ceil(np.linalg.norm(parent - child, axis=1) / step).astype(int), 1)
    of = np.repeat(np.arange(len(child)), steps + 1)
    at = np.arange(len(of)) - np.repeat(np.cumsum(steps + 1) - (steps + 1), steps + 1)
    t = (at / steps[of])[:, None]
    return child[of] + t * (parent[of] - child[of]), of


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cells")
    parser.add_argument("contacts")
    parser.add_argument("--within", type=float, default=2, metavar="UM")
    parser.add_argument("--step", type=float, default=0.5, metavar="UM")
    a = parser.parse_args()
    child, parent, kind, cell = segments(a.cells)
    read_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

    start = time.process_time()
    axons, dendrites = np.flatnonzero(kind == AXON), np.flatnonzero(np.isin(kind, DENDRITES))
    axon_points, axon_of = points(child[axons], parent[axons], a.step)
    dendrite_points, dendrite_of = points(child[dendrites], parent[dendrites], a.step)
    tree = cKDTree(dendrite_points)
    built_s = time.process_time() - start
    found = []
    for begin in range(0, len(axon_points), 100_000):  # all at once take more memory
        near = tree.query_ball_point(axon_points[begin:begin + 100_000], a.within)
        count = np.fromiter(map(len, near), int, len(near))
        if not count.any():
            continue
        first = axons[np.repeat(axon_of[begin:begin + 100_000], count)]
        second = dendrites[dendrite_of[np.concatenate([n for n in near if n]).astype(int)]]
        other = cell[first] != cell[second]
        found.append(np.unique(first[other] * len(child) + second[other]))
    pairs = np.unique(np.concatenate(found))
    cells = np.unique(cell[pairs // len(child)] * (cell.max() + 1) + cell[pairs % len(child)])
    cpu_s = time.process_time() - start

    with open(a.contacts) as rows:
        table = list(csv.DictReader(rows, delimiter="\t"))
    exact = sum(int(row["pairs"]) for row in table)
    exact_cells = len({(row["from"], row["to"]) for row in table})
    print(f"{len(child)} segments, {len(axon_points)} + {len(dendrite_points)} points")
    print(f"points: {cpu_s:.1f} s of CPU time, {built_s:.1f} s of it for the tree; "
          f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MiB, {read_mib:.0f} MiB of it for the cells")
    print(f"pairs of segments: {len(pairs)} of {exact}; {exact - len(pairs)} missed")
    print(f"pairs of cells: {len(cells)} of {exact_cells}; {exact_cells - len(cells)} missed")


if __name__ == "__main__":
    main()
